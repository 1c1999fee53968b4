"""A wrong use of any command is one sentence, and its help has no marks of Python."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Snooker

from snooker_cli.cli.app import COMMANDS, loaded

NUMBERS = ("0", "-1", "1" + 40 * "0", "1e999", "nan", "inf", "", "x")


def numeric_options() -> Iterator[tuple[str, str]]:
    """The command and the option."""
    for name in COMMANDS:
        for each in loaded(name).params:
            if each.param_type_name == "option" and each.type_descriptor.annotation in (int, float):
                yield name, each.opts[-1]


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
    ("command", "sentence"),
    [
        ("plot small --dpi 5", "--dpi 5: give a number from 20 to 2000"),
        ("run small.yaml -j x", "--jobs x: give a whole number from 1 to 1024"),
        ("export small --repeat -1", "--repeat -1: give a number of 0 or more"),
        ("fit small --from x", "--from x: give a number"),
        (
            "plot small --size 9x9 --dpi 2000",
            "--size 9x9 --dpi 2000: give at most 10,000 pixels a side",
        ),
        ("show", "missing argument 'RUN'; see `snooker show --help`"),
        ("run small.yaml --jobs", "option '--jobs' requires an argument; see `snooker run --help`"),
        ("show small more", "got unexpected extra argument(s) (more); see `snooker show --help`"),
        (
            "shwo small",
            "there is no command shwo; the nearest is show, and `snooker --help` lists all",
        ),
        (
            "bench sped",
            "there is no command sped; the nearest is speed, and `snooker bench --help` lists all",
        ),
        (
            "animate small --out f.gif --pace slow",
            "--pace slow: 'slow' is not one of 'time', 'events'.",
        ),
    ],
)
def test_a_wrong_command_is_one_sentence(
    command: str, sentence: str, finished: Path, snooker: Snooker
) -> None:
    ended = snooker(*command.split())
    assert (ended.code, ended.out, ended.err) == (2, "", f"snooker: {sentence}\n")


@pytest.mark.parametrize("command", ["", "bench"])
def test_a_group_without_arguments_shows_its_help(command: str, snooker: Snooker) -> None:
    ended = snooker(*command.split())
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith(
        f"Usage: {' '.join(['snooker', *command.split()])} [OPTIONS] COMMAND"
    )
    assert "Commands:" in ended.err


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_no_braces_and_no_types_of_python(name: str, snooker: Snooker) -> None:
    text = snooker(name, "--help").out
    assert text.startswith(f"Usage: snooker {name} [OPTIONS]")
    assert not re.search(r"[{}]|<(str|path|list)|[<>]=", text)
    assert max(map(len, text.splitlines())) <= 80
