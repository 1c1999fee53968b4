"""A full disk, a read-only folder, and files of other runs: no command uses or destroys results."""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import Snooker
from repeating import contents, done, made

from snooker_cli import runs, store
from snooker_cli.runs.status import run_status

# -B, because many versions of Python leave cut files of compiled modules on a full disk.
SNOOKER = [sys.executable, "-B", "-m", "snooker_cli"]

TWO_LENGTHS = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 1
collisions: 100
repeats: 3
sweep: {collisions: [100, 400000]}
"""

REPEAT = Path("runs/small/point-0000/repeats-0000-0000.h5")


@pytest.mark.long
def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    """Files may not grow beyond a size; short repeats fit, and long ones, written as they come,
    do not."""
    config, directory = tmp_path / "two.yaml", tmp_path / "run"
    config.write_text(TWO_LENGTHS)

    def executed(*arguments: str, room: int | None = None) -> tuple[int, str, str]:
        size = (resource.RLIM_INFINITY if room is None else room, resource.RLIM_INFINITY)
        ended = subprocess.run(
            [*SNOOKER, *arguments],
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, size),
        )
        assert "Traceback" not in ended.stderr
        return ended.returncode, ended.stdout, ended.stderr

    def simulated(room: int | None = None) -> tuple[int, str, str]:
        options = ["--yes", "-j", "2", "--no-progress", "--json"]
        return executed("run", str(config), "--out", str(directory), *options, room=room)

    code, _, talk = simulated(room=0)
    assert code == 2
    assert talk.startswith(f"snooker: {directory}: cannot be written (File too large); ")
    code, _, talk = simulated(room=60_000)
    assert code == 4
    failed = [line for line in talk.splitlines() if " failed: " in line]
    assert len(failed) == 3
    assert all("cannot write the result (File too large); make room or" in line for line in failed)
    points = run_status(runs.open_run(directory))["ledger"]
    assert [(point["done"], point["failed"]) for point in points] == [(3, 0), (0, 3)]
    code, printed, _ = executed("verify", str(directory), "--json")
    checked = json.loads(printed)
    assert (code, checked["done"], checked["missing"], checked["bad"]) == (0, 3, 3, [])
    assert not list(directory.rglob("*.part"))
    code, printed, _ = simulated()
    assert code == 0
    assert [point["cached"] for point in json.loads(printed)["points"]] == [3, 0]
    at_once = made(tmp_path / "at once", TWO_LENGTHS)
    done(at_once)
    assert contents(runs.open_run(directory)) == contents(at_once)


@pytest.mark.parametrize(
    "command",
    [
        "animate small --replace --out film.html",
        "animate small --replace --out film.gif --seconds 0.1",
        "animate small --replace --out film.mp4 --seconds 0.1",
        "plot small energy",
        "fit small",
        "compare small",
        "report small --out written",
        "bench hard touching --out measured",
        "export small --replace --out events.csv",
        "init haff --out new/haff.yaml",
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
    if command.startswith("init"):
        Path("new/haff.yaml").unlink()
    left = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, unlimited[1]))
    try:
        ended = snooker(*command.split())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
    # These two print their result, too.
    assert ended.code == (0 if command in ("fit small", "compare small") else 2)
    reason = "ffmpeg could not write it" if "mp4" in command else "File too large"
    assert reason in ended.err
    assert written[0].name in ended.err or len(written) > 1
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == left


@pytest.mark.parametrize("room", [100, 3000, 40_000])
def test_an_export_of_states_on_a_full_disk_ends_with_a_sentence(room: int, finished: Path) -> None:
    """In a process of its own, because HDF5 crashed when that ended."""
    command = "export small --states --frames 999 --out states.h5"
    ended = subprocess.run(
        [*SNOOKER, *command.split()],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
    )
    assert ended.returncode == 2
    sentence = "snooker: states.h5: cannot be written (File too large); make room or choose"
    assert ended.stderr.startswith(sentence)
    assert not [*Path().glob("states*")]


@pytest.mark.parametrize(
    "command",
    [
        "fit small",
        "compare small",
        "plot small energy",
        "animate small --out film.html",
        "export small",
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
    assert not [*Path().glob("film*"), *Path().glob("states*")]


@pytest.mark.parametrize("command", ["fit small", "export small", "verify small"])
def test_a_repeat_has_no_more_collisions_than_its_config_allows(
    command: str, finished: Path, snooker: Snooker
) -> None:
    """Although its provenance is that of another config, with the digest of this one."""
    assert snooker("run", "small.yaml", "-o", "collisions=200", "--out", "long").code == 0
    path = finished / "point-0001" / "repeats-0000-0002.h5"
    forged, own = Path("long/point-0001") / path.name, store.check(path)[0].provenance
    found = [(header.repeat, trace) for trace, header in store.read(forged)]
    other = store.check(forged)[0].provenance
    store.write(path, found, replace(other, digest=own.digest))
    ended = snooker(*command.split(), *(["--point", "1"] if "export" in command else []))
    assert ended.code == 1
    output = ended.out if command.startswith("verify") else ended.err
    assert "has 200 collisions, where its config allows 150; run the config" in output


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
    snooker("fit", "small")
    shutil.copy(REPEAT, "copy.h5")
    states, events = ("export", "small", "--states"), ("export", "small")
    for out in (str(REPEAT), "copy.h5", "runs/small/run.json", "runs/small/analysis.json"):
        before = Path(out).read_bytes()
        ended = snooker(*(states if out.endswith("h5") else events), "--out", out)
        assert (ended.code, ended.out) == (2, "")
        assert f"--out {out}: this file holds results of a run; give another name" in ended.err
        assert Path(out).read_bytes() == before
    assert snooker(*states, "--out", "states.h5").code == 0
    assert snooker(*states, "--out", "states.h5", "--replace").code == 0
