"""The commands by name, their help and options, and what the shell offers on Tab."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import Snooker
from config_texts import BASE

from snooker_cli.api.runs import Run
from snooker_cli.cli import main
from snooker_cli.cli.app import COMMANDS, HIDDEN, loaded
from snooker_cli.config import parse
from snooker_cli.signals import end_interrupted, handling

HEAVY = {"numba", "numpy", "scipy", "matplotlib", "h5py", "pydantic", "yaml", "jinja2", "typst"}
NUMBERS = ("0", "-1", "1" + 40 * "0", "nan", "inf")


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


def test_bash_completes_commands_and_options(
    snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_SNOOKER_COMPLETE", "complete_bash")
    for words, offer in (("snooker va", "validate"), ("snooker verify --ex", "--exact")):
        monkeypatch.setenv("COMP_WORDS", words.replace(" ", "\n"))
        monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
        ended = snooker()
        assert (ended.code, ended.out.strip(), ended.err) == (0, offer, "")


PRINTING = (
    *(f"{name} --help" for name in COMMANDS),
    *("", "init", "run small.yaml --fresh", "show small", "verify small", "fit small"),
    *("compare small --json", "plot small cooling", "export small --table", "schema"),
    *("plot small energi", "run small.yaml -o cor=2"),
    *("compare small", "run \u03b1.yaml"),
)


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_commands_print_plain_words_for_what_an_encoding_lacks(
    encoding: str, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows gives redirected output the encoding cp1252."""
    printed = {}
    for command in PRINTING:
        streams = [io.BytesIO(), io.BytesIO()]
        for name, stream in zip(("stdout", "stderr"), streams, strict=True):
            monkeypatch.setattr(sys, name, io.TextIOWrapper(stream, encoding))
        monkeypatch.setattr(sys, "argv", ["snooker", *command.split()])
        with handling(end_interrupted), pytest.raises(SystemExit) as end:
            main()
        sys.stdout.flush()
        sys.stderr.flush()
        out, err = (stream.getvalue().decode(encoding) for stream in streams)
        wrong = command in ("", "plot small energi", "run small.yaml -o cor=2", "run \u03b1.yaml")

        assert bool(end.value.code) == wrong, (command, err)
        assert out or err, command
        assert "bug" not in err
        assert "\\u" not in out + err or command in ("compare small --json", "schema"), command
        printed[command] = out + err
    assert "10.0; >= 0]" in printed["run --help"]
    assert "alpha = " in printed["compare small"]
    assert "alpha.yaml" in printed["run \u03b1.yaml"]
    assert ("±" in printed["compare small"]) == (encoding != "ascii")
    assert ("+/-" in printed["compare small"]) == (encoding == "ascii")


def test_figures_are_drawn_whatever_backend_the_environment_names(finished: Path) -> None:
    """A notebook names its own, which a program that it starts may not have."""
    command = [sys.executable, "-m", "snooker_cli", "plot", "small", "energy", "--format=svg"]
    subprocess.run(command, env=os.environ | {"MPLBACKEND": "nonsense"}, check=True)


def test_every_numeric_option_refuses_a_wrong_value_in_one_sentence(
    finished: Path, snooker: Snooker
) -> None:
    targets = {
        "run": ("small.yaml",),
        "plot": ("small", "energy", "--format=svg"),
        "export": ("small", "--states"),
        "animate": ("small", "--seconds=0.1", "--out=f.gif"),
    }
    options = [
        (name, parameter.opts[-1])
        for name in COMMANDS
        for parameter in loaded(name).params
        if parameter.param_type_name == "option"
        and parameter.type_descriptor.annotation in (int, float)
    ]
    assert len(options) > 10
    for name, option in options:
        for value in NUMBERS:
            ended = snooker(name, *targets.get(name, ("small",)), f"{option}={value}")
            if ended.code == 0:
                assert ended.err == "", (name, option, value)  # as a warning of NumPy would be
                continue
            assert ended.code == 2
            (line,) = ended.err.splitlines()
            assert line.startswith("snooker: "), (name, option, value)
            assert not re.search("Input|Error|error|bug", line), line


@pytest.mark.parametrize(
    ("text", "chosen"),
    [
        ("cor = 0.7,0.9", (0.7, 0.9)),
        ("cor=0.7:0.8:2", (0.7, 0.8)),
        ("cor=0.7:0.8", (0.7, 0.75, 0.8)),
        ("cor>=0.8", (0.8, 0.9)),
        ("cor < 0.75", 0.7),
        ("cor<=7.5e-1", (0.7, 0.75)),
        ("wall_cor>0", (0.5, 1.0)),
    ],
)
def test_values_that_fulfil_a_condition(text: str, chosen: object) -> None:
    """Of a range, those of the run's points that are numbers."""
    loaded_config = parse(BASE, "run.yaml", ["cor=0.7,0.75,0.8,0.9", "wall_cor=null,0,0.5,1"])
    run = Run(Path(), loaded_config.config, loaded_config.points())
    ((_, found),) = run.where(text).items()
    assert found == chosen
