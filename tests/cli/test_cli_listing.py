"""``snooker ls`` and ``show``: the ledger of runs, told by their files."""

from __future__ import annotations

import fcntl
import json
import os
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from repeating import made

from snooker_cli import runs, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.files import temporary_path, write_json
from snooker_cli.runs.folder import note_failure
from snooker_cli.runs.status import run_status
from snooker_cli.trace import StopReason

Snooker = Callable[..., Any]

COUNTS = ("done", "running", "failed", "to_do")


def listed(snooker: Snooker, *arguments: str) -> list[dict[str, Any]]:
    ended = snooker("ls", *arguments, "--json")
    assert (ended.code, ended.err) == (0, "")
    return list(json.loads(ended.out))


def shown(snooker: Snooker) -> dict[str, Any]:
    ended = snooker("show", "small", "--json")
    assert (ended.code, ended.err) == (0, "")
    return dict(json.loads(ended.out))


def interrupt(path: Path) -> None:
    """Make a file one that an interrupt has saved."""
    trace, header = store.read(path)
    stop = replace(trace.stop, reason=StopReason.INTERRUPTED, message="cut")
    store.write(path, replace(trace, stop=stop), header.provenance)


def test_a_finished_run_is_done(finished: Path, snooker: Snooker) -> None:
    (one,) = listed(snooker)
    run = runs.open_run("small")
    collisions = sum(trace.collisions for point in run.points for trace in run.traces(point))
    files = list(finished.glob("point-*/*.h5"))
    assert [one[name] for name in COUNTS] == [6, 0, 0, 0]
    assert (one["run"], one["state"]) == ("runs/small", "done")
    assert (one["points"], one["repeats"], one["collisions"]) == (2, 3, collisions)
    assert (one["files"], one["bytes"]) == (6, sum(path.stat().st_size for path in files))
    assert one["engine_version"] == ENGINE_VERSION
    last = datetime.fromisoformat(one["last_file"]).timestamp()
    assert 0 <= max(path.stat().st_mtime for path in files) - last < 1


def test_the_list_is_a_table(finished: Path, snooker: Snooker) -> None:
    ended = snooker("ls")
    assert (ended.code, ended.err) == (0, "")
    head, row = ended.out.splitlines()
    assert re.split(r"\s{2,}", head) == [
        *("run", "points", "repeats", "done", "running", "failed", "to do", "collisions", "size"),
        *("last file", "engine", "config"),
    ]
    cells = re.split(r"\s{2,}", row)
    assert cells[:7] == ["small", "2", "3", "6", "0", "0", "0"]
    assert cells[-2:] == [str(ENGINE_VERSION), runs.open_run("small").identity]
    assert snooker("ls", "runs/small").out == ended.out


def test_each_repeat_is_in_one_column(finished: Path, snooker: Snooker) -> None:
    run = runs.open_run("small")
    run.path(0, 0).unlink()
    run.path(0, 1).write_text("not HDF5")
    run.path(1, 1).unlink()
    interrupt(run.path(1, 2))
    note_failure(run, 0, 0, "no room")
    note_failure(run, 1, 0, "of an attempt before; it is done now")
    with (finished / runs.FAILURES).open("a") as file:
        file.write('{"point": 1, "repeat": 1, "err')  # a kill while it was written
    (one,) = listed(snooker)
    assert one["state"] == "unfinished"
    assert [one[name] for name in COUNTS] == [2, 0, 1, 3]
    first, second = shown(snooker)["ledger"]
    assert [first[name] for name in COUNTS] == [1, 0, 1, 1]
    assert [second[name] for name in COUNTS] == [1, 0, 0, 2]
    assert first["remarks"][0] == {"repeat": 0, "remark": "failed: no room"}
    assert first["remarks"][1]["remark"].startswith("not a readable result of snooker (")
    assert second["remarks"] == [{"repeat": 2, "remark": "cut"}]
    said = snooker("show", "small").out
    assert "point 0, repeat 0: failed: no room\n" in said
    assert "point 1, repeat 2: cut\n" in said


def test_show_tells_what_there_is(finished: Path, snooker: Snooker) -> None:
    assert snooker("fit", "small").code == 0
    content = shown(snooker)
    run = runs.open_run("small")
    assert [point["parameters"] for point in content["ledger"]] == [{"cor": 0.85}, {"cor": 1.0}]
    for point, one in zip(run.points, content["ledger"], strict=True):
        reasons = [str(trace.stop.reason) for trace in run.traces(point)]
        assert one["ended"] == {reason: reasons.count(reason) for reason in reasons}
    assert content["analyses"] == ["fit.json"]
    told = {store.read_header(path).provenance.command for path in finished.glob("point-*/*.h5")}
    assert {content["command"]} == told
    lines = snooker("show", "small").out.splitlines()
    assert re.fullmatch(
        rf"runs/small: done; engine {ENGINE_VERSION}, config [0-9a-f]{{8}}", lines[0]
    )
    assert re.split(r"\s{2,}", lines[2])[:5] == ["cor=0.85", "3", "0", "0", "0"]
    assert re.fullmatch(r"6 files of \d+ kB and fit\.json", lines[4])
    assert lines[5].endswith(f", by: {content['command']}")


