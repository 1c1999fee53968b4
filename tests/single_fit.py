"""A fit of one curve, for tests of fits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from snooker_cli.analysis.fitting import Curves, FitResult, fit_all


def fit(
    t: ArrayLike, y: ArrayLike, model: str = "exponential", rounding: float = 0.0, **how: Any
) -> FitResult:
    """``fit_all`` of one curve."""
    curve = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64), rounding
    return fit_all(Curves.of([curve]), model, **how)[0]
