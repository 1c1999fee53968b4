"""The result that registry.yaml declares for a figure, and the sentences of the caption on it."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.analysis.goodness import FEWEST_TESTED, TOO_FEW
from snooker_cli.analysis.quantities import QUANTITIES, Quantity
from snooker_cli.figures.figure_data import Layer, Points
from snooker_cli.formatting import short, with_error

UNITS = {"1/s": "s⁻¹", "Pa m": "Pa·m", "J/(m s)": "J m⁻¹ s⁻¹"}
"""The units of tables as axes and captions print them, where they differ."""

FACTOR = 2.0  # from this many times theory on, or a half of it, a result has no percentage
ROUNDING = 1e-12  # up to this share of its value, an error is only rounding


def with_units_of_axes(text: str) -> str:
    """A sentence of an analysis with the units of axes: ``s⁻¹`` instead of ``1/s``."""
    units = "|".join(map(re.escape, UNITS))
    return re.sub(rf"(?<=[\d)⁰¹²³⁴⁵⁶⁷⁸⁹] )({units})(?!\w)", lambda match: UNITS[match[0]], text)


class Result(NamedTuple):
    """The result of a figure, as registry.yaml declares it.

    quantity : its name in ``QUANTITIES``
    number : the name of its mean in the numbers of the figure, or of each point; the name of the
        standard error is this one and ``_error``
    when : the part of the repeats that it describes: ``in the second half``
    theory : the name of its prediction in the same numbers, if there is one
    """

    quantity: str
    number: str
    when: str = ""
    theory: str = ""

    @property
    def definition(self) -> Quantity:
        """The quantity with its unit and words."""
        return QUANTITIES[self.quantity]

    @property
    def unit(self) -> str:
        """The unit after a value; empty for a ratio."""
        return UNITS.get(self.definition.unit_text, self.definition.unit_text)

    @property
    def name(self) -> str:
        """The quantity at the beginning of a sentence: ``Temperature T``, ``PV/NT``."""
        words, symbol = self.definition.words, self.definition.symbol
        if words == symbol:
            return symbol
        begun = f"{words[0].upper()}{words[1:]}"
        return begun if symbol in words.split() else f"{begun} {symbol}"

    @property
    def axis_label(self) -> str:
        """The symbol with the unit."""
        return self.definition.symbol + (f" ({self.unit})" if self.unit else "")

    def as_json(self) -> dict[str, str]:
        """The quantity, its unit, and the names of its number and of its prediction."""
        names = {"number": self.number, "theory": self.theory}
        return {"quantity": self.quantity, "unit": self.unit, **names}

    def sentence(self, rows: Sequence[Mapping[str, Any]], places: Sequence[str]) -> str:
        """The result of one row, or the least and the largest of several; empty without any.

        rows : the numbers of the figure, or those of each point
        places : the points in words
        """
        pairs = zip(rows, places, strict=True)
        known = [(row, place) for row, place in pairs if math.isfinite(self._mean(row))]
        if not known:
            return ""
        least, most = (end(known, key=lambda pair: self._mean(pair[0])) for end in (min, max))
        low, high = (self._value(row) for row, _ in (least, most))
        name = f"{self.name} {self.when}".rstrip()
        if len(rows) == 1:
            theory = rows[0].get(self.theory)
            beside = f" (theory: {short(theory, 4)}{self._unit})" if theory is not None else ""
            return f"{name} = {low}{beside}."
        missing = len(rows) - len(known)
        without = f"; {missing} of {len(rows)} points have no such value" if missing else ""
        if len(known) == 1:
            return f"{name} is {low} ({least[1]}){without}."
        if low == high:
            number = len(known)
            return (
                f"{name} is {low} at {f'all {number}' if number == len(rows) else number} points."
            )
        return f"{name} is between {low} ({least[1]}) and {high} ({most[1]}){without}."

    @property
    def _unit(self) -> str:
        return f" {self.unit}" if self.unit else ""

    def _mean(self, row: Mapping[str, Any]) -> float:
        value = row.get(self.number)
        return math.nan if value is None else float(value)

    def _value(self, row: Mapping[str, Any]) -> str:
        mean, error = self._mean(row), row.get(f"{self.number}_error")
        exact = error is None or not error > ROUNDING * abs(mean)
        return with_error(mean, None if exact else error, self.unit)


class _Deviation(NamedTuple):
    """ln(result/theory), its standard error, and the series."""

    residual: float
    error: float
    series: int

    @property
    def percent(self) -> tuple[float, float]:
        """Result over theory minus 1 and its error, in %."""
        with np.errstate(over="ignore"):
            share, factor = float(np.expm1(self.residual)), float(np.exp(self.residual))
        return 100 * share, 100 * factor * self.error


def _largest(points: Sequence[Points]) -> tuple[_Deviation, _Deviation]:
    """The residual that is largest in errors, and the one that is largest by itself.

    Without errors both are the second.
    """
    y = np.concatenate([layer.y for layer in points])
    error = np.concatenate([layer.y_error for layer in points if layer.y_error is not None])
    series = np.concatenate([np.full(len(layer.y), layer.series) for layer in points])
    has_error, size = np.isfinite(error) & (error > 0), np.nan_to_num(np.abs(y))
    in_errors = np.where(has_error, size / np.where(has_error, error, 1.0), -1.0)
    places = int(np.argmax(in_errors if np.any(has_error) else size)), int(np.argmax(size))
    first, second = (_Deviation(float(y[k]), float(error[k]), int(series[k])) for k in places)
    return first, second


def deviations(panel: Sequence[Layer]) -> dict[str, Any]:
    """The numbers of a panel of residuals: how many, and the largest in errors in %; or nothing."""
    points = [layer for layer in panel if isinstance(layer, Points)]
    if not points:
        return {}
    share, error = _largest(points)[0].percent
    number = sum(len(layer.x) for layer in points)
    return {"residuals": number, "largest_residual": share, "largest_residual_error": error}


def deviation_sentence(
    panel: Sequence[Layer], names: Mapping[int, str], repeats: int = FEWEST_TESTED
) -> str:
    """A sentence on the residuals of a panel; empty without any.

    names : of series
    repeats : of a point at least; few do not count errors, as in findings
    """
    points = [layer for layer in panel if isinstance(layer, Points)]
    if not points:
        return ""
    number, several = sum(len(layer.x) for layer in points), len({layer.series for layer in points})
    shown = names if several > 1 else {}
    values = [_described(deviation, shown, repeats) for deviation in _largest(points)]
    if number == 1:
        return f"The deviation from theory is {values[0]}."
    text = f"Of {number} deviations from theory, the most significant is {values[0]}"
    return f"{text}." if values[0] == values[1] else f"{text}, and the largest {values[1]}."


def _described(deviation: _Deviation, names: Mapping[int, str], repeats: int) -> str:
    """A deviation in %, or as a factor, and in errors; and which series it is of."""
    share, error = deviation.percent
    value = with_error(share, error, "%")
    if not 1 / FACTOR < 1 + share / 100 < FACTOR:
        value = f"a factor of {with_error(1 + share / 100, error / 100)}"
    about = []
    if deviation.error > 0 and repeats < FEWEST_TESTED:
        about.append(TOO_FEW)
    elif deviation.error > 0:
        of_logarithm = f"{abs(deviation.residual / deviation.error):.1f} errors"
        same = of_logarithm == f"{abs(share / error):.1f} errors"
        about.append(of_logarithm if same else f"{of_logarithm} of its logarithm")
    about += [names[deviation.series]] if deviation.series in names else []
    return value + f" ({', '.join(about)})" * bool(about)
