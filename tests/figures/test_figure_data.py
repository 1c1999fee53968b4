"""Bands over repeats at common times."""

from __future__ import annotations

import numpy as np
import pytest

from snooker_cli.figures.figure_data import at_common_times, bands


def test_curves_that_are_straight_or_change_in_steps() -> None:
    one = np.array([0.0, 2.0, 4.0]), np.array([1.0, 3.0, 5.0])
    other = np.array([1.0, 4.0, 9.0]), np.array([10.0, 40.0, 90.0])
    times, straight = at_common_times([one, other])
    assert (times[0], times[-1]) == (1.0, 4.0)
    assert straight[0] == pytest.approx(1 + times)
    assert straight[1] == pytest.approx(10 * times)
    times, stepped = at_common_times([one, other], steps=True)
    assert stepped[0].tolist() == np.select([times < 2, times < 4], [1.0, 3.0], 5.0).tolist()
    assert stepped[1].tolist() == np.where(times < 4, 10.0, 40.0).tolist()
    (band,) = bands([one, other], 2, steps=True)
    assert band.series == 2
    edges = 22.5 - 17.5 * 2**0.5, 22.5 + 17.5 * 2**0.5  # of 5 and 40, with the sample deviation
    assert (band.low[-1], band.high[-1]) == pytest.approx(edges)


def test_no_band_of_one_repeat_or_of_repeats_without_common_times() -> None:
    early = np.array([0.0, 1.0]), np.array([1.0, 0.5])
    late = np.array([2.0, 3.0]), np.array([1.0, 0.5])
    assert bands([early], 0, steps=True) == []
    assert bands([early, late], 0, steps=True) == []
