"""The audit: every printed number next to ours for the stated scene, with its explanation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from snooker_cli import theory
from snooker_cli.report.reproduction import (
    CheckedClaim,
    StatedResults,
    checked_claims,
    stated_results,
)
from snooker_cli.report.setting_search import (
    LIKELY,
    Candidate,
    Search,
    elastic_pressures,
    free_factor,
    profile,
    search,
    simplest,
)
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    SOURCE_VALUES,
    OurValue,
    SourceValue,
    source_value,
)
from snooker_cli.runs import open_run

RUNS = ("decay", "temperature", "radius", "dilute", "speeds", "restitution", "audit")
"""The runs that the audit needs."""

# Verdicts
REPRODUCED = "reproduced"
FOLLOWS = "from its own numbers"
EXPLAINED = "explained"
ALONE = "explained by itself only"
UNEXPLAINED = "not explained"


@dataclass(frozen=True)
class AuditRow:
    """A printed number and the verdict on it.

    ours : our value for the stated scene
    common : our value for the best setting of all; ``None`` if it gives none
    explanation, explained : the best explanation of this number alone, in words and as a value
    """

    number: SourceValue
    ours: OurValue
    common: OurValue | None
    explanation: str
    explained: OurValue | None
    verdict: str


@dataclass(frozen=True)
class Audit:
    """The whole audit.

    profile : the best setting of all, then the best for each value of each part of a setting
    near : number of ranked candidates with a score below ``LIKELY``
    free : the best factor of the slip in time
    repeats : at each CoR behind our values; early : how many of them ended early
    """

    rows: tuple[AuditRow, ...]
    claims: tuple[CheckedClaim, ...]
    profile: tuple[Candidate, ...]
    search: Search
    near: int
    free: OurValue
    repeats: int
    early: int

    @property
    def best(self) -> Candidate:
        """The setting that explains the measured numbers best."""
        return self.profile[0]

    def row(self, name: str) -> AuditRow:
        """The row of a printed number."""
        return next(row for row in self.rows if row.number.name == name)


def audit(folder: Path) -> Audit:
    """The audit from the runs in a folder.

    Raises ``RunError`` or ``StoreError`` for a run that is missing or cannot be read.
    """
    runs = {name: open_run(folder / name) for name in RUNS}
    stated = stated_results(runs)
    run = runs["audit"]
    speed = float(getattr(run.experiment.balls, "speed", math.nan))
    found = search(run, elastic_pressures(runs["temperature"], speed))
    formulas = {**arithmetic(), **_path_and_section(stated, found.factor)}
    return Audit(
        rows=tuple(_row(number, stated, found, formulas) for number in SOURCE_VALUES),
        claims=checked_claims(runs, stated),
        profile=tuple(profile(found.ranked)),
        search=found,
        near=sum(one.score < LIKELY for one in found.ranked),
        free=free_factor(found.ranked[0], found.factor),
        repeats=runs["restitution"].experiment.repeats,
        early=sum(laws["kinetic_energy", "exponential"].short for laws in stated.laws.values()),
    )


Formulas = dict[str, tuple[str, OurValue]]
"""By the name of a printed number: a formula for it in words, and its value."""


def _row(number: SourceValue, stated: StatedResults, found: Search, formulas: Formulas) -> AuditRow:
    """The verdict: from the stated scene if that agrees, else from a formula, else a setting."""
    ours, common = stated.numbers[number.name], found.ranked[0].our_value(number)
    if ours.agrees(number):
        return AuditRow(number, ours, common, "", None, REPRODUCED)
    if number.name in formulas:
        text, value = formulas[number.name]
        verdict = FOLLOWS if number.name in arithmetic() else EXPLAINED
        if not value.rounds_to(number):
            verdict = UNEXPLAINED
        return AuditRow(number, ours, common, text, value, verdict)
    # The stated scene with our own rings has been compared already, with more repeats.
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
        verdict = REPRODUCED  # the source report does not state where the balls start
    else:
        verdict = EXPLAINED if common is not None and common.agrees(number) else ALONE
    return AuditRow(number, ours, common, setting.description, value, verdict)


def arithmetic() -> Formulas:
    """Printed numbers that follow from other printed numbers."""
    path = source_value("mean_free_path")
    mean = source_value("energy_mean_0.8")
    found = {
        "energy_abstract_0.8": (f"{mean.digits} of {mean.where}, rounded", OurValue(mean.value))
    }
    for cor in COEFFICIENTS:
        speed, pressure = source_value(f"speed_{cor}"), source_value(f"pressure_mean_{cor}")
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


def _path_and_section(stated: StatedResults, factor: float) -> Formulas:
    """Explanations of the mean free path and the cross-section."""
    density, radius = stated.numbers["density"].value, float(stated.scene.radii[0])
    path = theory.mean_free_path(density, radius)
    implied = 1 / (math.sqrt(2) * density * source_value("mean_free_path").value)
    return {
        "mean_free_path": (
            f"{factor:g} × 1/(√2 n 4r) at r = {radius:g} m, or that of r = {radius / factor:g} m",
            OurValue(factor * path),
        ),
        "cross_section": (
            f"what its λ needs, which is 4r at r = {implied / 4:.4f} m",
            OurValue(implied),
        ),
    }
