"""Measured quantities beside predictions: the rows of a comparison, and notes for their reader."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.observables import ROUNDING, mean_and_error

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Comparison:
    """A measured quantity beside a prediction, both means over the repeats.

    error : standard error of the measured mean
    difference_error : of the mean of measured less predicted, repeat by repeat, since many
        predictions follow the repeat's own temperature
    samples : speeds behind a distribution; ``None`` for a mean over the repeats
    """

    quantity: str
    unit: str
    model: str
    measured: float
    error: float
    predicted: float
    difference: float
    difference_error: float
    repeats: int
    samples: int | None = None

    @property
    def in_errors(self) -> float:
        """The difference in standard errors; nan if there is no error."""
        if not self.difference_error > 0:
            return math.nan
        if self.difference_error < ROUNDING * max(abs(self.measured), abs(self.predicted)):
            return math.nan  # the repeats agree to rounding: that is no measure of their spread
        return self.difference / self.difference_error


@dataclass(frozen=True)
class Comparisons:
    """All comparisons of a point, and what their reader has to know, in sentences."""

    rows: tuple[Comparison, ...]
    notes: tuple[str, ...]


class Table:
    """Collects comparisons from columns over the repeats, and notes."""

    def __init__(self) -> None:
        self.rows: list[Comparison] = []
        self.notes: list[str] = []
        self.columns: Sequence[object] = []

    def column(self, name: str) -> NDArray[np.float64]:
        """A measured quantity over the repeats."""
        return np.array([getattr(one, name) for one in self.columns], dtype=np.float64)

    def note(self, sentence: str) -> None:
        """A sentence for the reader, unless it is empty."""
        if sentence:
            self.notes.append(sentence)

    def add(self, quantity: str, unit: str, values: Any, model: str, predicted: Any) -> None:
        """A row; ``predicted`` is a number or a column over the repeats."""
        values = np.asarray(values, dtype=np.float64)
        predicted = np.broadcast_to(np.asarray(predicted, dtype=np.float64), values.shape)
        good = np.isfinite(values) & np.isfinite(predicted)
        if not np.any(good):
            measured = bool(np.any(np.isfinite(values)))
            why = "the theory has no value here" if measured else "it could not be measured"
            self.note(f"{quantity} ({model}) is left out: {why}")
            return
        values, predicted = values[good], predicted[good]
        mean, error = mean_and_error(values)
        difference = values - predicted
        spread = float(difference.std(ddof=1)) if len(difference) > 1 else math.nan
        self.rows.append(
            Comparison(
                quantity=quantity,
                unit=unit,
                model=model,
                measured=mean,
                error=error,
                predicted=float(predicted.mean()),
                difference=float(difference.mean()),
                difference_error=spread / math.sqrt(len(difference)),
                repeats=len(values),
            )
        )
