"""Pairs of neighbours: all of them and no others, by comparing every disk with every other."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snooker_cli import neighbours
from snooker_cli.neighbours import near, near_pairs

Pairs = list[tuple[int, int]]


def found(positions, radii, gap, period=None) -> Pairs:
    pieces = near_pairs(np.array(positions), np.array(radii), gap, period)
    return sorted(
        (min(pair), max(pair))
        for i, j, _ in pieces
        for pair in zip(i.tolist(), j.tolist(), strict=True)
    )


def compared(positions, radii, gap, period=None) -> Pairs:
    """Pairs whose surfaces, or those of images, are no further apart."""
    images = [(0.0, 0.0)]
    if period is not None:
        steps = [(-side, 0.0, side) for side in period]
        images = list(itertools.product(*steps))
    return [
        (i, j)
        for i, j in itertools.combinations(range(len(radii)), 2)
        if min(
            math.hypot(positions[i][0] - positions[j][0] + x, positions[i][1] - positions[j][1] + y)
            for x, y in images
        )
        <= radii[i] + radii[j] + gap
    ]


@given(
    st.integers(0, 2**32),
    st.integers(1, 40),
    st.floats(0.1, 10.0),
    st.floats(0.0, 3.0),
    st.booleans(),
)
@settings(derandomize=True, deadline=None, max_examples=200)
def test_all_pairs_are_found_once(seed, number, height, octaves, periodic):
    """Radii over three octaves and more, in boxes of every form."""
    random = np.random.default_rng(seed)
    size = (1.0, height)
    positions = ((random.random((number, 2)) - 0.5) * size).tolist()
    largest = min(size) / 8
    radii = (largest * 2.0 ** -(3 * octaves * random.random(number))).tolist()
    gap = largest / 10
    period = size if periodic else None
    assert found(positions, radii, gap, period) == compared(positions, radii, gap, period)


def test_pieces_are_no_more_than_a_way_to_save_memory(monkeypatch):
    random = np.random.default_rng(1)
    positions, radii = random.random((300, 2)), np.full(300, 0.02)
    whole = found(positions, radii, 0.0)
    assert len(whole) > 50
    monkeypatch.setattr(neighbours, "CHUNK", 7)
    assert len(list(near_pairs(positions, radii, 0.0))) > 100
    assert found(positions, radii, 0.0) == whole


@pytest.mark.parametrize("points", [np.zeros((0, 2)), np.zeros((1, 2)), np.zeros((5, 2))])
def test_few_points_and_points_at_one_place(points):
    pairs = sum(len(a) for a, _, _ in near(points, points, 1.0))
    assert pairs == len(points) ** 2
    assert list(near(points, np.zeros((0, 2)), 1.0)) == []
