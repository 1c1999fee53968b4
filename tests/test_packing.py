"""A packed run: read like the folder, never changed, and the folder again when unpacked."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import h5py
import pytest
from repeating import contents, made

from snooker_cli import results, store
from snooker_cli.gallery import Selection, selected
from snooker_cli.gallery.repeats import facts, repeats
from snooker_cli.results import Run, RunError
from snooker_cli.runner import ledger, verify
from snooker_cli.store import StoreError

Snooker = Callable[..., Any]


@pytest.fixture
def packed(finished: Path, snooker: Snooker) -> Path:
    """The finished run as a packed file, ``runs/small.h5``, and no folder."""
    results.note_failure(results.open_run(finished), 1, 1, "a Fehler, µ")
    assert snooker("pack", "small").code == 0
    shutil.move(finished, finished.parents[1] / "folder")
    return finished.with_name("small.h5")


@pytest.fixture
def folder(packed: Path) -> Path:
    """The folder that was packed."""
    return packed.parents[1] / "folder"


def told(text: str) -> Any:
    """JSON of a command, without the run's name."""
    content = json.loads(text)
    (content[0] if isinstance(content, list) else content).pop("run", None)
    return content


def test_packing_prints_the_file_and_leaves_nothing_else(finished: Path, snooker: Snooker) -> None:
    before = {path: path.read_bytes() for path in finished.rglob("*") if path.is_file()}
    ended = snooker("pack", "small")
    assert (ended.code, ended.out) == (0, "runs/small.h5\n")
    assert ended.err.startswith("snooker: 6 repeats, ")
    assert sorted(path.name for path in finished.parent.iterdir()) == ["small", "small.h5"]
    assert {path: path.read_bytes() for path in finished.rglob("*") if path.is_file()} == before


