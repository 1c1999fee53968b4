"""A fit of one curve, for tests of fits."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from snooker_cli.analysis.fitting import FitResult, Points, fit_all


def fit(
    t: ArrayLike,
    y: ArrayLike,
    model: str = "exponential",
    rounding: float = 0.0,
    amplitude: float | None = None,
    start: float | None = None,
    weight: ArrayLike | None = None,
) -> FitResult:
    """``fit_all`` of one curve; t0 is its first time unless a start is given."""
    time, value = (np.asarray(column, dtype=np.float64) for column in (t, y))
    counted = np.ones_like(time) if weight is None else np.asarray(weight, dtype=np.float64)
    first = time[0] if time.size else math.nan
    # A point of no weight is none.
    points = Points(*(np.append(column, 0.0)[np.newaxis] for column in (time, value, counted)))
    origin = np.array([first if start is None else start])
    return fit_all(points, origin, np.array([rounding]), model, amplitude)[0]
