"""The commands by name, their help and options, and what the shell offers on Tab."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Snooker
from config_texts import BASE

from snooker_cli.cli.app import COMMANDS, HIDDEN, loaded
from snooker_cli.cli.config_commands import examples
from snooker_cli.cli.options import conditions
from snooker_cli.config import parse
from snooker_cli.figures import FIGURES
from snooker_cli.runs import Run

HEAVY = {"numba", "numpy", "scipy", "matplotlib", "h5py", "pydantic", "yaml", "jinja2", "typst"}
NUMBERS = ("0", "-1", "1" + 40 * "0", "1e999", "nan", "inf", "", "x")


def test_help_lists_the_commands_without_loading_heavy_libraries() -> None:
    """Loading them takes a second, too long for `--help`."""
    script = (
        "import atexit, sys\n"
        "from snooker_cli.cli import main\n"
        "atexit.register(lambda: print(*sys.modules, file=sys.stderr))\n"
        "main()\n"
    )
    command = [sys.executable, "-c", script, "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    for name, (_, sentence) in COMMANDS.items():
        listed = re.search(rf"(?m)^  {name} +{re.escape(sentence)}$", done.stdout)
        assert bool(listed) == (name not in HIDDEN)
        assert loaded(name).help.splitlines()[0] == sentence
    modules = {name.partition(".")[0] for name in done.stderr.split()}
    assert "typer" in modules
    assert not modules & HEAVY


@pytest.mark.parametrize(
    ("words", "offers"), [("va", ["validate"]), ("verify --rep", ["--replay"])]
)
def test_bash_is_offered(
    words: str, offers: list[str], snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_SNOOKER_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "\n".join(["snooker", *words.split(" ")]))
    monkeypatch.setenv("COMP_CWORD", str(len(words.split(" "))))
    ended = snooker()
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.split() == offers


@pytest.mark.parametrize("command", ["", "bench"])
def test_a_group_without_arguments_shows_its_help(command: str, snooker: Snooker) -> None:
    ended = snooker(*command.split())
    assert (ended.code, ended.out) == (2, "")
    usage = " ".join(["Usage: snooker", *command.split()])
    assert ended.err.startswith(f"{usage} [OPTIONS] COMMAND")
    assert "Commands:" in ended.err


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_no_marks_of_python(name: str, snooker: Snooker) -> None:
    text = snooker(name, "--help").out
    assert text.startswith(f"Usage: snooker {name} [OPTIONS]")
    assert not re.search(r"[{}]|<(str|path|list)|[<>]=", text)
    assert max(map(len, text.splitlines())) <= 80


def numeric_options() -> Iterator[tuple[str, str]]:
    """Each command with each of its options that take a number."""
    for name in COMMANDS:
        for option in loaded(name).params:
            is_option = option.param_type_name == "option"
            if is_option and option.type_descriptor.annotation in (int, float):
                yield name, option.opts[-1]


def test_every_numeric_option_refuses_a_wrong_value_in_one_sentence(
    finished: Path, snooker: Snooker
) -> None:
    wrong = 0
    others = {
        "plot": ("energy", "--format=svg"),
        "export": ("--states",),
        "animate": ("--out=f.gif",),
    }
    for name, option in numeric_options():
        target = "small.yaml" if name == "run" else "small"
        for value in NUMBERS:
            ended = snooker(name, target, *others.get(name, ()), f"{option}={value}")
            if ended.code == 0:
                assert ended.err == "", (name, option, value)  # as a warning of NumPy would be
                continue
            wrong += 1
            assert ended.code == 2
            (line,) = ended.err.splitlines()
            assert line.startswith("snooker: "), (name, option, value)
            assert not re.search("Input|Error|error|bug", line), line
    assert wrong > 60


@pytest.mark.parametrize(
    ("text", "chosen"),
    [
        ("cor=0.8", 0.8),
        ("cor = 0.7,0.9", (0.7, 0.9)),
        ("cor=0.7:0.8:2", (0.7, 0.8)),
        ("cor=0.7:0.8", (0.7, 0.75, 0.8)),
        ("cor>0.8", 0.9),
        ("cor>=0.8", (0.8, 0.9)),
        ("cor < 0.75", 0.7),
        ("cor<=7.5e-1", (0.7, 0.75)),
        ("wall_cor>0", (0.5, 1.0)),
    ],
)
def test_values_that_fulfil_a_condition(text: str, chosen: object) -> None:
    """Of a range, those of the run's points that are numbers."""
    loaded_config = parse(BASE, "run.yaml", ["cor=0.7,0.75,0.8,0.9", "wall_cor=null,0,0.5,1"])
    run = Run(Path(), loaded_config.experiment, loaded_config.points())
    ((_, found),) = conditions([text], run).items()
    assert found == chosen


@pytest.mark.parametrize(("columns", "widest"), [(60, 60), (300, 100)])
@pytest.mark.parametrize("command", ["init --list", "plot --list", "plot small --list"])
def test_lists_fit_the_terminal_and_have_whole_names(
    command: str,
    columns: int,
    widest: int,
    finished: Path,
    snooker: Snooker,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    ended = snooker(*command.split())
    assert ended.code == 0
    lines = ended.out.splitlines()
    assert widest - 8 < max(map(len, lines)) <= widest
    first = {line.split()[0].rstrip(":") for line in lines if not line.startswith(" ")}
    assert first >= set(examples() if command.startswith("init") else FIGURES)
