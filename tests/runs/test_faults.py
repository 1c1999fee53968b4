"""A full disk, a read-only folder and bad files, met by real processes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import pytest
from repeating import contents, done, made

from snooker_cli import runs, store
from snooker_cli.runs import Run
from snooker_cli.runs.verification import verify

pytestmark = pytest.mark.long

SNOOKER = [sys.executable, "-m", "snooker_cli"]


def executed(folder: Path, *arguments: str) -> tuple[int, str, str]:
    """A command's code, output and talk."""
    ended = subprocess.run(
        [*SNOOKER, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert "Traceback" not in ended.stderr
    return ended.returncode, ended.stdout, ended.stderr


@cache
def mounts() -> bool:
    """Whether a process of ours may mount file systems that it alone sees, as on most Linux."""
    if shutil.which("unshare") is None:
        return False
    trial = ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", "/tmp"]
    return subprocess.run(trial, capture_output=True, check=False).returncode == 0


FULL = """
import json, resource, subprocess, sys
from pathlib import Path

snooker, disk, config, kind = json.loads(sys.argv[1])
run = str(Path(disk) / "run")

def executed(*arguments, room=None):
    limits = {}
    if room is not None:
        size = (room, resource.RLIM_INFINITY)
        limits["preexec_fn"] = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, size)
    ended = subprocess.run([*snooker, *arguments], capture_output=True, text=True, **limits)
    return ended.returncode, ended.stdout, ended.stderr

def simulated(room=None):
    options = ["--yes", "-j", "2", "--no-progress", "--json"]
    return executed("run", config, "--out", run, *options, room=room)

if kind == "tmpfs":
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", disk], check=True)
    ballast = Path(disk) / "ballast"
    try:
        with ballast.open("wb", buffering=0) as file:
            while file.write(bytes(4096)):
                pass
    except OSError:
        pass
    nothing = simulated()
    ballast.unlink()
    little = simulated()
else:
    nothing, little = simulated(0), simulated(60_000)
verify = executed("verify", run, "--json")
from snooker_cli import runs
from snooker_cli.runs.status import run_status
from snooker_cli import store
book = [(point.done, point.failed) for point in run_status(runs.open_run(run)).points]
parts = len(list(Path(run).rglob("*.part")))
if kind == "tmpfs":
    subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
again = simulated()
opened = runs.open_run(run)
hashes = [
    store.check(opened.path(point.index, repeat)).fingerprint for point in opened.points
    for repeat in range(3)
]
print(json.dumps([nothing, little, book, verify, parts, again, hashes]))
"""

TWO_LENGTHS = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 1
collisions: 100
repeats: 3
sweep: {collisions: [100, 70000]}
"""


def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    """A small disk of its own or, where none can be had, files that may not grow beyond a size.

    Nothing can be written at first; then short repeats fit, and long ones do not, which are
    written as they come; then all do.
    """
    kind = "tmpfs" if mounts() else "limit"
    config, disk = tmp_path / "two.yaml", tmp_path / "disk"
    config.write_text(TWO_LENGTHS)
    disk.mkdir()
    about = json.dumps([SNOOKER, str(disk), str(config), kind])
    namespace = ["unshare", "-rm"] if kind == "tmpfs" else []
    ended = subprocess.run(
        [*namespace, sys.executable, "-c", FULL, about], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    nothing, little, book, verify, parts, again, hashes = json.loads(ended.stdout)
    assert "Traceback" not in "".join(one[2] for one in (nothing, little, verify, again))
    full = "No space left on device" if kind == "tmpfs" else "File too large"
    assert nothing[0] == 2
    assert nothing[2] == (
        f"snooker: {disk}/run: cannot be written ({full}); give --out for another folder\n"
    )
    assert little[0] == 4
    failed = [line for line in little[2].splitlines() if " failed: " in line]
    assert len(failed) == 3
    assert all(f"cannot write the result ({full}); make room or choose" in line for line in failed)
    assert book == [[3, 0], [0, 3]]
    assert verify[0] == 0
    checked = json.loads(verify[1])
    assert (checked["done"], checked["missing"], checked["bad"]) == (3, 3, [])
    assert parts == 0
    assert again[0] == 0
    assert [point["cached"] for point in json.loads(again[1])["points"]] == [3, 0]
    at_once = made(tmp_path / "at once", TWO_LENGTHS)
    done(at_once)
    assert hashes == list(contents(at_once).values())


READ_ONLY = """
import json, subprocess, sys

snooker, folder, mounted, commands = json.loads(sys.argv[1])
if mounted:
    subprocess.run(["mount", "--bind", folder, folder], check=True)
    subprocess.run(["mount", "-o", "remount,ro,bind", folder], check=True)
ended = [subprocess.run([*snooker, *each], capture_output=True, text=True) for each in commands]
print(json.dumps([(one.returncode, one.stdout, one.stderr) for one in ended]))
"""


def test_a_read_only_folder_is_read_and_nothing_else(
    finished_run: Run, small_config: str, tmp_path: Path
) -> None:
    if not mounts() and os.geteuid() == 0:
        pytest.skip("nothing can be mounted here, and no folder is read-only for root")
    config, folder = tmp_path / "small.yaml", tmp_path / "run"
    config.write_text(small_config)
    shutil.copytree(finished_run.directory, folder)
    half = folder / "half"  # another run, in the same read-only place, with a repeat to do
    shutil.copytree(finished_run.directory, half)
    (half / "point-0001" / "repeat-0002.h5").unlink()
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    run = ["run", str(config), "--no-progress"]
    commands = [
        [*run, "--out", str(folder)],
        [*run, "--out", str(folder), "-o", "repeats=4"],
        [*run, "--out", str(half)],
        ["ls", str(folder)],
        ["verify", str(folder)],
    ]
    if not mounts():
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o555 if path.is_dir() else 0o444)
    about = json.dumps([SNOOKER, str(folder), mounts(), commands])
    namespace = ["unshare", "-rm"] if mounts() else []
    script = [*namespace, sys.executable, "-c", READ_ONLY, about]
    ended: Any = subprocess.run(script, capture_output=True, text=True, check=True)
    same, more, rest, *looks = json.loads(ended.stdout)
    refused = "Read-only file system" if mounts() else "Permission denied"
    assert (same[0], same[2]) == (0, "")
    assert "6 repeats were already stored" in same[1]
    assert more[0] == 2
    assert f"{folder}: cannot be written ({refused}); give --out for another folder" in more[2]
    assert rest[0] == 4
    assert f"cannot write the result ({refused}); make room or choose" in rest[2]
    assert [(code, err) for code, _, err in looks] == [(0, "")] * 2
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_bad_files_are_told_and_made_anew(finished: Path, here: Path, finished_run: Run) -> None:
    """Truncated, with a flipped bit, of another program, and of another run."""
    run = runs.open_run(finished)
    truncated, flipped, foreign, other = (
        run.path(1, 0),
        run.path(0, 0),
        run.path(0, 1),
        run.path(0, 2),
    )
    truncated.write_bytes(truncated.read_bytes()[:10_000])
    image = bytearray(flipped.read_bytes())
    image[image.index(store.read(flipped)[0].finish.velocities.tobytes()) + 2] ^= 16
    flipped.write_bytes(image)
    with h5py.File(foreign, "w") as file:
        file["temperature"] = [1.0, 2.0]
    another = made(here / "another", (here / "small.yaml").read_text(), "seed=2")
    done(another)
    shutil.copy(another.path(0, 2), other)
    sentences = {
        flipped: "its content has changed since it was written",
        foreign: "not a readable result of snooker",
        other: "is of another config",
        truncated: "not a readable result of snooker",
    }
    names = {path: str(path.relative_to(here)) for path in sentences}

    code, out, err = executed(here, "export", "small")
    assert (code, out) == (1, "")
    assert err.startswith(f"snooker: {names[flipped]}: {sentences[flipped]}; run")
    code, out, err = executed(here, "verify", "small")
    assert (code, err) == (1, "")
    for line, path in zip(out.splitlines(), sentences, strict=False):
        assert line.startswith(f"{names[path]}: {sentences[path]}")
    assert out.splitlines()[4:] == ["runs/small: 2 complete repeats, 4 bad files, read again"]

    code, out, err = executed(here, "run", "small.yaml", "--no-progress", "-j", "1")
    assert code == 0
    assert "2 repeats were already stored" in out
    lines = [line for line in err.splitlines() if "compiling" not in line]
    assert len(lines) == 4
    for line, path in zip(lines, sentences, strict=True):
        assert line.startswith(f"snooker: {names[path]}: {sentences[path]}")
        assert line.endswith("; simulating it again")
    assert contents(run) == contents(finished_run)
    assert {each.state for each in verify(run, replay=False, workers=1)} == {"done"}
