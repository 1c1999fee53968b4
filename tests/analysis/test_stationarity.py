"""One test of whether a mean is steady, for all quantities."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snooker_cli.analysis.goodness import LEAST_PROBABILITY
from snooker_cli.analysis.stationarity import LEAST_REPEATS, change_of


def quarters(change: float = 0.0, repeats: int = 20) -> np.ndarray:
    """Means over quarters with a spread of 1 % between repeats, and a change of the last one."""
    values = 1 + 0.01 * np.random.default_rng(7).normal(size=(repeats, 4))
    return values + change * np.array([0.0, 0.0, 0.0, 1.0])


def test_a_change_above_the_stated_one_is_found() -> None:
    """The test says what it could have found, here some 1 % of the mean."""
    steady = change_of(quarters())
    assert not steady.refused
    assert 0.005 < steady.least < 0.015
    assert f"one above {100 * steady.least:.2g} % would be" in steady.sentence
    ends = np.diff(quarters()[:, [0, 3]]).mean()
    for share in (1.01, 2.0):
        changed = change_of(quarters(share * steady.least - ends))
        assert changed.refused
        assert changed.probability < LEAST_PROBABILITY
        assert changed.sentence.startswith("it is not steady: 0.99")


def test_it_needs_repeats_that_differ() -> None:
    few = change_of(quarters(repeats=LEAST_REPEATS - 1))
    assert math.isnan(few.probability)
    assert not few.refused
    assert few.sentence.startswith("too few repeats")
    assert "rounding" in change_of(np.ones((6, 4))).sentence
    unknown = quarters()
    unknown[3] = math.nan  # a repeat that is too short
    assert change_of(unknown).repeats == 19


@pytest.mark.parametrize("place", [1, 2])
def test_a_middle_quarter_counts_too(place: int) -> None:
    values = quarters(repeats=40)
    values[:, place] += 0.02
    assert change_of(values).refused
