"""Layers, and bands over repeats at common times."""

from __future__ import annotations

import numpy as np
import pytest

from snooker_cli.figures import (
    Line,
)
from snooker_cli.figures.figure_data import at_common_times, bands


def test_layers_keep_read_only_copies() -> None:
    x = np.arange(3.0)
    line = Line(x, x)
    x[0] = 7.0
    assert line.x.tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        line.y[0] = 1.0


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
    (band,) = bands(times, stepped, 2)
    assert band.series == 2
    assert (band.low[-1], band.high[-1]) == pytest.approx(
        (22.5 - 17.5 * 2**0.5, 22.5 + 17.5 * 2**0.5)
    )


def test_no_band_of_one_repeat_or_of_repeats_without_common_times() -> None:
    early = np.array([0.0, 1.0]), np.array([1.0, 0.5])
    late = np.array([2.0, 3.0]), np.array([1.0, 0.5])
    assert bands(*at_common_times([early]), 0) == []
    assert bands(*at_common_times([early, late]), 0) == []
