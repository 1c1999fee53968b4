"""A full disk, a read-only folder, and files of other runs: no command uses or destroys results."""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import Snooker

# -B, because many versions of Python leave cut files of compiled modules on a full disk.
SNOOKER = [sys.executable, "-B", "-m", "snooker_cli"]


REPEAT = Path("runs/small/point-0000/repeats-0000-0000.h5")


@pytest.mark.parametrize(
    "command",
    [
        "animate small --replace --out film.html",
        "animate small --replace --out film.gif --seconds 0.1",
        "animate small --replace --out film.mp4 --seconds 0.1",
        "plot small energy",
        "export small --replace --out events.csv",
    ],
)
def test_a_full_disk_keeps_what_was_written_before(
    command: str, finished: Path, snooker: Snooker
) -> None:
    """Neither a damaged file nor a temporary one is left."""
    if "mp4" in command and shutil.which("ffmpeg") is None:
        pytest.skip("there is no ffmpeg here")
    before = set(Path().rglob("*"))
    assert snooker(*command.split()).code == 0
    written = [path for path in set(Path().rglob("*")) - before if path.is_file()]
    assert written
    for path in written:
        path.write_bytes(b"the older file")

    left = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, unlimited[1]))
    try:
        ended = snooker(*command.split())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    assert ended.code == (0 if command == "fit small" else 2)  # `fit` prints its result, too
    reason = "ffmpeg could not write it" if "mp4" in command else "File too large"
    assert reason in ended.err
    assert written[0].name in ended.err or len(written) > 1
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == left


def test_an_export_of_states_on_a_full_disk_ends_with_a_sentence(finished: Path) -> None:
    """In a process of its own, because HDF5 crashed when that ended."""
    command = "export small --states --frames 999 --out states.h5"
    ended = subprocess.run(
        [*SNOOKER, *command.split()],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000)),
    )
    assert ended.returncode == 2
    sentence = "snooker: states.h5: cannot be written (File too large); make room or choose"
    assert ended.stderr.startswith(sentence)
    assert not [*Path().glob("states*")]


@pytest.mark.parametrize(
    "command",
    [
        "plot small energy",
        "export small --states --out states.h5",
        "verify small",
    ],
)
def test_a_repeat_of_another_run_is_used_by_no_command(
    command: str, separate: Path, snooker: Snooker
) -> None:
    shutil.copy(REPEAT.with_name("repeats-0001-0001.h5"), REPEAT)
    ended = snooker(*command.split())
    assert ended.code == 1
    output = ended.out if command.startswith("verify") else ended.err
    assert str(REPEAT) in output
    assert "run the config again, which replaces it" in output
    assert not [*Path().glob("states*")]


@pytest.mark.parametrize("collisions", [150, 200])
def test_a_locked_result_is_replaced_by_no_run(
    collisions: int, finished: Path, snooker: Snooker
) -> None:
    """Also if it would be longer then: another program may be changing it."""
    path = finished / "point-0001" / "repeats-0000-0002.h5"
    holding = "import h5py, os, sys; held = h5py.File(sys.argv[1], 'r+'); os._exit(0)"
    subprocess.run([sys.executable, "-c", holding, path], check=True)
    before = path.read_bytes()
    for command in ("fit small", f"run small.yaml -o collisions={collisions}"):
        ended = snooker(*command.split())
        assert ended.code == 2
        assert f"{path.name}: is locked: a program such as HDFView" in ended.err
    assert path.read_bytes() == before


def test_an_export_replaces_exports_but_no_results(separate: Path, snooker: Snooker) -> None:
    shutil.copy(REPEAT, "copy.h5")
    states, events = ("export", "small", "--states"), ("export", "small")
    for out in (str(REPEAT), "copy.h5", "runs/small/run.json"):
        before = Path(out).read_bytes()
        ended = snooker(*(states if out.endswith("h5") else events), "--out", out)
        assert (ended.code, ended.out) == (2, "")
        assert f"--out {out}: this file holds results of a run; give another name" in ended.err
        assert Path(out).read_bytes() == before
    assert snooker(*states, "--out", "states.h5").code == 0
    assert snooker(*states, "--out", "states.h5", "--replace").code == 0