def test_a_held_folder_is_running(finished: Path, snooker: Snooker) -> None:
    """The lock is asked for and the file that is begun is seen; without the lock it is a relic."""
    run = runs.open_run("small")
    run.path(1, 0).unlink()
    with runs.locked(finished):
        temporary_path(run.path(1, 0)).touch()
        (one,) = listed(snooker)
        assert one["state"] == "running"
        assert [one[name] for name in COUNTS] == [5, 1, 0, 0]
    (one,) = listed(snooker)
    assert one["state"] == "unfinished"
    assert [one[name] for name in COUNTS] == [5, 0, 0, 1]


def test_asking_does_not_keep_a_run_from_beginning(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever asks has the folder for a moment; a run that begins waits for one."""
    asking = os.open(finished, os.O_RDONLY)
    fcntl.flock(asking, fcntl.LOCK_SH)
    assert not runs.is_locked(finished)
    waited: list[float] = []

    def wait(seconds: float) -> None:
        waited.append(seconds)
        if len(waited) == 3:
            os.close(asking)

    monkeypatch.setattr("snooker_cli.runs.folder.time.sleep", wait)
    with runs.locked(finished):
        assert runs.is_locked(finished)
    assert len(waited) == 3


def test_a_run_of_another_engine_version_is_told_as_it_is(finished: Path, snooker: Snooker) -> None:
    manifest = json.loads((finished / runs.MANIFEST).read_text())
    manifest["engine_version"] = ENGINE_VERSION - 1
    write_json(finished / runs.MANIFEST, manifest)
    (one,) = listed(snooker)
    assert one["engine_version"] == ENGINE_VERSION - 1
    assert one["to_do"] == 6
    remarks = [each["remark"] for point in shown(snooker)["ledger"] for each in point["remarks"]]
    assert len(remarks) == 6
    assert all(f"is of engine version {ENGINE_VERSION}, not" in remark for remark in remarks)


def test_an_extended_run_has_its_shorter_repeats_to_do(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    book = run_status(made(finished, small_config, "collisions=151"))
    assert [point.to_do for point in book.points] == [3, 3]
    assert {sentence for point in book.points for _, sentence in point.remarks} == {
        "is shorter than the extended run"
    }


def test_a_folder_that_is_no_run_is_not_listed(finished: Path, snooker: Snooker) -> None:
    (finished.parent / "report").mkdir()
    (finished.parent / "broken").mkdir()
    (finished.parent / "broken" / runs.MANIFEST).write_text("{")
    ended = snooker("ls")
    assert ended.code == 0
    assert len(ended.out.splitlines()) == 2
    assert re.fullmatch(r"snooker: runs/broken/run\.json: cannot be read .*\n", ended.err)
    told = json.loads(snooker("ls", "--json").out)
    assert [one["run"] for one in told] == ["runs/broken", "runs/small"]
    assert "cannot be read" in told[0]["error"]


@pytest.mark.parametrize(
    ("wanted", "near"),
    [
        ("smal", "small"),
        ("runs/smal", "runs/small"),
        ("elastic", ""),
        ("other/small", ""),
    ],
)
def test_the_nearest_run_is_told(wanted: str, near: str, finished: Path, snooker: Snooker) -> None:
    (finished.parent / wanted).mkdir(parents=True)  # no run
    ended = snooker("show", wanted)
    meant = f"the nearest is {near}, and `snooker ls` lists all" if near else "make one with"
    assert ended.code == 2
    assert ended.err.startswith(f"snooker: {wanted}: there is no run here (no run.json); {meant}")
    assert not near or snooker("show", near).code == 0


def test_nothing_to_list_is_said(here: Path, snooker: Snooker) -> None:
    ended = snooker("ls")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith("snooker: runs: there is no such folder; ")
    ended = snooker("ls", ".")
    assert (ended.code, ended.out, ended.err) == (0, "", "snooker: .: contains no runs\n")
    assert listed(snooker, ".") == []


@pytest.mark.parametrize("command", ["show", "verify"])
def test_no_run_is_said(command: str, here: Path, snooker: Snooker) -> None:
    ended = snooker(command, "absent")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith("snooker: absent: there is no run here ")
