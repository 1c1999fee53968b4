"""The numbers and sentences of the source report, from source_values.yaml.

Source report: "Effect of Coefficient of Restitution on Thermodynamic Properties - a 2D Simulation".
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml

from snooker_cli.analysis.observables import ROUNDING
from snooker_cli.formatting import listed, with_error
from snooker_cli.report.document import packaged

LORD = 0.507  # 95 % half width of the mean of five normal values, over their range (Lord 1947)

COEFFICIENTS = (0.8, 0.9)
"""The coefficients of restitution below 1 that the source report prints numbers for."""

CLOSE = 0.05  # the source report calls values within 5 % equal

AGREES = 2.0
"""The largest difference from a printed number that agrees with it, in its uncertainties."""


@dataclass(frozen=True)
class SourceValue:
    """A printed number; source_values.yaml explains the fields."""

    name: str
    where: str
    what: str
    quantity: str
    printed: str
    unit: str
    cor: float | None = None
    mean: bool = False
    exact: bool = False
    radius: float | None = None
    follows: str = ""
    repeats: str = ""

    @property
    def digits(self) -> str:
        """The value as printed."""
        return self.printed.removeprefix("≈ ").partition(" ± ")[0]

    @property
    def value(self) -> float:
        """The value in its unit."""
        return float(self.digits)

    @property
    def error(self) -> float | None:
        """The number after the ±; ``None`` without one."""
        error = self.printed.partition(" ± ")[2]
        return float(error) if error else None

    @property
    def decimals(self) -> int:
        """Number of printed decimals."""
        return len(self.digits.partition(".")[2])

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed digit; rounding for an exact number."""
        return ROUNDING * abs(self.value) if self.exact else 0.5 * 10.0**-self.decimals

    @property
    def standard_error(self) -> float:
        """Half of the 95 % interval for a mean of five runs, otherwise the printed error."""
        if self.error is None:
            return 0.0
        # The printed ± is read as half of the range, and the interval is twice its half width.
        return LORD * self.error if self.mean else self.error


@dataclass(frozen=True)
class OurValue:
    """Our value of a printed number, in its unit.

    error : standard error; for a number from one run, standard deviation of single runs
    allowed : distance from a printed limit that theory predicts at the simulated radius
    """

    value: float
    error: float = 0.0
    allowed: float = 0.0

    def uncertainty(self, number: SourceValue) -> float:
        """Uncertainty of the difference: half of the interval of digits, plus standard errors."""
        interval = (number.half_digit + self.allowed) / 2
        return interval + math.hypot(number.standard_error, self.error)

    def distance(self, number: SourceValue) -> float:
        """Difference in units of its uncertainty."""
        return abs(self.value - number.value) / self.uncertainty(number)

    def agrees(self, number: SourceValue) -> bool:
        """Whether the difference is at most ``AGREES`` times its uncertainty."""
        return self.distance(number) <= AGREES

    def rounds_to(self, number: SourceValue) -> bool:
        """Whether the value rounds to the printed digits; exact halves round either way."""
        return abs(self.value - number.value) <= (1 + ROUNDING) * number.half_digit


class Sample:
    """A quantity over the repeats of a point; two or more repeats must count.

    values : (*n*,) by repeat; nan for a repeat that does not count, because it ended early
    count : number of repeats that count
    value : mean over these, nan for fewer than two
    deviation, error : standard deviation of one, standard error of the mean
    """

    def __init__(self, values: Iterable[float]) -> None:
        self.values = values if isinstance(values, np.ndarray) else np.array(list(values))
        known = self.values[np.isfinite(self.values)]
        self.count = len(known)
        self.value = self.deviation = self.error = math.nan
        if self.count > 1:
            self.value, self.deviation = float(known.mean()), float(known.std(ddof=1))
            self.error = self.deviation / math.sqrt(self.count)

    def our_value(self, number: SourceValue) -> OurValue:
        """The mean, with the standard error for a printed mean and the deviation for one run."""
        return OurValue(self.value, self.error if number.mean else self.deviation)


def value_text(known: Any) -> str:
    """An object's ``value`` with its ``error``; empty for none."""
    return "" if known is None else with_error(known.value, known.error)


def at_each_coefficient(texts: Sequence[str]) -> str:
    """``a at CoR 0.8 and b at CoR 0.9``."""
    return listed([f"{text} at CoR {cor:g}" for text, cor in zip(texts, COEFFICIENTS, strict=True)])


_DATA: dict[str, Any] = yaml.safe_load(packaged("source_values.yaml"))
TITLE: str = _DATA["title"]
SOURCE_VALUES = {name: SourceValue(name, **fields) for name, fields in _DATA["values"].items()}
CLAIMS: dict[str, dict[str, Any]] = _DATA["claims"]
"""The sentences that can be checked, by name; source_values.yaml explains their keys."""
TARGETS = [SOURCE_VALUES[name] for name in _DATA["targets"]]
"""The measured numbers that an explanation has to give together."""
EXPLANATIONS: list[dict[str, bool]] = _DATA["explanations"]
"""The settings with an explanation of their own; those of one change first."""
