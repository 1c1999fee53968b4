"""The audit: every printed number next to ours for the stated scene, with its explanation."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from snooker_cli import theory
from snooker_cli.report import reproduction
from snooker_cli.report.reproduction import Runs, StatedResults
from snooker_cli.report.setting_search import FREEDOM, PARTS, TARGETS, Candidate, Search, simplest
from snooker_cli.report.source_values import COEFFICIENTS, SOURCE_VALUES, OurValue, SourceValue

# Verdicts
REPRODUCED = "reproduced"
FOLLOWS = "from its own numbers"
FORMULA = "one formula fits"
EXPLAINED = "one setting fits"
ALONE = "fits by itself only"
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
    search: Search
    stated: StatedResults
    repeats: int
    complete: int

    @property
    def best(self) -> Candidate:
        """The setting that explains the measured numbers best."""
        return self.search.ranked[0]

    def row(self, name: str) -> AuditRow:
        """The row of a printed number."""
        return next(row for row in self.rows if row.number.name == name)

    def as_json(self) -> dict[str, Any]:
        """All numbers of the audit."""
        found = self.search
        return {
            "settings": len(found.candidates),
            "ranked": len(found.ranked),
            "near": found.near,
            "slip": found.factor,
            "free_slip": asdict(found.free),
            "freedom": FREEDOM,
            "support": {part: found.support(part) for part in PARTS},
            "mean_free_path": asdict(self.stated.mean_free_path),
            "complete": self.complete,
            "profile": [
                {
                    "setting": one.description,
                    "score": one.score,
                    "wins": found.wins[found.ranked.index(one)],
                    "complete": one.complete,
                    "values": {
                        each.name: asdict(one.samples[each.quantity, each.cor].our_value(each))
                        for each in TARGETS
                    },
                }
                for one in found.profile
            ],
            "numbers": [row.as_json() for row in self.rows],
            "claims": self.claims,
        }


def audit(runs: Runs, found: Search) -> Audit:
    """The audit from the runs of the reproduction and the search in two of them.

    Raises ``RunError`` or ``StoreError`` for a run that cannot be read.
    """
    stated = reproduction.stated_results(runs)
    return Audit(
        rows=tuple(_row(number, stated, found) for number in SOURCE_VALUES.values()),
        claims=reproduction.checked_claims(runs, stated),
        search=found,
        stated=stated,
        repeats=len(COEFFICIENTS) * runs["restitution"].experiment.repeats,
        complete=sum(
            len(laws["kinetic_energy", "exponential"].fits) for laws in stated.laws.values()
        ),
    )


def _row(number: SourceValue, stated: StatedResults, found: Search) -> AuditRow:
    """The verdict: from the stated scene if that agrees, else from a formula, else a setting."""
    ours, common = stated.numbers[number.name], found.ranked[0].our_value(number)
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
    # The stated scene with our own rings has been compared already, with more repeats.
    others = [one for one in found.candidates if one.changes or one.extent != found.extent]
    offer = simplest(others, number)
    if offer is None:
        return AuditRow(number, ours, common, UNEXPLAINED)
    setting, value = offer
    if not value.agrees(number):
        verdict = UNEXPLAINED
    elif not setting.changes:
        verdict = REPRODUCED  # the source report does not state where the balls start
    else:
        verdict = EXPLAINED if common is not None and common.agrees(number) else ALONE
    return AuditRow(number, ours, common, verdict, setting.description, value)


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
