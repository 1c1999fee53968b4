"""What a run will do: the classes of its scenes, and what is refused beforehand."""

from __future__ import annotations

from pathlib import Path

import pytest

from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RunFolder
from snooker_cli.runs.plan import (
    BATCH_BYTES,
    EVENT_IN_MEMORY,
    batch_size,
    is_excessive,
    points_and_classes,
    run_plan,
    scene_classes,
)

GAS = """\
container: {radius: 10.0}
balls: {count: 100, radius: 0.3, speed: 10}
cor: 1
collisions: 10
"""


def test_a_plan_counts_what_is_left_to_do(finished_run: RunFolder) -> None:
    classes = scene_classes(finished_run.points)
    plan = run_plan(finished_run, classes, workers=2)
    assert (plan["cached"], plan["to_do"], plan["collisions"], plan["bytes"]) == (6, 0, 0, 0)
    plan = run_plan(finished_run, classes, workers=2, fresh=True)
    assert (plan["to_do"], plan["collisions"], plan["threads"]) == (6, 900, 2)
    assert not is_excessive(plan)


@pytest.mark.parametrize(
    "overrides",
    [
        ["cor=0.9", "balls.radius=0.6", "collapse=slide"],
        ["container={shape: periodic, width: 20}", "cor=0.9", "time=50"],
        ["time=1e6", "collisions=70"],
    ],
)
def test_the_collisions_of_a_repeat_that_ends_at_a_time_are_estimated(
    overrides: list[str],
) -> None:
    timed = GAS.replace("collisions: 10", "time: 5")
    loaded = parse(timed, overrides=overrides)
    every, classes = points_and_classes(loaded)
    plan = run_plan(RunFolder(Path("absent"), loaded.config, every), classes, workers=1)
    (point,) = every
    scene, config = starting_scene(point.config, 0), point.config
    found = simulate(scene, time=config.time, collisions=config.collisions)
    assert found.stop.reason.complete
    assert plan["collisions"] == pytest.approx(found.collisions, rel=0.15)
    assert plan["by_time"]
    assert plan["seconds"] > 0
    assert plan["bytes"] > 14 * plan["collisions"]


def test_a_repeat_without_an_end_is_planned() -> None:
    loaded = parse(GAS, overrides=["collisions=null", "time=1e308"])
    every, classes = points_and_classes(loaded)
    plan = run_plan(RunFolder(Path("absent"), loaded.config, every), classes, workers=1)
    assert plan["collisions"] == 1e18
    assert is_excessive(plan)


def sizes(*overrides: str) -> list[int]:
    """The batch size of a small gas for each of several limits."""
    common = ("balls.count=37", *overrides)
    return [
        batch_size(parse(GAS, overrides=[*common, f"collisions={10**k}"]).config)
        for k in range(2, 8)
    ]


def test_batches_are_of_about_a_second_or_16_megabytes() -> None:
    """By the plan's own estimates, so they are equal on all machines; long repeats are alone."""
    events, summaries = sizes(), sizes("record=summary")
    assert events == sorted(events, reverse=True)
    assert events[0] > 100
    assert events[-2:] == [1, 1]
    for k, size in enumerate(events, 2):
        assert size == 1 or size * EVENT_IN_MEMORY * 10**k < BATCH_BYTES
    assert summaries[0] == events[0]  # of few collisions, the events are stored
    assert summaries[1] < events[1]
    assert summaries[-2] > events[-2]  # a summary of long repeats takes less memory
    assert sizes("repeats=500", "seed=7") == events
