"""What the command line says when something is wrong: a code and a sentence, never a traceback."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

TABLE: dict[str, Any] = yaml.safe_load(
    (Path(__file__).parents[1] / "data" / "bad_configs.yaml").read_text(encoding="utf-8")
)

Snooker = Callable[..., Any]
"""The fixture of that name: arguments in, code, out and err back."""


def tree(directory: Path) -> dict[str, bytes]:
    """The content of every file below a folder."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file()
    }


MISTAKES: dict[str, tuple[list[str], int, str]] = {
    "no config": (["run", "absent.yaml"], 3, r"absent\.yaml: there is no such file"),
    "folder as config": (["run", "runs"], 3, r"runs: this is a directory"),
    "value": (["run", "small.yaml", "-o", "cor=2"], 3, r"-o cor=2: .*a number from 0 to 1"),
    "key": (["run", "small.yaml", "-o", "coor=1"], 3, r"-o coor=1: .*did you mean cor"),
    "no value": (["run", "small.yaml", "-o", "cor"], 3, r"-o cor: "),
    "validate": (["validate", "small.yaml", "-o", "cor=-1"], 3, r"-o cor=-1: "),
    "other results": (
        ["run", "small.yaml", "-o", "seed=2"],
        2,
        r".*small: holds results of another",
    ),
    "not a run": (["run", "small.yaml", "--out", "."], 2, r"\.: is not empty and not a run"),
    "file as folder": (["run", "small.yaml", "--out", "small.yaml"], 2, r".*: cannot be written"),
    "inside a file": (["run", "small.yaml", "--out", "small.yaml/a"], 2, r".*: cannot be written"),
    "fresh in no run": (["run", "small.yaml", "--out", ".", "--fresh"], 2, r"\.: is not empty"),
    "no run": (["export", "absent"], 2, r"absent: there is no run here"),
    "config as run": (["export", "small.yaml"], 2, r"small\.yaml: is a file, not a run's folder"),
    "no point": (["export", "small", "--point", "2"], 2, r"--point 2: small has points 0 to 1"),
    "no folder": (
        ["export", "small", "--out", "small.yaml/events.csv"],
        2,
        r"small\.yaml/events\.csv: cannot be written \(.*\); make room or choose another file",
    ),
    "no folder for figures": (
        ["plot", "small", "energy", "--where", "cor=1.0", "--out", "small.yaml"],
        2,
        r"small\.yaml: cannot be written \(.*\); give --out for another folder",
    ),
    "no repeat": (["export", "small", "--repeat", "3"], 2, r"--repeat 3: .* repeats 0 to 2"),
    "damaged": (["export", "small", "--repeat", "1"], 1, r".*repeat-0001\.h5: not a readable"),
    "events at times": (["export", "small", "--times", "0"], 2, r"--times needs --states"),
    **{
        f"times {times}": (
            ["export", "small", "--states", "--times", times],
            2,
            rf"--times {times}: ",
        )
        for times in ("x", "0,", "1,0", "-1", "0,1e9", "nan", "0,nan", "0:1", "0:1:-2", "0:1:0.5")
    },
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_told_in_a_sentence(name: str, finished: Path, snooker: Snooker) -> None:
    (finished / "point-0000" / "repeat-0001.h5").write_text("not HDF5")
    before = tree(finished.parents[1])
    arguments, code, sentence = MISTAKES[name]
    ended = snooker(*arguments)
    assert ended.code == code
    assert ended.out == ""
    said = ended.err.removesuffix("\n")
    assert said.isprintable(), said
    assert re.match(f"snooker: {sentence}", said), said
    assert tree(finished.parents[1]) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["run"],
        ["run", "small.yaml", "-j", "0"],
        ["run", "small.yaml", "-j", "many"],
        ["run", "small.yaml", "--unknown"],
        ["unknown"],
        ["export", "small", "--point", "-1"],
    ],
)
def test_wrong_usage_has_its_code(arguments: list[str], finished: Path, snooker: Snooker) -> None:
    ended = snooker(*arguments)
    assert (ended.code, ended.out) == (2, "")
    assert "Error" in ended.err
    assert "Traceback" not in ended.err


def test_repeats_of_given_balls_are_refused_at_their_line(here: Path, snooker: Snooker) -> None:
    (here / "list.yaml").write_text(
        "container: {radius: 10.0}\n"
        "balls: {list: [{position: [0, 0], velocity: [1, 0], radius: 1}]}\n"
        "cor: 1\ncollisions: 10\nrepeats: 2\n"
    )
    for command in ("validate", "run"):
        ended = snooker(command, "list.yaml")
        assert (ended.code, ended.out) == (3, "")
        assert ended.err.startswith("snooker: list.yaml:5:10: repeats: 2 repeats of balls.list ")
        overridden = snooker(command, "list.yaml", "-o", "repeats=3")
        assert overridden.err.startswith("snooker: -o repeats=3: repeats: 3 repeats of balls.list ")
    assert not (here / "runs").exists()
    assert snooker("validate", "list.yaml", "-o", "repeats=1").code == 0


