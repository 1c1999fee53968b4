"""The numbers that the source report prints, as it prints them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from snooker_cli.analysis.observables import ROUNDING

Property = Literal[
    "central distance",
    "pair distance",
    "momentum x",
    "momentum y",
    "energy decay",
    "temperature decay",
    "pressure decay",
    "pressure decay, doubled",
    "pressure",
    "density",
    "cross-section",
    "mean free path",
    "mean speed",
    "tau",
    "theory",
    "temperature ratio",
    "pressure ratio",
]
"""What a printed number is of."""

LORD = 0.507
"""The mean of five normal values is within this share of their (largest - smallest) of the true
mean in 95 % of cases (Lord 1947): within 1.014 times what the report prints behind its ±."""

COEFFICIENTS = (0.8, 0.9)
"""The coefficients of restitution below 1 that the report prints numbers for."""

CLOSE = 0.05
"""What the report calls agreement: "within 5 %"."""


@dataclass(frozen=True)
class SourceValue:
    """A printed number.

    where : section or figure
    digits, uncertainty : as printed; ``uncertainty`` is what stands behind the ±
    cor : the CoR that it belongs to, if it belongs to one
    mean : whether it is a mean over five runs, so that ± is (largest - smallest)/2 of them
    radius : of the balls that it is for, m; ``None`` for the report's scene
    exact : whether it is meant to the last digit of a double: a bound, a conserved quantity, a
        limit; its digits do not say so
    about : whether the report calls it approximate
    """

    name: str
    where: str
    what: str
    of: Property
    digits: str
    uncertainty: str | None = None
    unit: str = "1/s"
    cor: float | None = None
    mean: bool = False
    radius: float | None = None
    exact: bool = False
    about: bool = False

    @property
    def value(self) -> float:
        """The number."""
        return float(self.digits)

    @property
    def error(self) -> float | None:
        """What is printed behind the ±."""
        return None if self.uncertainty is None else float(self.uncertainty)

    @property
    def decimals(self) -> int:
        """How many are printed."""
        return len(self.digits.partition(".")[2])

    @property
    def half_digit(self) -> float:
        """Half a unit of the last digit printed; of an exact number, rounding."""
        if self.exact:
            return ROUNDING * abs(self.value)
        return 0.5 * 10.0**-self.decimals

    @property
    def standard_error(self) -> float:
        """Half of the 95 % interval of a mean of five, from its half range; else as printed."""
        if self.error is None:
            return 0.0
        return LORD * self.error if self.mean else self.error

    @property
    def printed(self) -> str:
        """Value and uncertainty as the report writes them."""
        error = "" if self.uncertainty is None else f" ± {self.uncertainty}"
        return ("≈ " if self.about else "") + self.digits + error

    @property
    def with_unit(self) -> str:
        """Value, uncertainty and unit."""
        return self.printed if self.unit == "1" else f"{self.printed} {self.unit}"


def _pair(
    name: str,
    where: tuple[str, str],
    what: str,
    of: Property,
    printed: tuple[tuple[str, str], tuple[str, str]],
    *,
    unit: str = "1/s",
    mean: bool = False,
) -> tuple[SourceValue, SourceValue]:
    """A number that the report prints for CoR 0.8 and for 0.9."""
    first, second = (
        SourceValue(
            f"{name}_{cor}", place, f"{what}, CoR {cor:g}", of, *digits, unit, cor=cor, mean=mean
        )
        for cor, place, digits in zip(COEFFICIENTS, where, printed, strict=True)
    )
    return first, second


def _dilute(name: str, where: str, radius: float) -> SourceValue:
    """Figure 17's ratio at CoR 1; the text and the caption have balls of different radii."""
    what = f"P(simulated)/P(ideal), CoR 1, r = {radius:g} m"
    return SourceValue(
        name, where, what, "pressure ratio", "1", unit="1", radius=radius, exact=True
    )


