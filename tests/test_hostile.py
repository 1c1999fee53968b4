"""Every command ends with a sentence, soon and in little memory, whatever files it is given."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import hostile
import pytest
import repeating
from command_line import SMALL, Snooker

from snooker_cli import store
from snooker_cli.config import to_json
from snooker_cli.engine import simulation
from snooker_cli.errors import StoreError
from snooker_cli.files import temporary_path
from snooker_cli.runs import RunFolder

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # NumPy's, which a user would see

REPEATS = Path("point-0000") / "repeats-0000-0002.h5"
SOUND = (
    *("stop: message", "provenance: command", "provenance: config"),
    *("far", "fast", "unread", "file: 200 GB"),
)
"""Names of what `verify` need not blame: what is only shown or never read, and large numbers."""

SHARE = 24
"""Of all files, each command is tried on one in 24, and on all in long tests."""
SECONDS, BYTES = 10.0, 10**9
LIBRARIES = 300_000_000
"""Bytes that Python and the libraries take in a process of its own."""

BOMB = "a chunk has another size than it declares: a bomb"
INNER = r"\u2066\r\n\u200b"
"""The line break in ``hostile.ESCAPES``, as it is printed."""

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


def resident(name: str = "VmHWM") -> int:
    """Bytes of this process in memory; by default the most since ``forget_peak``."""
    status = Path("/proc/self/status").read_text()
    (kilobytes,) = re.findall(rf"{name}:\s*(\d+) kB", status)
    return 1024 * int(kilobytes)


def forget_peak() -> None:
    """https://docs.kernel.org/filesystems/proc.html, clear_refs."""
    Path("/proc/self/clear_refs").write_text("5")


def check(snooker: Snooker, command: str, name: str) -> int:
    """Run a command on files of that name and check how it ends; its exit code."""
    forget_peak()
    before, begun = resident("VmRSS"), time.process_time()
    ended = snooker(*command.split())
    taken = time.process_time() - begun  # other work on the machine does not count
    more = resident() - before
    printed = ended.out + ended.err
    assert ended.code < 6, (command, name, printed)
    assert not re.search("Traceback|a bug in snooker", printed), (command, name, printed)
    assert printed.replace("\n", "").isprintable(), (command, name, printed)
    assert taken < SECONDS, (command, name, taken)
    assert more + LIBRARIES < BYTES, (command, name, more)
    return ended.code


def test_reading_refuses_a_file_for_what_is_wrong(finished: Path) -> None:
    """Not for a hash, which whoever changes a file can make again."""
    refuse(finished / REPEATS, hostile.REFUSED)


def test_reading_refuses_rough_balls_for_what_is_wrong(here: Path) -> None:
    run = repeating.made(here / "turning", SMALL, *KINDS["rough"])
    repeating.done(run)
    refuse(here / "turning" / REPEATS, hostile.ROUGH)


def refuse(path: Path, reasons: dict[str, dict[str, hostile.Damage]]) -> None:
    for reason, damages in reasons.items():
        for name in hostile.damaged(path, damages):
            with pytest.raises(StoreError) as refused:
                store.check(path)
            assert reason in refused.value.reason, name


def test_reading_refuses_a_summary_for_what_is_wrong(warm: RunFolder, tmp_path: Path) -> None:
    """The reason has the name of the wrong column."""
    names = [*hostile.COLUMNS, "speed_histogram"]
    columns = {key: d for key, d in hostile.KINDS["summary"].items() if key.split(": ")[0] in names}
    assert len(columns) == 3 * len(hostile.COLUMNS) + 2
    path = Path(shutil.copy(warm.batches(0)[0], tmp_path))
    for key in hostile.damaged(path, columns):
        column = key.partition(":")[0]
        with pytest.raises(StoreError, match=f"wrong {column} of a summary|wrong end of a summary"):
            store.check(path)


SHARES = [pytest.param(SHARE, id="some"), pytest.param(1, id="all", marks=pytest.mark.long)]


