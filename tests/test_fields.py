"""The tables of what moves and of what an event has agree with the classes that hold it."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

import numpy as np
import pytest
from scenes import gas, rough

from snooker_cli.engine import States, replay, simulate
from snooker_cli.fields import EVENT_COLUMNS, MOVING, REQUIRED, moving_fields
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Trace

CONSTANT = {
    *("radii", "masses", "container", "container_mass", "pair_law", "wall_law", "surface"),
    *("contact_duration", "elastic_below", "slides", "wall_key"),
}
"""The fields of a scene that do not change in a repeat."""


def names(of: type[Any]) -> set[str]:
    return {field.name for field in fields(of)}


def test_each_field_of_a_scene_moves_or_is_constant() -> None:
    assert {field.name for field in MOVING} == names(Scene) - CONSTANT


def test_states_and_events_have_the_fields_of_the_tables() -> None:
    assert [column.name for column in EVENT_COLUMNS if column.title] == [*REQUIRED, "tangential"]
    assert [column.name for column in EVENT_COLUMNS] == [field.name for field in fields(Events)]
    needed = {field.name for field in fields(Events) if field.default is MISSING}
    assert needed == {*REQUIRED}


@pytest.fixture(params=[False, True], ids=["smooth", "rough"])
def trace(request: pytest.FixtureRequest) -> Trace:
    scene = gas("circle", 60, 0.3, cor=0.9)
    return simulate(rough(scene) if request.param else scene, collisions=50)


def test_arrays_have_the_shapes_of_the_table(trace: Trace) -> None:
    start = trace.start
    for field in moving_fields(start):
        rows = field.rows([start, trace.finish])
        assert rows.shape == (2, *field.shape(start.number))
        assert np.array_equal(field.of_row(rows[1]), getattr(trace.finish, field.name))


def test_states_are_those_of_scenes(trace: Trace) -> None:
    times = [0.0, trace.stop.time]
    states, ends = replay(trace, times), [trace.start, trace.finish]
    for made in (states, States.of(times, ends)):
        for row, end in enumerate(ends):
            scene = made.scene(trace.start, row)
            for field in moving_fields(end):
                assert np.array_equal(getattr(scene, field.name), getattr(end, field.name))