PUBLISHED = (
    SourceValue(
        "energy_abstract_0.8",
        "abstract",
        "k of energy and temperature, CoR 0.8",
        "energy decay",
        "0.12",
        "0.01",
        cor=0.8,
        mean=True,
    ),
    SourceValue(
        "pressure_abstract_0.9",
        "abstract",
        "k of pressure, CoR 0.9",
        "pressure decay",
        "0.035",
        "0.014",
        cor=0.9,
        mean=True,
    ),
    SourceValue(
        "largest_distance",
        "fig. 1",
        "largest distance from the centre",
        "central distance",
        "9",
        unit="m",
        exact=True,
    ),
    SourceValue(
        "smallest_distance",
        "fig. 2",
        "smallest distance of two balls",
        "pair distance",
        "2",
        unit="m",
        exact=True,
    ),
    SourceValue(
        "momentum_x",
        "III A, fig. 4",
        "momentum over its start, x",
        "momentum x",
        "1",
        unit="1",
        exact=True,
    ),
    SourceValue(
        "momentum_y",
        "III A, fig. 5",
        "momentum over its start, y",
        "momentum y",
        "1",
        unit="1",
        exact=True,
    ),
    *_pair(
        "energy_one",
        ("III A, fig. 6", "III A, fig. 7"),
        "k of energy, one run",
        "energy decay",
        (("0.116", "0.001"), ("0.0775", "0.0006")),
    ),
    *_pair(
        "energy_mean",
        ("III A", "abstract, III A"),
        "k of energy, mean of five",
        "energy decay",
        (("0.117", "0.01"), ("0.077", "0.012")),
        mean=True,
    ),
    *_pair(
        "temperature_one",
        ("fig. 8", "fig. 9"),
        "k of temperature, one run",
        "temperature decay",
        (("0.116", "0.001"), ("0.0775", "0.0006")),
    ),
    SourceValue(
        "cross_section", "III A", "cross-section σ of 2πr", "cross-section", "0.401", unit="m"
    ),
    SourceValue("density", "III A", "number density n", "density", "0.118", unit="1/m²"),
    SourceValue(
        "mean_free_path", "III A", "mean free path λ", "mean free path", "15.010", unit="m"
    ),
    *_pair(
        "speed",
        ("III A", "III A"),
        "⟨v⟩ over 500 collisions",
        "mean speed",
        (("4.23", "0.37"), ("5.43", "0.42")),
        unit="m/s",
        mean=True,
    ),
    *_pair(
        "tau",
        ("III A", "III A"),
        "characteristic time τ",
        "tau",
        (("3.55", "0.65"), ("2.76", "0.89")),
        unit="s",
        mean=True,
    ),
    *_pair(
        "theory",
        ("III A", "III A"),
        "k by the report's theory",
        "theory",
        (("0.126", "0.005"), ("0.076", "0.011")),
        mean=True,
    ),
    SourceValue(
        "pressure", "III B, fig. 10", "pressure at CoR 1", "pressure", "17", unit="Pa m", about=True
    ),
    *_pair(
        "pressure_one",
        ("fig. 11", "fig. 12"),
        "k of pressure, one run",
        "pressure decay",
        (("0.0555", "0.0004"), ("0.0346", "0.0003")),
    ),
    *_pair(
        "pressure_mean",
        ("abstract, III B", "III B"),
        "k of pressure, mean of five",
        "pressure decay",
        (("0.056", "0.013"), ("0.036", "0.014")),
        mean=True,
    ),
    *_pair(
        "doubled",
        ("III B", "III B"),
        "twice the k of pressure",
        "pressure decay, doubled",
        (("0.112", "0.026"), ("0.072", "0.028")),
        mean=True,
    ),
    SourceValue(
        "equipartition",
        "fig. 16",
        "T(equipartition)/T(ideal gas), r → 0",
        "temperature ratio",
        "1",
        unit="1",
        exact=True,
    ),
    _dilute("ratio_text", "III C", 0.001),
    _dilute("ratio_caption", "fig. 17", 0.01),
)
"""Every result the report prints; settings such as 37 balls and 500 collisions are in configs."""


@dataclass(frozen=True)
class OurValue:
    """A value beside a printed number, in its unit.

    error : standard error, or of a number from a single run the spread of single runs
    allowed : how far from a printed limit theory is at the radius that was run
    """

    value: float
    error: float = 0.0
    allowed: float = 0.0

    def uncertainty(self, number: SourceValue) -> float:
        """Of the difference: half of the half digit plus both standard errors."""
        interval = (number.half_digit + self.allowed) / 2
        return interval + math.hypot(number.standard_error, self.error)

    def distance(self, number: SourceValue) -> float:
        """Difference in uncertainties."""
        return abs(self.value - number.value) / self.uncertainty(number)

    def agrees(self, number: SourceValue) -> bool:
        """Whether it is the printed value: within its last digit and twice the standard errors."""
        return self.distance(number) <= 2

    def rounds_to(self, number: SourceValue) -> bool:
        """Whether it has the printed digits; ``1 + ROUNDING`` lets halves pass either way."""
        return abs(self.value - number.value) <= (1 + ROUNDING) * number.half_digit


def published(name: str) -> SourceValue:
    """A printed number by its name."""
    return next(one for one in PUBLISHED if one.name == name)