def test_a_packed_run_is_found_by_every_name(packed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("small", "small.h5", "runs/small", "runs/small.h5", str(packed)):
        run = results.open_run(name)
        assert (run.directory.name, run.name, run.packed) == ("small.h5", "small", True)
    assert results.runs_in(Path("runs")) == results.runs_in(Path("runs/small.h5"))
    assert results.runs_in(Path("runs")) == [Path("runs/small.h5")]


@pytest.mark.parametrize(
    "command",
    [
        ["show", "--json"],
        ["ls", "--json"],
        ["fit", "--json"],
        ["compare", "--json"],
        ["export", "--point", "1", "--repeat", "2"],
        ["export", "--states", "--times", "0,1"],
        ["verify", "--replay", "--json"],
    ],
    ids=lambda command: command[0],
)
def test_commands_read_it_like_the_folder(
    command: list[str], packed: Path, folder: Path, snooker: Snooker
) -> None:
    before = packed.read_bytes()
    of_file, of_folder = (snooker(command[0], path, *command[1:]) for path in (packed, folder))
    assert (of_file.code, of_file.err) == (of_folder.code, of_folder.err) == (0, "")
    if "--json" in command:
        assert told(of_file.out) == told(of_folder.out)
    else:
        assert of_file.out == of_folder.out
    assert packed.read_bytes() == before
    assert list(packed.parent.iterdir()) == [packed]


def test_what_was_fitted_and_drawn_is_in_it(finished: Path, snooker: Snooker) -> None:
    run = results.open_run(finished)
    results.write_json(finished / "fit.json", {"rows": []})
    run.figures_folder.mkdir()
    figure = dict.fromkeys(results.FIGURE_KEYS, "")
    results.write_json(run.figures_folder / "energy.json", figure)
    (run.figures_folder / "energy.svg").write_text("<svg/>")
    (finished / "left.123.part").write_text("of a kill")
    (finished / "empty").touch()
    results.pack(run, Path("packed.h5"))
    packed = results.open_run("packed.h5")
    for found, expected in ((packed.analyses(), run.analyses()), (packed.figures(), run.figures())):
        assert [path.name for path in found] == [path.name for path in expected] != []
    assert packed.figures_folder == Path("packed-figures")
    results.unpack(packed, Path("again"))
    assert files(Path("again")) == files(finished) - {"left.123.part"}
    assert (Path("again") / "figures" / "energy.svg").read_text() == "<svg/>"


def files(directory: Path) -> set[str]:
    return {str(path.relative_to(directory)) for path in directory.rglob("*") if path.is_file()}


def test_figures_read_it_like_the_folder(packed: Path, folder: Path) -> None:
    one, other = results.open_run(packed), results.open_run(folder)
    points = list(zip(selected(one, Selection()), selected(other, Selection()), strict=True))
    assert len(points) == 2
    for point, same in points:
        found = facts(one, point, Selection(), single=False)
        assert found == facts(other, same, Selection(), single=False)
        hashes = [
            [store.content_hash(trace) for trace in repeats(run, point, Selection())]
            for run in (one, other)
        ]
        assert hashes[0] == hashes[1]
        assert len(set(hashes[0])) == 3


def test_unpacking_gives_the_folder_again(packed: Path, folder: Path, snooker: Snooker) -> None:
    ended = snooker("unpack", "small")
    assert (ended.code, ended.out, ended.err) == (0, "runs/small\n", "")
    again = packed.with_suffix("")
    assert files(again) == files(folder)
    assert contents(results.open_run(again)) == contents(results.open_run(folder))
    for path in folder.rglob("*.json*"):
        assert (again / path.relative_to(folder)).read_bytes() == path.read_bytes()
    for path in folder.rglob("*.h5"):
        assert (again / path.relative_to(folder)).stat().st_mtime_ns == path.stat().st_mtime_ns
        with h5py.File(again / path.relative_to(folder)) as file:
            collisions = file["connectivity/collisions"]
            assert file[collisions.attrs["particles_group"]] == file["particles/balls"]
            assert file["observables/impulse/step"] == collisions["step"]
    assert sorted(path.name for path in packed.parent.iterdir()) == ["small", "small.h5"]
    # It goes on like any run.
    assert "6 repeats were there already" in snooker("run", "small.yaml", "--no-progress").out


def test_a_flipped_bit_in_it_is_found(packed: Path, snooker: Snooker) -> None:
    run = results.open_run(packed)
    image = bytearray(packed.read_bytes())
    image[image.index(store.read(run.path(1, 0)).trace.finish.velocities.tobytes()) + 2] ^= 16
    packed.write_bytes(image)
    states = {(one.point, one.repeat): one for one in verify(run, replay=False, workers=4)}
    bad = states.pop((1, 0))
    assert {one.state for one in states.values()} == {"done"}
    assert bad.sentence == (
        f"{packed}/point-0001/repeat-0000.h5: its content has changed since it was written; take "
        "another copy of the packed run"
    )
    ended = snooker("unpack", packed, "--out", "again")
    assert ended.code == 1
    assert ended.err == f"snooker: {bad.sentence}\n"
    assert not list(Path().glob("again*"))


@pytest.mark.parametrize("part", [0.2, 0.9])
def test_a_truncated_one_is_refused(part: float, packed: Path, snooker: Snooker) -> None:
    packed.write_bytes(packed.read_bytes()[: int(part * packed.stat().st_size)])
    ended = snooker("show", packed)
    assert (ended.code, ended.out) == (1, "")
    assert "no packed run of snooker, or damaged or cut off" in ended.err


def test_threads_read_it_at_once(packed: Path) -> None:
    run = results.open_run(packed)
    jobs = [(point, repeat) for point in range(2) for repeat in range(3)] * 8
    with ThreadPoolExecutor(8) as threads:
        there = threads.map(lambda job: run.holds(run.points[job[0]], job[1]), jobs)
        checked = threads.map(lambda job: store.check(run.path(*job)).collisions, jobs)
        named = threads.map(lambda _: len(run.repeats_there()), jobs)
        assert set(there) == {True}
        assert len(list(checked)) == len(jobs)
        assert set(named) == {6}


def test_missing_repeats_stay_missing(finished: Path) -> None:
    run = results.open_run(finished)
    run.path(0, 1).unlink()
    assert results.pack(run, Path("packed.h5")) == 5
    packed = results.open_run("packed.h5")
    assert [len(packed.present(point)) for point in packed.points] == [2, 3]
    assert ledger(packed).total("to_do") == 1
    with pytest.raises(StoreError, match=r"packed\.h5/point-0000/repeat-0001\.h5: there is no"):
        store.read(packed.path(0, 1))


# Kills

SIGNALLED = """
import os, signal, sys
from snooker_cli.cli import main

number, *sys.argv = sys.argv[1:]
os.fsync = lambda _: os.kill(os.getpid(), int(number))
main()
"""


def signalled(number: signal.Signals, *command: str) -> subprocess.Popen[bytes]:
    """A command that gets a signal when its first file is written, before that has its name."""
    script = [sys.executable, "-c", SIGNALLED, str(int(number)), "snooker", *command]
    return subprocess.Popen(script, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def names(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.iterdir())


@pytest.mark.long
def test_what_a_kill_leaves_is_cleared_away_by_the_next(finished: Path, snooker: Snooker) -> None:
    runs, others = finished.parent, ["small.h5.host-00.part", "small.h5.packing.host-00.part"]
    for name in others:  # what another command, or another machine, may be writing
        (runs / name).touch()
    assert signalled(signal.SIGKILL, "pack", "small").wait() == -signal.SIGKILL
    assert len(names(runs)) == 4
    assert snooker("pack", "small").code == 0
    assert names(runs) == ["small", "small.h5", *others]
    shutil.rmtree(finished)
    assert signalled(signal.SIGKILL, "unpack", "small").wait() == -signal.SIGKILL
    assert len(names(runs)) == 4
    assert snooker("unpack", "small").code == 0
    assert names(runs) == ["small", "small.h5", *others]


@pytest.mark.long
def test_what_a_living_process_writes_is_left(finished: Path, snooker: Snooker) -> None:
    process = signalled(signal.SIGSTOP, "pack", "small")
    _, status = os.waitpid(process.pid, os.WUNTRACED)
    assert os.WIFSTOPPED(status)
    (part,) = finished.parent.glob("*.part")
    assert snooker("pack", "small").code == 0
    assert part.exists()
    process.send_signal(signal.SIGCONT)
    assert process.wait() == 0
    assert names(finished.parent) == ["small", "small.h5"]


def test_nothing_is_packed_into_a_run_under_way(finished: Path) -> None:
    run = results.open_run(finished)
    other = Path(shutil.copytree(finished, finished.with_name("other")))
    with results.held(other), pytest.raises(RunError, match="other: a `snooker run` is writing"):
        results.pack(run, other / "small.h5")


# What is refused


def test_nothing_is_run_into_it(packed: Path, snooker: Snooker) -> None:
    before = packed.read_bytes()
    for options in ([], ["--dry-run"], ["--fresh"]):
        ended = snooker("run", "small.yaml", "--out", packed, "--no-progress", *options)
        assert (ended.code, ended.out) == (2, "")
        assert ended.err.startswith(f"snooker: {packed}: is a packed run, which is never changed; ")
    assert packed.read_bytes() == before


def test_bad_repeats_are_not_packed(finished: Path, small_config: str) -> None:
    run = results.open_run(finished)
    path = run.path(1, 1)
    whole = path.read_bytes()
    another = made(finished.parent / "another", small_config, "seed=2")
    assert another.points != run.points
    cases = {
        "its content has changed": flipped(whole, store.read(path).trace.start.positions.tobytes()),
        "not a readable result": whole[:5000],
        "is not where it belongs": run.path(0, 0).read_bytes(),
    }
    for said, image in cases.items():
        path.write_bytes(image)
        with pytest.raises(StoreError, match=f"repeat-0001.h5: {said}"):
            results.pack(run, Path("packed.h5"))
        assert not list(Path().glob("packed*"))


def flipped(image: bytes, values: bytes) -> bytes:
    damaged = bytearray(image)
    damaged[image.index(values) + 3] ^= 1
    return bytes(damaged)


def test_a_run_under_way_is_not_packed(finished: Path) -> None:
    with results.held(finished), pytest.raises(RunError, match="is writing here"):
        results.pack(results.open_run(finished), Path("packed.h5"))


def test_nothing_is_replaced(packed: Path, folder: Path, snooker: Snooker) -> None:
    before = packed.read_bytes()
    for command, said in (
        (["pack", folder, "--out", packed], f"{packed}: is there already; "),
        (["pack", packed], f"{packed}: is packed already"),
        (["unpack", packed, "--out", folder], f"{folder}: is there already; "),
        (["unpack", folder], f"{folder}: is a folder, not a packed run"),
    ):
        ended = snooker(*command)
        assert (ended.code, ended.out) == (2, "")
        assert ended.err.startswith(f"snooker: {said}"), ended.err
    assert packed.read_bytes() == before


def test_a_packed_run_is_not_taken_for_its_folder(packed: Path, snooker: Snooker) -> None:
    """For the advice would be to remove it."""
    named = packed.rename(packed.with_suffix(""))
    ended = snooker("unpack", named)
    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        f"snooker: {named}: its name has no ending to leave out; give --out for a folder\n"
    )


def test_one_of_another_version_is_refused(packed: Path, snooker: Snooker) -> None:
    with h5py.File(packed, "r+") as file:
        file.attrs["packed_version"] = 2
    ended = snooker("verify", packed)
    assert (ended.code, ended.out) == (1, "")
    assert ended.err.startswith(f"snooker: {packed}: is packed in version 2, where this snooker ")


def test_a_disk_that_is_full_is_said(finished_run: Run, tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("x")
    out = tmp_path / "plain" / "packed.h5"
    with pytest.raises(StoreError, match=r"packed\.h5: cannot be written \("):
        results.pack(finished_run, out)
