"""What every command prints, held in ``golden/cli`` as transcripts of a terminal.

A transcript has commands after ``$ ``, their stdout, their stderr after ``2> ``, their exit code,
and notes after ``#: ``. Commands after ``% `` prepare something: they must succeed, and what they
print is not kept. A transcript starts in a new folder with ``small.yaml`` and its finished run,
which has one file for each repeat; runs that a transcript makes have batches. A refused command
(exit code 2 or 3, no output) must also leave all files as they were.

To add a case, add a line ``$ snooker ...`` and run this file's tests with ``--write-goldens``.
"""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest
from command_line import Ended, Snooker

from snooker_cli.errors import ExitCode

GOLDEN = Path(__file__).parents[1] / "golden" / "cli"

MASKS = (
    # Only the first run of a type of scene compiles.
    (r"(?m)^2> snooker: compiling .*\n", ""),
    (r" after \d+ s of compiling", ""),
    # Speed of the machine.
    (r"[\d.]+ s \([\d,]+ events/s\)", "SECONDS s (RATE events/s)"),
    (r'("(?:compiling_)?seconds"): [\d.]+', r"\1: SECONDS"),
    (r'("events_per_second"): \d+', r"\1: RATE"),
    # Files, the disk they are on, and the library that reads them.
    (r" +size(?=  )", " size"),
    (r" +[\d.,]+ (?:bytes|kB|MB|GB|TB)\b", " SIZE"),
    (r'("(?:free_)?bytes"): \d+', r"\1: BYTES"),
    (r"\d{4}-\d\d-\d\d \d\d:\d\d", "YYYY-MM-DD hh:mm"),
    (r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00", "TIME"),
    (r"Unable to synchronously open", "Unable to open"),
    (r"(?m)^snooker \d+\.\d+\S*$", "snooker VERSION"),
    # Rounding in sums of NumPy.
    (r"\d[\d.]* × 10⁻¹\d", "ROUNDING"),
    # One record a line.
    (r"(?<=\}), (?=\{)", ",\n "),
)
DOUBLE = re.compile(r"-?\d+\.\d{9,}(?:e[-+]\d+)?|-?\d+(?:\.\d+)?e-\d+")


def rounded(found: re.Match[str]) -> str:
    """Six digits, and at most twelve decimals: the last bits depend on the processor."""
    return repr(round(float(f"{float(found[0]):.6g}"), 12))


def masked(text: str, here: Path) -> str:
    """The text without what differs between machines and days."""
    text = text.replace(str(here), "HERE")
    for pattern, mask in MASKS:
        text = re.sub(pattern, mask, text)
    return DOUBLE.sub(rounded, text)


def tree(folder: Path) -> dict[Path, bytes]:
    """The content of every file below a folder."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def executed(command: str, snooker: Snooker, here: Path) -> Ended:
    """How a line of a transcript ends: ``snooker`` in this process, others in a shell."""
    program, *arguments = shlex.split(command)
    if program != "snooker":
        done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
        return Ended(done.returncode, done.stdout, done.stderr)
    before = tree(here)
    ended = snooker(*arguments)
    if ended.code in (ExitCode.USAGE, ExitCode.CONFIG) and not ended.out:
        assert tree(here) == before, command
    assert "Traceback" not in ended.err
    return ended


def printed(command: str, ended: Ended, here: Path) -> str:
    """A command of a transcript and what it prints."""
    end = "" if not ended.out or ended.out.endswith("\n") else "\n"
    errors = "".join(f"2> {line}".rstrip() + "\n" for line in ended.err.splitlines())
    return f"$ {command}\n{masked(ended.out + end + errors, here)}exit {ended.code}\n\n"


def played(transcript: str, snooker: Snooker, here: Path) -> str:
    """The transcript with what its commands print now."""
    now = []
    for line in transcript.splitlines():
        mark, _, command = line.partition(" ")
        if mark in ("$", "%"):
            ended = executed(command, snooker, here)
        if mark == "$":
            now.append(printed(command, ended, here))
        elif mark == "%":
            assert ended.code == 0, (command, ended.err)
            now.append(f"{line}\n\n")
        elif mark == "#:":
            now.append(f"{line}\n")
    return "".join(now)


@pytest.mark.parametrize("path", sorted(GOLDEN.glob("*.txt")), ids=lambda path: path.stem)
def test_commands_print_what_the_transcripts_say(
    path: Path,
    separate: Path,
    snooker: Snooker,
    monkeypatch: pytest.MonkeyPatch,
    pytestconfig: pytest.Config,
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    for name in ("FORCE_COLOR", "SNOOKER_TRACEBACK", "TERMINAL_WIDTH"):
        monkeypatch.delenv(name, raising=False)
    transcript = path.read_text(encoding="utf-8")
    now = played(transcript, snooker, separate.parents[1])
    if pytestconfig.getoption("--write-goldens"):
        path.write_text(now, encoding="utf-8")
    else:
        assert now == transcript