KINDS = {
    "events": [],
    "summary": ["record=summary", "collisions=1000"],
    "rough": ["tangential_cor=0.5", "friction=0.2", "balls.spin=5"],
    "box": [
        "container={shape: box, width: 20, height: 14}",
        "balls={count: 7, radius: 1, speed: 9}",
    ],
}


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("kind", KINDS)
def test_hostile_repeats(kind: str, share: int, here: Path, snooker: Snooker) -> None:
    """Each command on some files, or on all."""
    run = repeating.made(here / "runs" / "small", SMALL, *KINDS[kind])
    (here / "small.yaml").write_text(to_json(run.config))
    repeating.done(run)
    path = here / "runs" / "small" / REPEATS
    for number, command in enumerate([*COMMANDS, "report small"]):
        chosen = slice(number % share, None, share)
        for name in hostile.damaged(path, hostile.KINDS[kind], chosen):
            code = check(snooker, command, name)
            if command.startswith("verify"):
                assert code == 1 or name.startswith(SOUND), (command, name)
            for other in set(path.parent.iterdir()) - {path}:
                other.unlink()


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("command", [*COMMANDS, "run small.yaml --no-progress --fresh"])
def test_hostile_manifests(command: str, share: int, finished: Path, snooker: Snooker) -> None:
    chosen = slice(len(command) % share, None, share)
    for name in hostile.damaged(finished / "run.json", hostile.MANIFESTS, chosen):
        check(snooker, command, name)


