"""``snooker run``: results, plans, hints, and engines by choice."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from command_line import Snooker

from snooker_cli import runs
from snooker_cli.runs import progress
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.trace import StopReason

GAS = """\
container: {radius: 10.0}
balls: {count: 100, radius: 0.3, speed: 10}
cor: 0.9
collisions: 5000
repeats: 2
"""
HARD = Path(__file__).parents[2] / "configs" / "hard"


def ran(snooker: Snooker, *arguments: str) -> dict[str, Any]:
    """What ``run --json`` prints."""
    ended = snooker("run", *arguments, "--json")
    assert ended.code == 0, ended.err
    return dict(json.loads(ended.out, parse_constant=pytest.fail))


def planned(snooker: Snooker, *arguments: str) -> dict[str, Any]:
    """What ``run --dry-run --json`` prints."""
    return ran(snooker, *arguments, "--dry-run")


def overrides(*keys: str) -> list[str]:
    return [f"--override={key}" for key in keys]


# Results


@pytest.mark.parametrize("replaced", [False, True])
def test_a_folder_that_is_deleted_during_a_run_is_an_error(
    replaced: bool, here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run ends soon, and leaves no folder that the next run would refuse."""
    assert snooker("run", "small.yaml", "--out", "other").code == 0
    finish, done = progress.RunProgress.finished, []

    def finished(self: progress.RunProgress, result: RepeatResult) -> None:
        finish(self, result)
        if not done and replaced:
            shutil.move("runs/small", "moved")
            shutil.copytree("other", "runs/small")
        elif not done:
            shutil.rmtree("runs/small")
        done.append(result)

    monkeypatch.setattr(progress.RunProgress, "finished", finished)
    many = ["run", "small.yaml", "-o", "collisions=2000", "-o", "repeats=10000", "-j", "1"]
    ended = snooker(*many)
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.splitlines()[-1] == (
        "snooker: runs/small: was deleted, moved or replaced during the run; "
        "run the same command again"
    )
    assert 0 < len(done) < 20000
    assert Path("runs/small").exists() == replaced
    if not replaced:
        monkeypatch.undo()
        monkeypatch.chdir(here)
        assert snooker("run", "small.yaml").code == 0


def test_json_holds_what_the_files_hold(here: Path, snooker: Snooker) -> None:
    printed = ran(snooker, "small.yaml", "--out", "elsewhere", "-j", "2")
    assert printed["run"] == "elsewhere"
    assert printed["events"] == sum(point["collisions"] for point in printed["points"])
    run = runs.open_run("elsewhere")
    for point, record in zip(run.points, printed["points"], strict=True):
        traces = list(run.traces(point))
        assert record["parameters"] == dict(point.parameters)
        assert record["collisions"] == sum(trace.collisions for trace in traces)
        assert record["ended"] == Counter(str(trace.stop.reason) for trace in traces)
        stops = [(stop["repeat"], stop["reason"], stop["time"]) for stop in record["stops"]]
        assert stops == [
            (repeat, "wall_trap", trace.stop.time)
            for repeat, trace in enumerate(traces)
            if trace.stop.reason is StopReason.WALL_TRAP
        ]
    assert [bool(point["stops"]) for point in printed["points"]] == [True, False]
    again = ran(snooker, "small.yaml", "--out", "elsewhere")
    assert (again["events"], again["seconds"], again["events_per_second"]) == (0, 0, 0)
    for before, after in zip(printed["points"], again["points"], strict=True):
        assert after == before | {"cached": 3}


def test_a_table_has_the_first_points(here: Path, snooker: Snooker) -> None:
    short = overrides("repeats=1", "cor=1", "collisions=1")
    lines = snooker(
        "run", "small.yaml", *short, "-o", "container.mass=1e7:2e7:240"
    ).out.splitlines()
    assert lines[201] == "... and 40 more points; --json prints all"
    arguments = ["small.yaml", *short, "-o", "container.mass=1e7,.inf", "--out", "two"]
    points = ran(snooker, *arguments)["points"]
    assert [point["parameters"]["container.mass"] for point in points] == [1e7, None]