@pytest.mark.parametrize("wanted", ["", "0", "1"])
def test_an_unforeseen_error_is_told_with_a_way_to_its_traceback(
    wanted: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(*_arguments: object, **_options: object) -> None:
        raise KeyError("lost")

    monkeypatch.setenv("SNOOKER_TRACEBACK", wanted)
    monkeypatch.setattr("snooker_cli.cli.export_command.open_run", lost)
    ended = snooker("export", "small")
    assert (ended.code, ended.out) == (1, "")
    assert ("Traceback" in ended.err) == ("in lost" in ended.err) == (wanted == "1")
    assert ended.err.splitlines()[-1] == (
        "snooker: unexpected KeyError: 'lost'; this is a bug in snooker, please report it with "
        "the command and the config"
        + ("" if wanted == "1" else "; set SNOOKER_TRACEBACK=1 to see where it happened")
    )


@pytest.mark.parametrize("wanted", ["", "1"])
def test_an_unforeseen_error_in_a_repeat_has_its_traceback_too(
    wanted: str, here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost() -> str:
        raise KeyError("lost")

    monkeypatch.setenv("SNOOKER_TRACEBACK", wanted)
    monkeypatch.setattr("snooker_cli.runs.repeat.versions", lost)
    ended = snooker("run", "small.yaml", "--no-progress", "-o", "repeats=8", "-j", "1")
    assert ended.code == 4
    said = [line for line in ended.err.splitlines() if line.startswith("snooker: point ")]
    assert len(said) == 10
    assert all(" failed: unexpected KeyError: 'lost'; " in line for line in said)
    assert ended.err.count("Traceback") == (10 if wanted else 0)


def test_what_the_system_refuses_is_no_fault_of_snookers(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_arguments: object) -> None:
        raise PermissionError(13, "Permission denied", "somewhere")

    monkeypatch.setattr("snooker_cli.cli.export_command.open_run", refused)
    ended = snooker("export", "small")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        "snooker: somewhere: Permission denied; check the disk and its permissions\n"
    )


def test_a_summary_has_no_events_to_export(here: Path, snooker: Snooker) -> None:
    assert snooker("run", "small.yaml", "-o", "record=summary", "--no-progress").code == 0
    for options in ([], ["--states"]):
        ended = snooker("export", "small", *options)
        assert (ended.code, ended.out) == (2, "")
        assert re.fullmatch(r"snooker: small was run with `record: summary`.*\n", ended.err)


def test_a_damaged_manifest_is_told_in_a_sentence(finished: Path, snooker: Snooker) -> None:
    (finished / "run.json").write_text('{"experiment": {"cor": 2}}')
    ended = snooker("export", "small")
    assert (ended.code, ended.out) == (1, "")
    assert ended.err.removesuffix("\n").isprintable(), ended.err
    assert "run.json: cannot be read" in ended.err


def text_of(case: dict[str, Any]) -> str:
    """The config of a case of the table; see its head."""
    if "text" in case:
        return str(case["text"])
    lines = dict(enumerate(TABLE["base"].splitlines(), start=1)) | case.get("line", {})
    text = "".join(f"{lines[number]}\n" for number in sorted(lines))
    return text.replace("{zeros}", "0" * 300).replace("{nines}", "9" * 5000)


@pytest.mark.parametrize("name", TABLE["cases"])
def test_bad_configs_are_told_with_their_position(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, snooker: Snooker
) -> None:
    case = TABLE["cases"][name]
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_bytes(text_of(case).encode())
    overrides = [f"--override={override}" for override in case.get("overrides", ())]
    ended = snooker("run", "bad.yaml", *overrides)
    assert ended.code == 3
    assert ended.out == ""
    assert "Traceback" not in ended.err
    lines = ended.err.removeprefix("snooker: ").splitlines()
    assert len(lines) == len(case["says"])
    for line, expected in zip(lines, case["says"], strict=True):
        assert re.match(".*".join(map(re.escape, expected.split("..."))), line)
    assert list(tree(tmp_path)) == ["bad.yaml"]
    assert list(tmp_path.iterdir()) == [tmp_path / "bad.yaml"]


# Readers that go away

LOUD = ("export", "show", "verify")


@pytest.mark.parametrize(
    "arguments",
    [
        ["schema"],
        *(pytest.param([name, "small"], marks=pytest.mark.long) for name in LOUD),
    ],
)
def test_a_reader_that_has_gone_ends_a_command_quietly(
    arguments: list[str], finished: Path
) -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "snooker_cli", *arguments],
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


def test_interrupted_commands_have_their_code(here: Path, snooker: Snooker) -> None:
    """While its reader waits, an export hangs in a write until it is interrupted."""
    long = ["-o", "cor=1", "-o", "repeats=1", "-o", "collisions=20000", "--out", "long"]
    assert snooker("run", "small.yaml", "--no-progress", *long).code == 0
    process = subprocess.Popen(
        [sys.executable, "-m", "snooker_cli", "export", "long"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "time,i,j,impulse\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 130
    assert said == "snooker: interrupted\n"
