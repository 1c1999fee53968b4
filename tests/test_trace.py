"""Collisions at exactly the same time: how many there are, and in which order they happen."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import scene_of

from snooker_cli.engine import simulate
from snooker_cli.trace import SLIDE, Events, Simultaneous, event_hashes


def counted(pieces: list[Events]) -> int:
    ties = Simultaneous()
    for events in pieces:
        ties.add(events)
    return ties.number


event = st.tuples(
    st.integers(0, 3), st.sampled_from([0.0, 1e-20]), st.integers(0, 4), st.integers(SLIDE, 4)
)


@given(rows=st.lists(event, max_size=30), cuts=st.lists(st.integers(0, 30), max_size=3))
@settings(derandomize=True, deadline=None)
def test_collisions_at_the_time_of_another_of_the_same_ball(rows, cuts):
    """In pieces too. A residual tells apart times that are rounded; a slide is no collision."""
    rows = sorted(row for row in rows if row[2] != row[3])
    time, residual, i, j = (
        (np.array(column) for column in zip(*rows, strict=True)) if rows else (np.empty((4, 0)))
    )
    events = Events(
        *(time.astype(float), i.astype(np.int32), j.astype(np.int32), time * 0.0),
        residual=residual * 1.0,
    )
    collisions = [row for row in rows if row[3] != SLIDE]
    met = Counter((*row[:2], ball) for row in collisions for ball in row[2:] if ball >= 0)
    naive = sum(any(met[(*row[:2], ball)] > 1 for ball in row[2:]) for row in collisions)
    edges = [0, *sorted(min(cut, len(rows)) for cut in cuts), len(rows)]
    pieces = [events[slice(*pair)] for pair in itertools.pairwise(edges)]
    assert counted(pieces) == naive


def test_a_ball_that_meets_two_at_once():
    """One after the other: the second contact is predicted again with what the first has left.

    The velocities are those of two collisions of pairs; one of three balls has no law here.
    """
    places = np.array([(-5.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    scene = scene_of([(*place, 1.0 - bool(k), 0.0, 1.0, 1.0) for k, place in enumerate(places)])
    trace = simulate(scene, time=6.0)
    events = trace.events
    assert events.time[0] == events.time[1] == pytest.approx(5.0 - math.sqrt(3.0))
    assert events.i.tolist() == [0, 0]
    assert events.j.tolist() == [1, 2]  # the ball with the lower number first
    velocities = np.array(scene.velocities)
    for k in range(2):
        other = int(events.j[k])
        normal = (places[other] - (-math.sqrt(3.0), 0.0)) / 2.0
        change = ((velocities[0] - velocities[other]) @ normal) * normal
        velocities[0] -= change
        velocities[other] += change
    assert np.allclose(trace.finish.velocities, velocities, rtol=0, atol=1e-14)
    assert not np.allclose(velocities[1], velocities[2] * (1, -1))
    assert counted([events]) == 2


def test_hashes_are_of_powers_of_ten_and_of_all() -> None:
    number = 12_345
    events = Events(
        np.arange(number, dtype=np.float64), *np.zeros((2, number), np.int32), np.ones(number)
    )
    assert [count for count, _ in event_hashes([events])] == [1000, 10_000, number]
    assert event_hashes([events[:7000], events[7000:]]) == event_hashes([events])
