"""The audit: every printed number next to ours for the stated scene, with its explanation."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from snooker_cli import theory
from snooker_cli.report import reproduction
from snooker_cli.report.explanations import COMBINATIONS, LIKELY, TARGETS, Explanations
from snooker_cli.report.reproduction import Runs, StatedResults
from snooker_cli.report.source_values import COEFFICIENTS, SOURCE_VALUES, OurValue, SourceValue

# Verdicts
REPRODUCED = "reproduced"
FOLLOWS = "from its own numbers"
FORMULA = "one formula fits"
EXPLAINED = "explained"
UNEXPLAINED = "not explained"


@dataclass(frozen=True)
class AuditRow:
    """A printed number and the verdict on it.

    ours : our value for the stated scene
    common : our value for the best combination of all; ``None`` if it gives none
    explanation, explained : the first that agrees with this number alone, or the nearest: in words,
        and its value
    """

    number: SourceValue
    ours: OurValue
    common: OurValue | None
    verdict: str
    explanation: str = ""
    explained: OurValue | None = None

    def as_json(self) -> dict[str, Any]:
        """The row as JSON."""
        number, found = self.number, asdict(self)
        names = ("value", "error", "half_digit", "standard_error")
        printed = {name: getattr(number, name) for name in names}
        return {
            **{name: getattr(number, name) for name in ("name", "where", "what", "unit")},
            "printed": {"text": number.printed, **printed},
            **{name: found[name] for name in ("ours", "common", "explanation", "explained")},
            "verdict": self.verdict,
        }


@dataclass(frozen=True)
class Audit:
    """The whole audit.

    claims : see ``checked_claims``
    stated : results of the scene as the source report states it
    repeats, complete : behind our values below CoR 1, and how many of them are complete
    """

    rows: tuple[AuditRow, ...]
    claims: list[dict[str, Any]]
    explanations: Explanations
    stated: StatedResults
    repeats: int
    complete: int

    def row(self, name: str) -> AuditRow:
        """The row of a printed number."""
        return next(row for row in self.rows if row.number.name == name)

    def as_json(self) -> dict[str, Any]:
        """All numbers of the audit."""
        found = self.explanations
        return {
            "slip": found.factor,
            "freedom": len(TARGETS),
            "limit": LIKELY,
            "combinations": len(COMBINATIONS),
            "mean_free_path": asdict(self.stated.mean_free_path),
            "complete": self.complete,
            "explanations": [
                {
                    "name": one.name,
                    "score": one.score,
                    "whole": one.whole,
                    "rejected": one.rejected,
                    "values": {
                        number.name: None if ours is None else asdict(ours)
                        for number in TARGETS
                        for ours in [one.our_value(number)]
                    },
                }
                for one in found.named
            ],
            "numbers": [row.as_json() for row in self.rows],
            "claims": self.claims,
        }


def audit(runs: Runs, found: Explanations) -> Audit:
    """The audit from the runs of the reproduction and the explanations from two of them.

    Raises ``RunError`` or ``StoreError`` for a run that cannot be read.
    """
    stated = reproduction.stated_results(runs)
    return Audit(
        rows=tuple(_row(number, stated, found) for number in SOURCE_VALUES.values()),
        claims=reproduction.checked_claims(runs, stated),
        explanations=found,
        stated=stated,
        repeats=len(COEFFICIENTS) * runs["restitution"].experiment.repeats,
        complete=sum(
            len(laws["kinetic_energy", "exponential"].fits) for laws in stated.laws.values()
        ),
    )


def _row(number: SourceValue, stated: StatedResults, found: Explanations) -> AuditRow:
    """The verdict: from the stated scene if that agrees, else a formula, else an explanation."""
    ours, common = stated.numbers[number.name], found.best.our_value(number)
    if ours.agrees(number):
        return AuditRow(number, ours, common, REPRODUCED)
    for formulas, verdict in (
        (reproduction.arithmetic(), FOLLOWS),
        (_path_and_section(stated, found.factor), FORMULA),
    ):
        if number.name in formulas:
            text, value = formulas[number.name]
            verdict = verdict if value.rounds_to(number) else UNEXPLAINED
            return AuditRow(number, ours, common, verdict, text, value)
    offer = found.simplest(number)
    if offer is None:
        return AuditRow(number, ours, common, UNEXPLAINED)
    verdict = EXPLAINED if offer[1].agrees(number) else UNEXPLAINED
    return AuditRow(number, ours, common, verdict, offer[0].name, offer[1])


def _path_and_section(stated: StatedResults, factor: float) -> dict[str, tuple[str, OurValue]]:
    """Formulas for the mean free path and the cross-section, in words, and their values."""
    density, radius = stated.numbers["density"].value, float(stated.scene.radii[0])
    path = theory.mean_free_path(density, radius)
    implied = 1 / (math.sqrt(2) * density * SOURCE_VALUES["mean_free_path"].value)
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