def test_a_forced_engine_is_stored_and_used_again(here: Path, snooker: Snooker) -> None:
    arguments = ["small.yaml", *overrides("container.mass=.inf", "cor=0.9"), "--engine", "cells"]
    ran(snooker, *arguments)
    run = runs.open_run("small")
    assert run.engine == run.status(0, 0).header.provenance.engine == "cells"
    assert ran(snooker, *arguments)["points"][0]["cached"] == 3
    assert snooker("run", *arguments[:-2]).code == 2


# Hints after a collapse


@pytest.mark.parametrize(
    ("config", "keys", "hint", "way"),
    [
        ("along-the-wall", ["wall_cor=0.5"], "`collapse: slide`", "collapse=slide"),
        ("along-the-wall", ["wall_cor=0.5", "container.mass=1e7"], "`collapse: {tc: 0.01}`", ""),
        ("along-the-wall", ["wall_cor=0.5", "collapse=slide"], "", ""),
        ("along-the-wall", ["wall_cor=1.0"], "", ""),  # no loss that could be avoided
        ("collapse-three", ["cor=0.05"], "`collapse: {tc: 0.01}`", "collapse.tc=0.01"),
    ],
)
def test_a_hint_says_how_collapsed_repeats_continue(
    config: str, keys: list[str], hint: str, way: str, here: Path, snooker: Snooker
) -> None:
    arguments = ["run", str(HARD / f"{config}.yaml"), "--no-progress", *overrides(*keys)]
    ended = snooker(*arguments, "--out", "before")
    assert ended.code == 0, ended.err
    assert ("To continue such repeats" in ended.out) == bool(hint)
    assert hint in ended.out
    if way:
        continued = snooker(*arguments, "-o", way, "--out", "after")
        assert continued.code == 0, continued.err
        assert "wall_trap" not in continued.out
        assert " collapse" not in continued.out


# Plans


def test_a_plan_writes_nothing_and_adds_up(here: Path, snooker: Snooker) -> None:
    plan = planned(snooker, "small.yaml", "-j", "2")
    assert list(here.iterdir()) == [here / "small.yaml"]
    assert [plan[name] for name in ("points", "repeats", "cached", "to_do")] == [2, 3, 0, 6]
    assert (plan["collisions"], plan["threads"]) == (900, 2)
    lossy, elastic = plan["kinds"]
    assert (lossy["points"], elastic["points"]) == ([{"cor": 0.85}], [{"cor": 1.0}])
    for scenes in (lossy, elastic):
        assert (scenes["balls"], scenes["shape"], scenes["engine"]) == ([7], "circle", "allpairs")
        assert (scenes["to_do"], scenes["collisions"]) == (3, 450)
    assert sum(scenes["bytes"] for scenes in plan["kinds"]) == plan["bytes"]
    spent = sum(scenes["processor_seconds"] for scenes in plan["kinds"])
    assert plan["seconds"] == pytest.approx(spent / 2)


def test_a_plan_counts_stored_repeats(separate: Path, snooker: Snooker) -> None:
    plan = planned(snooker, "small.yaml")
    assert (plan["cached"], plan["to_do"], plan["collisions"], plan["bytes"]) == (6, 0, 0, 0)
    assert planned(snooker, "small.yaml", "-o", "repeats=5")["to_do"] == 4
    longer = snooker("run", "small.yaml", "--dry-run", "-o", "collisions=160")
    assert longer.err.startswith("snooker: this extends runs/small: collisions from 150 to 160; ")
    assert planned(snooker, "small.yaml", "--fresh")["to_do"] == 6
    (separate / "point-0001" / "repeats-0002-0002.h5").write_bytes(b"")
    assert planned(snooker, "small.yaml")["to_do"] == 1


