"""The result that registry.yaml declares for a figure, and the sentences of the caption on it."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.analysis.goodness import FEWEST_TESTED, MOST_ERRORS, TOO_FEW
from snooker_cli.analysis.quantities import QUANTITIES, Quantity
from snooker_cli.figures.figure_data import Layer, Points
from snooker_cli.formatting import listed, percent, short, with_error

UNITS = {"1/s": "s⁻¹", "Pa m": "Pa·m", "J/(m s)": "J m⁻¹ s⁻¹"}
"""The units of tables as axes and captions print them, where they differ."""

FEW = 3  # points whose results a caption lists; of more it has the least and the largest
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

    def sentence(
        self, rows: Sequence[Mapping[str, Any]], places: Sequence[str], repeats: int
    ) -> str:
        """The result of one row, or the least and the largest of several; empty without any.

        rows : the numbers of the figure, or those of each point
        places : the points in words
        repeats : of a point at least
        """
        pairs = zip(rows, places, strict=True)
        known = [(row, place) for row, place in pairs if math.isfinite(self._mean(row))]
        if not known:
            return ""
        least, most = (end(known, key=lambda pair: self._mean(pair[0])) for end in (min, max))
        low, high = (self._value(row) for row, _ in (least, most))
        name = f"{self.name} {self.when}".rstrip()
        if len(rows) == 1:
            return f"{name} = {low}{self._beside_theory(rows[0], repeats)}."
        missing = len(rows) - len(known)
        without = f"; {missing} of {len(rows)} points have no such value" if missing else ""
        if len(known) == 1:
            return f"{name} is {low} ({least[1]}){without}."
        if low == high:
            number = len(known)
            return (
                f"{name} is {low} at {f'all {number}' if number == len(rows) else number} points."
            )
        if len(rows) == len(known) <= FEW:
            each = listed([f"{self._value(row)} ({place})" for row, place in known])
            return f"{name} is {each}."
        return f"{name} is between {low} ({least[1]}) and {high} ({most[1]}){without}."

    def _beside_theory(self, row: Mapping[str, Any], repeats: int) -> str:
        """The theory of a row, and how many standard errors the result is from it, in brackets."""
        theory, error = row.get(self.theory), row.get(f"{self.number}_error") or 0.0
        if theory is None:
            return ""
        unit = f" {self.unit}" if self.unit else ""
        apart = ""
        if error > 0 and repeats >= FEWEST_TESTED:
            apart = f", {abs(self._mean(row) - theory) / error:.1f} errors away"
        return f" (theory: {short(theory, 4)}{unit}{apart})"

    def residual(self, row: Mapping[str, Any]) -> Points | None:
        """ln(result/theory) of a row with its standard error; ``None`` without both."""
        mean, theory = self._mean(row), row.get(self.theory)
        error = row.get(f"{self.number}_error")
        if theory is None or error is None or not mean / theory > 0:
            return None
        x, y, bar = np.zeros(1), np.log([mean / theory]), np.array([error / abs(mean)])
        return Points(x, y, bar)

    def _mean(self, row: Mapping[str, Any]) -> float:
        value = row.get(self.number)
        return math.nan if value is None else float(value)

    def _value(self, row: Mapping[str, Any]) -> str:
        mean, error = self._mean(row), row.get(f"{self.number}_error")
        if error is not None and math.isnan(error):  # of one repeat
            return f"{short(mean)} {self.unit}".rstrip()
        exact = error is None or not error > ROUNDING * abs(mean)
        return with_error(mean, None if exact else error, self.unit)


class Deviation(NamedTuple):
    """ln(result/theory), its standard error, the series, and the place on the x axis."""

    residual: float
    error: float
    series: int
    x: float

    @property
    def percent(self) -> tuple[float, float]:
        """Result over theory minus 1 and its error, in %."""
        with np.errstate(over="ignore"):
            share, factor = float(np.expm1(self.residual)), float(np.exp(self.residual))
        return 100 * share, 100 * factor * self.error

    @property
    def in_errors(self) -> float:
        """The share over its error; 0 without one."""
        share, error = self.percent
        return abs(share) / error if error > 0 else 0.0


def _deviations(panel: Sequence[Layer]) -> list[Deviation]:
    """The residuals of a panel; an error is nan without one."""
    return [
        Deviation(y, error, layer.series, x)
        for layer in panel
        if isinstance(layer, Points) and layer.y_error is not None
        for x, y, error in np.column_stack([layer.x, layer.y, layer.y_error]).tolist()
        if math.isfinite(y)
    ]


def _largest(found: Sequence[Deviation]) -> tuple[Deviation, Deviation]:
    """The residual that is largest in errors, and the one that is largest by itself.

    Without errors both are the second.
    """
    largest = max(found, key=_size)
    first = max(found, key=lambda deviation: deviation.in_errors)
    return first if first.in_errors else largest, largest


def deviations(panel: Sequence[Layer]) -> dict[str, Any]:
    """The numbers of a panel of residuals: how many, and the largest in errors in %; or nothing."""
    found = _deviations(panel)
    if not found:
        return {}
    share, error = _largest(found)[0].percent
    return {"residuals": len(found), "largest_residual": share, "largest_residual_error": error}


def deviation_sentence(
    panel: Sequence[Layer],
    names: Mapping[int, str],
    axis: str = "",
    repeats: int = FEWEST_TESTED,
) -> str:
    """A sentence on the residuals of a panel; empty without any.

    names : of series
    axis : the label of the x axis; empty if x has no meaning
    repeats : of a point at least; few do not count errors, as in findings
    """
    found = _deviations(panel)
    if not found:
        return ""
    values = []
    for deviation in _largest(found):
        several = {other.series for other in found} != {deviation.series}
        where = [names.get(deviation.series, "")] * several
        where += [_place(axis, deviation.x)] * (axis != "" and len(found) > 1)
        values.append(_described(deviation, [*filter(None, where)], repeats))
    if len(found) == 1:
        return f"The deviation from theory is {values[0]}."
    text = f"Of {len(found)} deviations from theory, the most significant is {values[0]}"
    return f"{text}." if values[0] == values[1] else f"{text}, and the largest {values[1]}."


def most_significant(panel: Sequence[Layer]) -> Deviation | None:
    """The residual of a panel that is largest in errors; ``None`` without any."""
    found = _deviations(panel)
    return _largest(found)[0] if found else None


def largest_beyond_errors(panel: Sequence[Layer]) -> Deviation | None:
    """The largest residual of those that are more than ``MOST_ERRORS`` from zero, if any."""
    return max(_beyond_errors(_deviations(panel)), key=_size, default=None)


def _beyond_errors(found: Sequence[Deviation]) -> list[Deviation]:
    return [deviation for deviation in found if deviation.in_errors > MOST_ERRORS]


def _size(deviation: Deviation) -> float:
    return abs(deviation.residual)


def agreement(panel: Sequence[Layer], repeats: int, *, whose: str = "", law: str = "theory") -> str:
    """Whether results agree with theory, for a title: ``D agrees with theory (3.3 ± 8.4 %)``.

    panel : with the residuals
    repeats : of a point at least
    whose : the symbol of the result, if the words need one
    law : what the theory is called

    Empty without a test. The largest deviation by more than ``MOST_ERRORS`` counts; without one,
    the share within which all results agree.
    """
    found = [deviation for deviation in _deviations(panel) if deviation.error > 0]
    if not found or repeats < FEWEST_TESTED:
        return ""
    beyond = _beyond_errors(found)
    largest = max(beyond or found, key=_size)
    share, error = largest.percent
    ratio, side, alone = 1 + share / 100, "above" if share > 0 else "below", len(found) == 1
    it, it_is = (f"{whose} ", f"{whose} is ") if whose else ("", "")
    if beyond and not 1 / FACTOR < ratio < FACTOR:
        up_to = ("up to " if ratio > 1 else "down to ") * (not alone)
        return f"{it_is}{up_to}{short(ratio, 2)} times {law}"
    if alone and beyond:
        return f"{it_is}{with_error(abs(share), error, '%')} {side} {law}"
    if alone:
        return f"{it}agrees with {law} ({with_error(share, error, '%')})"
    size = percent(abs(share) / 100)
    if not beyond:
        return f"{it}agrees with {law} within {size}"
    if len({deviation.residual > 0 for deviation in beyond}) > 1:
        return f"{it}differs from {law} by up to {size}"
    if any(abs(other.residual) > abs(largest.residual) for other in found):
        return f"{it_is}{size} {side} {law} at {len(beyond)} of {len(found)} places"
    return f"{it_is}up to {size} {side} {law}"


def _place(axis: str, x: float) -> str:
    """A place on an axis in words: ``ball radius 0.2 m``."""
    name, _, unit = axis.partition(" (")
    return f"{name} {short(x)} {unit.removesuffix(')')}".rstrip()


def _described(deviation: Deviation, where: Sequence[str], repeats: int) -> str:
    """A deviation in %, or as a factor, and in errors; and where it is."""
    share, error = deviation.percent
    value = with_error(share, error, "%")
    if not 1 / FACTOR < 1 + share / 100 < FACTOR:
        value = f"a factor of {with_error(1 + share / 100, error / 100)}"
    about = []
    if deviation.error > 0 and repeats < FEWEST_TESTED:
        about.append(TOO_FEW)
    elif deviation.error > 0:
        about.append(f"{deviation.in_errors:.1f} errors")
    about += where
    return value + f" ({', '.join(about)})" * bool(about)
