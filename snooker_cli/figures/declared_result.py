"""What a figure has as its result, and the sentence of its caption on it."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from snooker_cli.analysis.quantities import QUANTITIES, Quantity
from snooker_cli.formatting import short, with_error

UNITS = {"1/s": "s⁻¹", "Pa m": "Pa·m", "J/s": "W", "J/(m s)": "J m⁻¹ s⁻¹"}
"""The units of tables as axes and captions print them, where they differ."""

ROUNDING = 1e-12  # an error that is this share of its value, or less, is that of rounding


def with_units_of_axes(text: str) -> str:
    """A sentence of an analysis with the units of axes: ``s⁻¹`` instead of ``1/s``."""
    units = "|".join(map(re.escape, UNITS))
    return re.sub(rf"(?<=[\d)⁰¹²³⁴⁵⁶⁷⁸⁹] )({units})(?!\w)", lambda found: UNITS[found[0]], text)


class Result(NamedTuple):
    """The result of a figure, as registry.yaml declares it.

    quantity : its name in ``QUANTITIES``
    number : the number of the figure that is its mean, or else that of each point; the standard
        error has this name and ``_error``
    when : the part of the repeats that it is from: ``in the second half``
    theory : the number beside it that is its prediction, if there is one
    """

    quantity: str
    number: str
    when: str = ""
    theory: str = ""

    @property
    def of(self) -> Quantity:
        """The quantity."""
        return QUANTITIES[self.quantity]

    @property
    def unit(self) -> str:
        """The unit after a value; empty for a ratio."""
        return UNITS.get(self.of.unit_text, self.of.unit_text)

    @property
    def name(self) -> str:
        """The quantity at the beginning of a sentence: ``Temperature T``, ``PV/NT``."""
        words, symbol = self.of.words, self.of.symbol
        if words == symbol:
            return symbol
        begun = f"{words[0].upper()}{words[1:]}"
        return begun if symbol in words.split() else f"{begun} {symbol}"

    def as_json(self) -> dict[str, str]:
        """The quantity, its unit, and the names of its number and of its prediction."""
        names = {"number": self.number, "theory": self.theory}
        return {"quantity": self.quantity, "unit": self.unit, **names}

    def sentence(self, rows: Sequence[Mapping[str, Any]], places: Sequence[str]) -> str:
        """The result of one row, or the least and the largest of several; empty if none has one.

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
        if low == high:
            number = len(known)
            return (
                f"{name} is {low} at {f'all {number}' if number == len(rows) else number} points."
            )
        missing = len(rows) - len(known)
        without = f"; {missing} of {len(rows)} points have none" if missing else ""
        return f"{name} is between {low} ({least[1]}) and {high} ({most[1]}){without}."

    @property
    def _unit(self) -> str:
        return f" {self.unit}" if self.unit else ""

    def _mean(self, row: Mapping[str, Any]) -> float:
        value = row.get(self.number)
        return math.nan if value is None else float(value)

    def _value(self, row: Mapping[str, Any]) -> str:
        mean, error = self._mean(row), row.get(f"{self.number}_error")
        sure = error is None or not error > ROUNDING * abs(mean)
        return with_error(mean, None if sure else error, self.unit)