def test_a_plan_warns_of_balls_that_cool_until_they_drift_together(
    here: Path, snooker: Snooker
) -> None:
    """Speeds are 10⁻¹⁶ of what they were after 36 · 2N / (1 − CoR²) collisions."""
    Path("gas.yaml").write_text(
        "container: {shape: periodic}\ncor: 0.999\n"
        "balls: {count: 217, packing: 0.1, radius: 1.0, speed: 10.0}\n"
    )
    for keys, warned in (
        (["collisions=7.8e6"], False),
        (["collisions=7.9e6"], True),
        (["collisions=7.9e6", "cor=1"], False),
        (["collisions=7.9e6", "collapse={elastic_below: 0.01}"], False),
        (["collisions=7.9e6", "container.shape=circle"], False),
        (["collisions=7.9e6", "container.shape=box"], False),
    ):
        assert planned(snooker, "gas.yaml", *overrides(*keys))["cools_out"] == warned, keys
        printed = snooker("run", "gas.yaml", "--dry-run", *overrides(*keys)).out
        assert ("This may take much longer" in printed) == warned, keys


def test_a_run_reports_older_figures(finished: Path, snooker: Snooker) -> None:
    """Only if it simulates something; ``--fresh`` asks for it."""
    assert snooker("plot", "small", "energy", "--format", "svg").code == 0
    assert snooker("run", "small.yaml").err == ""
    printed = snooker("run", "small.yaml", "-o", "repeats=4").err
    assert "run `snooker plot runs/small` again" in printed
    printed = snooker("run", "small.yaml", "--fresh").err
    assert "again" not in printed


@pytest.mark.parametrize("record", ["events", "summary"])
@pytest.mark.parametrize("collisions", [500, 50_000])
def test_files_are_about_as_large_as_estimated(
    record: str, collisions: int, here: Path, snooker: Snooker
) -> None:
    Path("gas.yaml").write_text(GAS)
    keys = [f"collisions={collisions}", f"record={record}", "cor=1", "balls.count=37"]
    plan = planned(snooker, "gas.yaml", *overrides(*keys))
    ran(snooker, "gas.yaml", *overrides(*keys))
    size = sum(path.stat().st_size for path in Path("runs/gas").glob("point-*/*.h5"))
    assert size / 2 < plan["bytes"] < 2 * size


def test_a_run_of_very_much_does_not_begin(here: Path, snooker: Snooker) -> None:
    """Eighty terabytes; and months, which need no disk."""
    for key, unit, least in (("seed=1", "bytes", 8e13), ("record=summary", "seconds", 4e6)):
        arguments = ["small.yaml", *overrides("collisions=1e13", key), "-j", "2"]
        plan = planned(snooker, *arguments)
        assert plan[unit] > least
        assert (plan["bytes"] > plan["free_bytes"]) == (unit == "bytes")
        ended = snooker("run", *arguments)
        assert (ended.code, ended.out) == (2, "")
        assert "--yes" in ended.err
    assert list(here.iterdir()) == [here / "small.yaml"]


def test_a_run_begins_on_a_full_disk_with_yes(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = shutil.disk_usage(here)._replace(free=10_000)
    monkeypatch.setattr("shutil.disk_usage", lambda _: full)
    arguments = ("run", "small.yaml", "-j", "2", "--no-progress")
    refused = snooker(*arguments)
    assert refused.code == 2
    assert "only 10 kB are free" in refused.err
    assert snooker(*arguments, "--yes").code == 0
    # Stored repeats need no more disk, and two more repeats need less than is free.
    assert snooker(*arguments).code == 0
    assert snooker(*arguments, "-o", "repeats=4").code == 0
    assert snooker(*arguments, "-o", "repeats=6").code == 2


def test_the_bar_of_a_single_repeat_counts_its_collisions() -> None:
    for repeats, total, completed in ((1, 150, 100), (3, 3, 0)):
        shown = progress.RunProgress(repeats, bar=False, collisions=150)
        shown.events(100)
        (task,) = shown.bar.tasks
        assert (task.total, task.completed) == (total, completed)