def test_settings_of_numba_in_the_folder_are_refused(finished: Path) -> None:
    """They lead Numba to compiled code, which it runs; nothing is deleted before."""
    settings, planted = Path(".numba_config.yaml"), Path("planted")
    settings.write_text(f"cache_dir: {planted}\n")
    before = sorted(finished.rglob("*"))
    command = [sys.executable, "-m", "snooker_cli", "run", "small.yaml", "--fresh"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{finished.parents[1]}: contains {settings}, which" in done.stderr
    assert sorted(finished.rglob("*")) == before
    assert not planted.exists()


@pytest.mark.parametrize(
    "command",
    ["run small.yaml --no-progress --fresh -j 2 -o repeats=20 -o cor=0.5:0.9:40", "report small"],
)
def test_no_module_of_the_current_folder_is_run(command: str, finished: Path) -> None:
    """Not by the process of the command, nor by those that it starts: of runs, or for figures."""
    hostile.plant_modules(Path())
    process = [sys.executable, "-m", "snooker_cli", *command.split()]
    done = subprocess.run(process, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "of the current folder" not in done.stderr
    assert "threads simulate instead" not in done.stderr


def test_settings_of_matplotlib_in_the_folder_are_not_read(finished: Path) -> None:
    """A pipe would block."""
    os.mkfifo("matplotlibrc")
    for first in ("from snooker_cli.figures import drawing", "import snooker_cli.animation.movie"):
        program = f"{first}; import matplotlib; print(matplotlib.rcParams['savefig.dpi'])"
        command = [sys.executable, "-c", program]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
        assert done.stdout == "figure\n"


def test_a_wrong_checkpoint_concerns_only_run(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was simulated before the interrupt is read as if the checkpoint were good."""
    (here / "small.yaml").write_text(SMALL.replace("150", "30000").replace("[0.85, 1.0]", "[1.0]"))
    monkeypatch.setattr(simulation, "CHUNK", 5000)
    run = repeating.made(here / "runs" / "small", (here / "small.yaml").read_text(), "repeats=1")
    repeating.stopped(run, 9000)
    path = repeating.file_of(run, 0, 0)
    assert store.read_checkpoint(path)
    readers = ("verify small --replay", "fit small", "export small")
    expected = {command: snooker(*command.split()) for command in readers}
    for name in hostile.damaged(path, hostile.CHECKPOINTS):
        for command in readers:
            assert snooker(*command.split()) == expected[command], (command, name)
        check(snooker, "run small.yaml --no-progress -o repeats=1", name)
        assert repeating.done(run)[0].cached


@pytest.mark.parametrize("command", ["verify small", "run small.yaml --no-progress", "fit small"])
def test_a_text_of_a_file_has_no_power_over_a_terminal(
    command: str, finished: Path, snooker: Snooker
) -> None:
    """In a result, in a notice, and in the message of an error."""
    hostile.REPEATS["version: text"](finished / REPEATS)
    ended = snooker(*command.split())
    printed = ended.out + ended.err
    assert r"\u202egpj.exe" in printed
    assert printed.replace("\n", "").isprintable()


def test_a_text_of_a_file_stays_in_its_line(here: Path, finished: Path, snooker: Snooker) -> None:
    """After a line break in it, a text could look like a line of snooker."""
    path = finished / REPEATS
    for _ in hostile.damaged(path, {"": hostile.REPEATS["stop: message"]}):
        assert INNER in snooker("run", "small.yaml", "--no-progress").out
    hostile.REPEATS["provenance: command"](path)
    os.utime(path)  # the newest file: its command is shown
    assert INNER in snooker("show", "small").out.splitlines()[-1]
    path.unlink()
    failed = json.dumps({"point": 0, "repeat": 0, "error": hostile.ESCAPES})
    (finished / "failures.jsonl").write_text(failed)
    remark = next(line for line in snooker("show", "small").out.splitlines() if "failed: " in line)
    assert INNER in remark


@pytest.mark.parametrize("name", hostile.BESIDE)
def test_hostile_files_beside_the_repeats(name: str, finished: Path, snooker: Snooker) -> None:
    file, damage = hostile.BESIDE[name]
    (finished / "figures").mkdir()
    (finished / file).touch()
    damage(finished / file)
    for command in ("ls", "show small", "fit small", "run small.yaml --no-progress"):
        assert check(snooker, command, name) == 0
    assert check(snooker, "run small.yaml --no-progress --fresh", name) == 0


OWN_FILES = {
    "plot small energy": ["figures/energy.svg", "figures/energy.png", "figures/energy.json"],
    "animate small --replace": ["film-cor-0.85.html"],
    "run small.yaml --no-progress": ["point-0000/repeats-0000-0002.h5"],
    "run small.yaml --no-progress --fresh": ["run.json"],
}
"""Files by the command that writes them under names of its own, from the run's folder."""


@pytest.mark.parametrize("command", OWN_FILES)
def test_no_link_in_a_run_leads_a_command_to_another_file(
    command: str, finished: Path, snooker: Snooker
) -> None:
    precious, text = Path("precious"), "what the user keeps elsewhere"
    precious.write_text(text)
    for name in OWN_FILES[command]:
        path = finished / name
        path.parent.mkdir(exist_ok=True)
        if name == "run.json":  # or else the folder would be no run
            precious.write_text(text := path.read_text())
        path.unlink(missing_ok=True)
        path.symlink_to(precious.resolve())
    assert snooker(*command.split()).code == 0
    assert precious.read_text() == text
    for name in OWN_FILES[command]:
        assert not (finished / name).is_symlink()


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("run small.yaml --no-progress", "point-0000"),
        ("run small.yaml --no-progress --fresh", "figures"),
        ("run small.yaml --no-progress --part 1/1", "point-0000"),
        ("plot small energy", "figures"),
        ("report small", "report/figures"),
    ],
)
def test_no_command_writes_or_deletes_through_a_linked_folder(
    command: str, name: str, finished: Path, snooker: Snooker
) -> None:
    other = Path("other")
    shutil.copytree(finished, other / "run")
    shutil.rmtree(other / "run" / "point-0001")
    # A run deletes such a file of a run that was killed.
    temporary_path(other / "run" / REPEATS).write_text("another run's")
    snooker("plot", str(other / "run"), "energy", "--out", str(other / "figures"))
    linked = finished / name
    shutil.rmtree(linked, ignore_errors=True)
    linked.parent.mkdir(exist_ok=True)
    target = {"point-0000": other / "run" / "point-0000", "figures": other / "figures"}
    linked.symlink_to(target.get(name, other).resolve())
    before = {path: path.read_bytes() for path in other.rglob("*") if path.is_file()}
    ended = snooker(*command.split())
    assert ended.code == 2
    assert f"there is a link instead of the folder {linked.name}" in ended.err
    assert {path: path.read_bytes() for path in other.rglob("*") if path.is_file()} == before
