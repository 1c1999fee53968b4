"""How the main result of a run changes along a swept key, beside theory."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.findings import (
    distance,
    has_theory,
    main_result,
    theory_name,
)
from snooker_cli.analysis.goodness import MOST_ERRORS
from snooker_cli.analysis.quantities import QUANTITIES, Quantity
from snooker_cli.analysis.run_analysis import JsonRows
from snooker_cli.formatting import point_label, value_text, with_error

Array = NDArray[np.float64]

FALLS, RISES = "falls", "rises"
SURE = 2.0  # errors by which two neighbours differ, so that a change has a direction


@dataclass(frozen=True)
class Trend:
    """The main result of points along a key, such as α, T_rot/T_tr or PV/NT, beside one theory.

    key, key_unit : the swept key, and the unit of its values; empty for a number
    rows : a comparison of each point, in the order of the key
    words : the values of the key as a sentence has them; without them they are those of a config
    """

    key: str
    rows: Sequence[Mapping[str, Any]]
    key_unit: str = ""
    words: Mapping[float, str] = field(default_factory=dict)

    def column(self, name: str) -> Array:
        """A number of each row, (*points*,); nan where it is not known."""
        values = (row[name] for row in self.rows)
        return np.array([math.nan if value is None else float(value) for value in values])

    @property
    def x(self) -> Array:
        """The values of the key, (*points*,)."""
        return np.array([float(row["parameters"][self.key]) for row in self.rows])

    @property
    def quantity(self) -> Quantity:
        """What the result is."""
        return QUANTITIES[self.rows[0]["quantity"]]

    @property
    def theory(self) -> str:
        """The name of the theory; empty if there is only that of an ideal gas."""
        return theory_name(self.rows[0]) if has_theory(self.rows[0]) else ""

    def sentence(self) -> str:
        """How the result changes, and where it is farthest from theory; without a full stop."""
        return "; ".join(filter(None, [self.change, self._farthest() if self.theory else ""]))

    @property
    def change(self) -> str:
        """How the result changes, and whether as steeply as in theory; without a full stop."""
        verb, ends = self._verb(), (self.rows[0], self.rows[-1])
        if verb not in (FALLS, RISES):
            ends = min(self.rows, key=_measured), max(self.rows, key=_measured)
        unit = self.quantity.unit_text
        low, high = (
            f"{with_error(row['measured'], row['error'], unit)} at {self._place(row)}"
            for row in ends
        )
        beside = self._beside_theory() if self.theory else ""
        return f"{self.quantity.symbol} {verb} from {low} to {high}{beside}"

    def _place(self, row: Mapping[str, Any]) -> str:
        """The value of the key at a point: ``balls.radius = 1.2 m``."""
        value = row["parameters"][self.key]
        return self.words.get(value) or f"{self.key} = {value_text(value)} {self.key_unit}".rstrip()

    def _verb(self) -> str:
        """`FALLS` or `RISES` where no step is the other way beyond its error; else a range."""
        values, errors = self.column("measured"), self.column("error")
        steps = np.diff(values)
        of_steps = SURE * np.nan_to_num(np.hypot(errors[1:], errors[:-1]))
        if np.all(steps <= of_steps) and np.any(steps < -of_steps):
            return FALLS
        if np.all(steps >= -of_steps) and np.any(steps > of_steps):
            return RISES
        return "changes, not in one direction," if np.any(np.abs(steps) > of_steps) else "ranges"

    def _beside_theory(self) -> str:
        """Whether the change is steeper than that of theory, if the ends show it.

        The share of theory at an end has the error of the difference over the prediction.
        """
        predicted, measured = self.column("predicted"), self.column("measured")
        share, error = measured / predicted, self.column("difference_error") / np.abs(predicted)
        change, of_change = share[-1] - share[0], math.hypot(error[0], error[-1])
        if not math.isfinite(change / of_change if of_change else math.nan):
            return ""
        if abs(change) < MOST_ERRORS * of_change:
            return f", as steeply as {self.theory} (within {MOST_ERRORS:g} standard errors)"
        growth = [abs(math.log(values[-1] / values[0])) for values in (measured, predicted)]
        steeper = "more" if growth[0] > growth[1] else "less"
        return f", {steeper} steeply than {self.theory} ({abs(change) / of_change:.1f} errors)"

    def _farthest(self) -> str:
        """Where the result differs most from theory, in errors; of at least two that are known."""
        errors = np.abs(self.column("difference_in_errors"))
        errors = np.where(np.isfinite(errors), errors, -1.0)
        known = np.count_nonzero(errors >= 0)
        if known < 2:
            return ""
        place = int(np.argmax(errors))
        row = self.rows[place]
        most = f"{errors[place]:.1f} errors, the most of {known} points"
        return f"it is {distance(row)} theory at {self._place(row)} ({most})"


def _measured(row: Mapping[str, Any]) -> float:
    return float(row["measured"])


def trends(compared: Sequence[Mapping[str, Any]], key: str, unit: str = "") -> dict[str, Trend]:
    """Trends along a key, by the values of the other keys (empty if there is none).

    compared : rows of ``comparisons``
    unit : of the key
    """
    groups: dict[str, JsonRows] = {}
    for row in main_result(compared):
        others = dict(row["parameters"])
        value = others.pop(key, None)
        if isinstance(value, int | float) and not isinstance(value, bool):
            groups.setdefault(point_label(others) if others else "", []).append(row)
    along = {label: trend_of(rows, key, unit) for label, rows in groups.items()}
    return {label: trend for label, trend in along.items() if trend is not None}


def trend_of(
    compared: JsonRows, key: str, unit: str = "", words: Mapping[float, str] | None = None
) -> Trend | None:
    """The trend of points with a number of this key each; ``None`` of fewer than two.

    unit, words : of the key's values, as of ``Trend``

    It is of the main quantity beside one theory, see `main_result`.
    """
    rows = sorted(main_result(compared), key=lambda row: float(row["parameters"][key]))
    return Trend(key, rows, unit, words or {}) if len(rows) > 1 else None
