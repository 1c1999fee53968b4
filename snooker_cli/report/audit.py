"""Every number the report prints beside ours for the scene as stated, with what explains it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from snooker_cli import theory
from snooker_cli.report.reproduction import Claim, Stated, as_stated, claims
from snooker_cli.report.setting_search import (
    LIKELY,
    Candidate,
    Search,
    free_factor,
    pressures,
    profile,
    search,
    simplest,
)
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    PUBLISHED,
    OurValue,
    SourceValue,
    published,
)
from snooker_cli.runs import open_run

RUNS = ("decay", "temperature", "radius", "dilute", "speeds", "restitution", "audit")
"""The runs the audit is made from."""

REPRODUCED = "reproduced"
FOLLOWS = "from its own numbers"
EXPLAINED = "explained"
ALONE = "explained by itself only"
UNEXPLAINED = "not explained"


@dataclass(frozen=True)
class AuditRow:
    """A printed number and what becomes of it.

    ours : for the scene as stated
    common : in the one setting that explains all numbers best; ``None`` if it has no part in it
    alone : what explains this number best by itself, in words and as a value
    """

    number: SourceValue
    ours: OurValue
    common: OurValue | None
    alone: str
    value: OurValue | None
    verdict: str


@dataclass(frozen=True)
class Audit:
    """The whole audit.

    profile : the best setting of all, and the best for each value of each part of a setting
    search : what was searched; near : how many candidates score below ``LIKELY``
    free : the slip in time if it is left free
    repeats : at each CoR behind ours as stated; early : those of them that ended early
    """

    rows: tuple[AuditRow, ...]
    claims: tuple[Claim, ...]
    profile: tuple[Candidate, ...]
    search: Search
    near: int
    free: OurValue
    repeats: int
    early: int

    @property
    def finding(self) -> Candidate:
        """The setting that explains the measured numbers best."""
        return self.profile[0]

    def row(self, name: str) -> AuditRow:
        """The row of a printed number."""
        return next(row for row in self.rows if row.number.name == name)


def audit(folder: Path) -> Audit:
    """Measure, search, and judge every printed number, from the runs in a folder.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read.
    """
    runs = {name: open_run(folder / name) for name in RUNS}
    stated = as_stated(runs)
    run = runs["audit"]
    speed = float(getattr(run.experiment.balls, "speed", math.nan))
    found = search(run, pressures(runs["temperature"], speed))
    reasons = _reasons(stated, found.factor)
    return Audit(
        rows=tuple(_row(number, stated, found, reasons) for number in PUBLISHED),
        claims=claims(runs, stated),
        profile=tuple(profile(found.ranked)),
        search=found,
        near=sum(one.score < LIKELY for one in found.ranked),
        free=free_factor(found.ranked[0], found.factor),
        repeats=runs["restitution"].experiment.repeats,
        early=sum(laws["kinetic_energy", "exponential"].short for laws in stated.laws.values()),
    )


def _row(
    number: SourceValue, stated: Stated, found: Search, reasons: Mapping[str, tuple[str, OurValue]]
) -> AuditRow:
    """The verdict on a number: the scene as stated first, then its own numbers, then settings."""
    ours, common = stated.numbers[number.name], found.ranked[0].beside(number)
    if ours.agrees(number):
        return AuditRow(number, ours, common, "", None, REPRODUCED)
    if number.name in reasons:
        words, value = reasons[number.name]
        verdict = FOLLOWS if number.name in _own() else EXPLAINED
        return AuditRow(
            number, ours, common, words, value, verdict if value.rounds_to(number) else UNEXPLAINED
        )
    # Our own rings have been judged already, by more repeats.
    others = [
        one for one in found.candidates if one.setting.changes or one.setting.extent != found.extent
    ]
    offer = simplest(others, number)
    if offer is None:
        return AuditRow(number, ours, common, "", None, UNEXPLAINED)
    setting, value = offer[0].setting, offer[1]
    if not value.agrees(number):
        verdict = UNEXPLAINED
    elif not setting.changes:
        verdict = REPRODUCED  # the report leaves open where the balls start
    else:
        verdict = EXPLAINED if common is not None and common.agrees(number) else ALONE
    return AuditRow(number, ours, common, setting.words(), value, verdict)


def _own() -> dict[str, tuple[str, OurValue]]:
    """Printed numbers that follow from other printed numbers, with the arithmetic."""
    path = published("mean_free_path")
    mean, abstract = published("energy_mean_0.8"), published("energy_abstract_0.8")
    found = {abstract.name: (f"{mean.digits} of {mean.where}, rounded", OurValue(mean.value))}
    for cor in COEFFICIENTS:
        speed, pressure = published(f"speed_{cor}"), published(f"pressure_mean_{cor}")
        tau = path.value / speed.value
        constant = -2 * math.log(cor) / tau
        found |= {
            f"tau_{cor}": (f"{path.digits}/{speed.digits} = {tau:.3f}", OurValue(tau)),
            f"theory_{cor}": (
                f"−2 ln {cor:g} × {speed.digits}/{path.digits} = {constant:.4f}",
                OurValue(constant),
            ),
            f"doubled_{cor}": (
                f"2 × {pressure.digits} = {2 * pressure.value:g}",
                OurValue(2 * pressure.value),
            ),
        }
    return found


def _reasons(stated: Stated, factor: float) -> dict[str, tuple[str, OurValue]]:
    """What explains the numbers that come from a formula, not from a simulation."""
    density, radius = stated.numbers["density"].value, float(stated.scene.radii[0])
    path = theory.boltzmann_mean_free_path(density, radius)
    implied = 1 / (math.sqrt(2) * density * published("mean_free_path").value)
    return _own() | {
        "mean_free_path": (
            f"{factor:g} × 1/(√2 n 4r) at r = {radius:g} m, or that of r = {radius / factor:g} m",
            OurValue(factor * path),
        ),
        "cross_section": (
            f"what its λ needs, which is 4r at r = {implied / 4:.4f} m",
            OurValue(implied),
        ),
    }
