"""The numbers that the source report prints, as it prints them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """A printed number: where it stands, what it is, its value and uncertainty, its unit.

    half_digit : half a unit of the last digit printed, for a number without an uncertainty
    """

    name: str
    where: str
    what: str
    value: float
    error: float | None = None
    unit: str = "1/s"
    text: str | None = None
    half_digit: float = 0.0

    @property
    def tolerance(self) -> float:
        """How far a value may be from the printed one and still be the same number."""
        return self.half_digit if self.error is None else self.error

    @property
    def printed(self) -> str:
        """The number as the report writes it."""
        if self.text is not None:
            return self.text
        error = "" if self.error is None else f" ± {self.error:g}"
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.value:g}{error}{unit}"


PUBLISHED = (
    Published(
        "largest_distance",
        "fig. 1",
        "largest distance from the centre",
        9.0,
        unit="m",
        half_digit=0.5,
    ),
    Published(
        "smallest_distance",
        "fig. 2",
        "smallest distance of two balls",
        2.0,
        unit="m",
        half_digit=0.5,
    ),
    Published(
        "momentum_x", "fig. 4", "total momentum over its start, x", 1.0, unit="1", half_digit=0.005
    ),
    Published(
        "momentum_y", "fig. 5", "total momentum over its start, y", 1.0, unit="1", half_digit=0.005
    ),
    Published("energy_one_0.8", "figs. 6, 8", "k of energy and T, one run, CoR 0.8", 0.116, 0.001),
    Published(
        "energy_one_0.9", "figs. 7, 9", "k of energy and T, one run, CoR 0.9", 0.0775, 0.0006
    ),
    Published("energy_mean_0.8", "III A", "k of energy, mean of five, CoR 0.8", 0.117, 0.01),
    Published("energy_mean_0.9", "III A", "k of energy, mean of five, CoR 0.9", 0.077, 0.012),
    Published(
        "pressure",
        "fig. 10",
        "pressure at CoR 1",
        17.0,
        unit="Pa m",
        text="≈ 17 Pa m",
        half_digit=0.5,
    ),
    Published("pressure_one_0.8", "fig. 11", "k of pressure, one run, CoR 0.8", 0.0555, 0.0004),
    Published("pressure_one_0.9", "fig. 12", "k of pressure, one run, CoR 0.9", 0.0346, 0.0003),
    Published("pressure_mean_0.8", "III B", "k of pressure, mean of five, CoR 0.8", 0.056, 0.013),
    Published(
        "pressure_mean_0.9",
        "III B",
        "k of pressure, mean of five, CoR 0.9",
        0.036,
        0.014,
        text="0.036 ± 0.014 1/s (abstract: 0.035)",
    ),
    Published("doubled_0.8", "III B", "twice the pressure's k, CoR 0.8", 0.112, 0.026),
    Published("doubled_0.9", "III B", "twice the pressure's k, CoR 0.9", 0.072, 0.028),
    Published("density", "III A", "number density n", 0.118, unit="1/m²", half_digit=0.0005),
    Published(
        "cross_section",
        "III A",
        "cross-section σ (its text: 2πr)",
        0.401,
        unit="m",
        half_digit=0.0005,
    ),
    Published(
        "mean_free_path",
        "III A",
        "mean free path λ",
        15.010,
        unit="m",
        text="15.010 m",
        half_digit=0.0005,
    ),
    Published("speed_0.8", "III A", "mean speed over 500 collisions, CoR 0.8", 4.23, 0.37, "m/s"),
    Published("speed_0.9", "III A", "mean speed over 500 collisions, CoR 0.9", 5.43, 0.42, "m/s"),
    Published("tau_0.8", "III A", "characteristic time τ, CoR 0.8", 3.55, 0.65, "s"),
    Published("tau_0.9", "III A", "characteristic time τ, CoR 0.9", 2.76, 0.89, "s"),
    Published("theory_0.8", "III A", "k by its theory, CoR 0.8", 0.126, 0.005),
    Published("theory_0.9", "III A", "k by its theory, CoR 0.9", 0.076, 0.011),
    Published(
        "equipartition",
        "fig. 16",
        "T(equipartition)/T(ideal gas) as r → 0",
        1.0,
        unit="1",
        half_digit=0.05,
    ),
    Published(
        "dilute",
        "fig. 17",
        "P(simulated)/P(ideal) at CoR 1, tiny balls",
        1.0,
        unit="1",
        half_digit=0.05,
    ),
)
"""Every result the report prints; settings such as 37 balls and 500 collisions are in configs."""


def published(name: str) -> Published:
    """A printed number by its name."""
    return next(one for one in PUBLISHED if one.name == name)
