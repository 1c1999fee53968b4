"""The numbers and sentences of the source report, from source_values.yaml.

Source report: "Effect of Coefficient of Restitution on Thermodynamic Properties - a 2D Simulation".
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import yaml

from snooker_cli.report.document import packaged

text_of_file = partial(packaged, package="snooker_cli.reproduction")
"""The text of a file beside this one."""

LORD = 0.507  # 95 % half width of the mean of five normal values, over their range (Lord 1947)

COEFFICIENTS = (0.8, 0.9)
"""The coefficients of restitution below 1 that the source report prints numbers for."""

ROUNDING = 1e-12  # relative difference that is nothing but rounding

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
    def half_digit(self) -> float:
        """Half a unit of the last printed digit; rounding for an exact number."""
        decimals = len(self.digits.partition(".")[2])
        return ROUNDING * abs(self.value) if self.exact else 0.5 * 10.0**-decimals

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

    def agrees(self, number: SourceValue) -> bool:
        """Whether the difference is within half a digit and ``AGREES`` standard errors."""
        errors = AGREES * math.hypot(number.standard_error, self.error)
        return abs(self.value - number.value) <= number.half_digit + self.allowed + errors

    def rounds_to(self, number: SourceValue) -> bool:
        """Whether the value rounds to the printed digits; exact halves round either way."""
        return abs(self.value - number.value) <= (1 + ROUNDING) * number.half_digit


_DATA: dict[str, Any] = yaml.safe_load(text_of_file("source_values.yaml"))
TITLE: str = _DATA["title"]
SOURCE_VALUES = {name: SourceValue(name, **fields) for name, fields in _DATA["values"].items()}
STATEMENTS: dict[str, dict[str, Any]] = _DATA["statements"]
"""The sentences that can be checked, by name; source_values.yaml explains their keys."""
TARGETS = [SOURCE_VALUES[name] for name in _DATA["targets"]]
"""The measured numbers that an explanation has to give together."""
