"""Every command ends with a sentence, soon and in little memory, whatever files it is given."""

from __future__ import annotations

import re
import resource
import subprocess
import sys
import time
from pathlib import Path

import hostile
import pytest
from command_line import Snooker

from snooker_cli.runs import Run

CODES = range(6)
REPEATS = Path("point-0000") / "repeats-0000-0002.h5"
SOUND = ("stop: message", "provenance: command", "provenance: config")
"""Names of what `verify` need not blame: text that is only shown, or that no command reads."""

SHARE = 6
"""Of all files, each command is tried on one in six, and on all in long tests."""
SECONDS, BYTES = 10.0, 10**9

COMMANDS = [
    "ls",
    "show small",
    "verify small",
    "verify small --replay",
    "fit small",
    "compare small",
    "plot small energy --out drawn",
    "export small --out events.csv",
    "export small --states --out states.csv",
    "animate small --out film.html",
    "run small.yaml --no-progress --yes",
]


def check(snooker: Snooker, command: str, name: str) -> int:
    """Run a command on files of that name and check how it ends; its exit code."""
    before, begun = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    ended = snooker(*command.split())
    taken = time.perf_counter() - begun
    more = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    printed = ended.out + ended.err
    assert ended.code in CODES, (command, name, printed)
    assert not re.search("Traceback|a bug in snooker", printed), (
        command,
        name,
        printed,
    )
    assert printed.replace("\n", "").isprintable(), (command, name, printed)
    assert taken < SECONDS, (command, name, taken)
    assert more < BYTES, (command, name, more)
    return ended.code


@pytest.fixture(scope="module")
def repeats(finished_run: Run, tmp_path_factory: pytest.TempPathFactory) -> hostile.Corpus:
    folder = tmp_path_factory.mktemp("repeats")
    return hostile.Corpus(finished_run.directory / REPEATS, folder, hostile.REPEATS)


@pytest.fixture(scope="module")
def manifests(finished_run: Run, tmp_path_factory: pytest.TempPathFactory) -> hostile.Corpus:
    folder = tmp_path_factory.mktemp("manifests")
    return hostile.Corpus(finished_run.directory / "run.json", folder, hostile.MANIFESTS)


SHARES = [pytest.param(SHARE, id="some"), pytest.param(1, id="all", marks=pytest.mark.long)]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("command", COMMANDS)
def test_hostile_repeats(
    command: str, share: int, finished: Path, repeats: hostile.Corpus, snooker: Snooker
) -> None:
    path = finished / REPEATS
    before = {each: each.read_bytes() for each in path.parent.iterdir()}
    for name in repeats.each(path, slice(COMMANDS.index(command) % share, None, share)):
        code = check(snooker, command, name)
        if command.startswith("verify"):
            assert code == 1 or name.startswith(SOUND), (command, name)
        for other in set(path.parent.iterdir()) - before.keys():
            other.unlink()


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("command", [*COMMANDS, "run small.yaml --no-progress --fresh"])
def test_hostile_manifests(
    command: str, share: int, finished: Path, manifests: hostile.Corpus, snooker: Snooker
) -> None:
    for name in manifests.each(finished / "run.json", slice(len(command) % share, None, share)):
        check(snooker, command, name)


@pytest.mark.parametrize(
    "size", [pytest.param(1 << 14), pytest.param(1 << 18, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("command", ["validate any.yaml", "run any.yaml --dry-run --yes"])
def test_hostile_configs(command: str, size: int, here: Path, snooker: Snooker) -> None:
    for name, content in hostile.configs(size).items():
        hostile.text(content)(here / "any.yaml")
        assert check(snooker, command, name) == 3, name


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["storage: 4e8 rows", "storage: 1e15 rows", f"event: i = {2**31 - 1}"]
)
@pytest.mark.parametrize("command", ["ls", "verify", "export", "fit"])
def test_little_memory_is_taken(
    command: str, name: str, finished: Path, repeats: hostile.Corpus
) -> None:
    """In a process that may have 3 GB of addresses, of which the libraries take two."""
    for each in repeats.each(finished / REPEATS, slice(None)):
        if each == name:
            ended = subprocess.run(
                [sys.executable, "-m", "snooker_cli", command, "runs/small"],
                capture_output=True,
                text=True,
                check=False,
                timeout=60,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30)),
            )
            assert ended.returncode == (0 if command == "ls" else 1)
            assert "Traceback" not in ended.stderr


@pytest.mark.parametrize("name", hostile.BESIDE)
def test_hostile_files_beside_the_repeats(name: str, finished: Path, snooker: Snooker) -> None:
    file, damage = hostile.BESIDE[name]
    (finished / "figures").mkdir()
    damage(finished / file)
    for command in ("ls", "show small", "fit small", "run small.yaml --no-progress"):
        assert check(snooker, command, name) == 0
