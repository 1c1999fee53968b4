"""What the report says: sections as in the source report, every number from the results."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from snooker_cli.figures.selection import distinct
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.report import supplements
from snooker_cli.report.audit import (
    ALONE,
    EXPLAINED,
    FOLLOWS,
    REPRODUCED,
    UNEXPLAINED,
    Audit,
    AuditRow,
)
from snooker_cli.report.document import (
    Block,
    Figure,
    Heading,
    Paragraph,
    ReportDocument,
    ReportTable,
)
from snooker_cli.report.setting_search import LIKELY, TARGETS, Candidate
from snooker_cli.report.source_values import (
    COEFFICIENTS,
    LORD,
    OurValue,
    Property,
    SourceValue,
    published,
)

if TYPE_CHECKING:
    from snooker_cli.figures import FigureData
    from snooker_cli.runs import Run


# The report's tables, every cell from the results.

Fits = Sequence[Mapping[str, Any]]


def decay_constants(label: str, fits: Fits, repeats: int) -> ReportTable:
    """The fits to the report's scene."""
    found = {(one["parameters"]["cor"], one["quantity"], one["model"]): one for one in fits}
    rows = [
        (
            f"{cor:g}",
            quantity.replace("_", " "),
            *(
                cell
                for law in ("exponential", "haff")
                for cell in (
                    with_error(
                        found[cor, quantity, law]["value"], found[cor, quantity, law]["error"]
                    ),
                    short(found[cor, quantity, law]["max_min_half_range"], 2),
                    f"{found[cor, quantity, law]['r_squared']:.3f}",
                )
            ),
        )
        for cor, quantity, model in found
        if cor < 1.0 and model == "exponential"
    ]
    return ReportTable(
        label,
        f"Decay constants over {repeats} repeats, each fitted by itself: k of the exponential and "
        "α of Haff's law, mean and standard error; half of largest − smallest, the report's ±; "
        "R². Pressure is the mean since the start; local is in windows of time.",
        (
            "CoR",
            "quantity",
            "k, 1/s",
            "half range, 1/s",
            "R²",
            "α, 1/s",
            "half range, 1/s",
            "R²",
        ),
        tuple(rows),
        (True, False, *(True,) * 6),
        (0.5, 1.4, 1.3, 1.1, 0.7, 1.3, 1.1, 0.7),
    )


def audit_rows(label: str, audit: Audit) -> ReportTable:
    """Every printed number."""
    return ReportTable(
        label,
        "Every number that the report prints about its results. As stated: the report's scene, "
        f"{audit.repeats} repeats at each CoR, {audit.early} of them ending early in a wall trap; "
        "± is the standard error of a mean and, for one run, the spread of single runs. "
        f"Common setting: {audit.finding.setting.words()}.",
        (
            "where",
            "what",
            "unit",
            "printed",
            "as stated",
            "common setting",
            "best by itself",
            "verdict",
        ),
        tuple(
            (
                row.number.where,
                row.number.what,
                "" if row.number.unit == "1" else row.number.unit,
                row.number.printed,
                _exactly(row) if row.number.exact else _table_value(row.ours),
                "" if row.common is None else _table_value(row.common),
                _by_itself(row),
                row.verdict,
            )
            for row in audit.rows
        ),
        (False, False, False, True, True, True, False, False),
        (1.2, 2.7, 0.65, 1.45, 1.65, 1.6, 2.8, 1.35),
    )


def _table_value(ours: OurValue) -> str:
    return with_error(ours.value, ours.error)


def _exactly(row: AuditRow) -> str:
    """A number that is meant exactly, by how far ours is from it."""
    if row.ours.error > 0:
        return _table_value(row.ours)
    off = row.ours.value - row.number.value
    return row.number.digits + (f" {'+' if off > 0 else '−'} {short(abs(off), 1)}" if off else "")


def _by_itself(row: AuditRow) -> str:
    """What explains a number best by itself, and what that gives."""
    if row.value is None or row.verdict == FOLLOWS:
        return row.alone
    value = _table_value(row.value) if row.value.error > 0 else short(row.value.value, 6)
    return f"{'' if row.value.agrees(row.number) else 'nearest: '}{row.alone}: {value}"


def candidates(label: str, audit: Audit) -> ReportTable:
    """The best settings, and what each other choice costs."""
    numbers = [published(name) for name in TARGETS]
    symbols = {
        "energy decay": "k",
        "pressure decay": "κ",
        "mean speed": "⟨v⟩",
        "pressure": "P",
    }
    headings = tuple(
        f"{symbols[number.of]}{'' if number.cor is None else f' at {number.cor:g}'}, {number.unit}"
        for number in numbers
    )
    rows = [("printed", *(number.printed for number in numbers), "")]
    rows += [
        (
            one.setting.words(),
            *(_to_its_digits(one, number) for number in numbers),
            f"{one.score:.1f}" if one.score < 100 else f"{one.score:.0f}",
        )
        for one in audit.profile
    ]
    return ReportTable(
        label,
        "The best setting of all, and the best for every other choice of ball radius, wall, rings, "
        "fitted collisions, amplitude and slip: what each costs. k is the decay constant of "
        f"energy, κ that of pressure, ⟨v⟩ the mean speed, P the pressure at CoR 1; χ² is the sum "
        f"of {len(numbers)} squared differences in uncertainties.",
        ("setting", *headings, "χ²"),
        tuple(rows),
        (False, *(True for _ in numbers), True),
        (3.2, *(1.1 for _ in numbers), 0.65),
    )


def _to_its_digits(one: Candidate, number: SourceValue) -> str:
    """What a setting gives for a number, to the printed decimals, one for a whole number."""
    ours = one.beside(number)
    return "–" if ours is None else f"{ours.value:.{max(number.decimals, 1)}f}"


def sentences(label: str, audit: Audit) -> ReportTable:
    """The report's sentences that can be checked."""
    return ReportTable(
        label,
        "Sentences of the report that can be checked, with its own numbers or with ours.",
        ("where", "sentence", "check", "holds"),
        tuple(
            (one.where, one.claim, one.check, "yes" if one.holds else "no") for one in audit.claims
        ),
        (False, False, False, False),
        (1.0, 2.2, 4.0, 0.45),
    )


def many_coefficients(label: str, pictures: Mapping[str, FigureData]) -> ReportTable:
    """The decay constants of the energy over all CoR."""
    stated, elastic = (
        pictures[name].numbers["points"] for name in ("decay-against-cor", "decay-elastic-wall")
    )
    rows = [
        (
            f"{first['parameters']['cor']:g}",
            *(
                cell
                for one in (first, second)
                for cell in (
                    with_error(one["k"], one["k_error"]),
                    with_error(one["alpha"], one["alpha_error"]),
                    str(one["ended_early"]),
                )
            ),
        )
        for first, second in zip(stated, elastic, strict=True)
    ]
    return ReportTable(
        label,
        "Decay constants of the energy, exponential k and Haff's α, mean and standard error over "
        f"{stated[0]['repeats']} repeats with the wall's CoR as the balls' and "
        f"{elastic[0]['repeats']} with an elastic wall, and how many ended early, in a wall trap. "
        "At CoR 1 nothing decays.",
        (
            "CoR",
            "k, 1/s",
            "α, 1/s",
            "early",
            "elastic wall: k, 1/s",
            "α, 1/s",
            "early",
        ),
        tuple(rows),
        (True,) * 7,
        (0.5, 1.3, 1.3, 0.6, 1.3, 1.3, 0.6),
    )


# Which picture of which run is which figure of the report.


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report: its file, its label, and where its picture comes from."""

    file: str
    label: str
    run: str
    kind: str
    where: Mapping[str, Any] = field(default_factory=dict)


def _numbered(number: int, run: str, kind: str, **where: Any) -> ReportFigure:
    """One of the source report's 18 figures."""
    keys = {key.replace("__", "."): value for key, value in where.items()}
    return ReportFigure(f"fig{number:02d}", f"Figure {number}", run, kind, keys)


MOTION = (
    _numbered(1, "decay", "central-distances", cor=1.0),
    _numbered(2, "decay", "pair-distances", cor=1.0),
)
ENERGY = (
    _numbered(3, "decay", "energy"),
    _numbered(4, "decay", "momentum-x"),
    _numbered(5, "decay", "momentum-y"),
    _numbered(6, "decay", "energy-fit", cor=0.8),
    _numbered(7, "decay", "energy-fit", cor=0.9),
    _numbered(8, "decay", "temperature-fit", cor=0.8),
    _numbered(9, "decay", "temperature-fit", cor=0.9),
)
PRESSURE = (
    _numbered(10, "decay", "pressure"),
    _numbered(11, "decay", "pressure-fit", cor=0.8),
    _numbered(12, "decay", "pressure-fit", cor=0.9),
)
IDEAL = (
    _numbered(13, "temperature", "pressure-temperature"),
    _numbered(14, "area", "pressure-area"),
    _numbered(15, "number", "pressure-number"),
    _numbered(16, "radius", "temperature-ratio"),
    _numbered(17, "dilute", "ideal-ratio", balls__radius=published("ratio_caption").radius),
    ReportFigure(
        "fig17-text",
        "Figure 17, text",
        "dilute",
        "ideal-ratio",
        {"balls.radius": published("ratio_text").radius},
    ),
)
SPEEDS = (_numbered(18, "speeds", "speeds"),)
BEYOND = (
    ReportFigure("decay-against-cor", "Figure 19", "restitution", "decay-against-cor"),
    ReportFigure("decay-elastic-wall", "Figure 20", "elastic-wall", "decay-against-cor"),
    ReportFigure("haff-time", "Figure 21", "elastic-wall", "haff-time"),
    ReportFigure("event-decay", "Figure 22", "elastic-wall", "event-decay"),
)
PLATES = (*MOTION, *ENERGY, *PRESSURE, *IDEAL, *SPEEDS, *BEYOND)

RUNS = (
    "decay",
    "temperature",
    "area",
    "number",
    "radius",
    "dilute",
    "speeds",
    "restitution",
    "elastic-wall",
    "sliding",
    "audit",
)
"""The runs the report is made from: those of the configs of the same names."""


TITLE = (
    "Effect of the coefficient of restitution on thermodynamic properties: the report reproduced"
)

_GROUPS: dict[Property, str] = {
    "central distance": "distances",
    "pair distance": "distances",
    "momentum x": "momentum",
    "momentum y": "momentum",
    "mean speed": "mean speeds",
    "temperature ratio": "the ideal gas in the limit of small balls",
    "pressure ratio": "the ideal gas in the limit of small balls",
}
"""Properties that a list takes together."""

_PARTS = {
    "radius": "ball radius",
    "slip": "slip",
    "window": "fitted collisions",
    "elastic_wall": "wall",
    "held": "amplitude",
    "extent": "rings",
}
"""The parts of a setting, in words."""

Runs = Mapping[str, "Run"]
Pictures = Mapping[str, "FigureData"]


def document(
    pictures: Pictures, audit: Audit, fits: Fits, runs: Runs, saved: Mapping[str, dict[str, Any]]
) -> ReportDocument:
    """The whole report as data; ``saved`` are the measurements kept with it, by name."""

    def figures(plates: Sequence[ReportFigure]) -> list[Block]:
        return [
            Figure(plate.label, f"figures/{plate.file}", pictures[plate.file].caption)
            for plate in plates
        ]

    blocks: list[Block] = [
        Heading("Theory and algorithm"),
        Paragraph(_scene_text(runs["decay"])),
        Paragraph(
            "Collisions are the exact roots of the report's equation 1, in order of time, with its "
            "equations 3 and 4 for what they do. Which one is next is decided by whether balls "
            "approach; no time below some tolerance counts as zero. Units are the report's: "
            "Boltzmann's constant is 1, and pressure is force over the perimeter 2πR, in Pa·m. "
            "Behind ± stands the standard error of a mean over repeats, unless something else is "
            "said."
        ),
        *figures(MOTION),
        Heading("Momentum, kinetic energy and temperature"),
        Paragraph(_energy_text(fits)),
        *figures(ENERGY),
        decay_constants("Table 1", fits, runs["decay"].experiment.repeats),
        Heading("Pressure"),
        Paragraph(_pressure_text(fits, audit)),
        *figures(PRESSURE),
        Heading("Comparison with the ideal gas law"),
        Paragraph(_ideal_text(pictures)),
        *figures(IDEAL),
        Paragraph(_copies_text(runs)),
        *figures(SPEEDS),
        Heading("Audit: every printed number", after_figures=True),
        *(Paragraph(text) for text in _audit_texts(audit, runs["audit"])),
        audit_rows("Table 2", audit),
        candidates("Table 3", audit),
        sentences("Table 4", audit),
        Heading("More coefficients, a τ that changes, many repeats"),
        Paragraph(_beyond_text(pictures, runs)),
        *figures(BEYOND),
        many_coefficients("Table 5", pictures),
        *supplements.accuracy_blocks(saved["error"], pictures),
        *supplements.sliding_blocks(pictures),
        *supplements.trial_blocks(saved["hard"], saved["billion"], saved["physics"]),
        Heading("Conclusion", after_figures=True),
        Paragraph(_conclusion_text(audit, pictures)),
    ]
    return ReportDocument(TITLE, _summary(audit), tuple(blocks))


def _summary(audit: Audit) -> tuple[str, ...]:
    """The main findings, in two paragraphs."""
    counts = Counter(row.verdict for row in audit.rows)
    reproduced = list(
        dict.fromkeys(
            _GROUPS.get(row.number.of, row.number.of)
            for row in audit.rows
            if row.verdict == REPRODUCED
        )
    )
    decays = [name for name in TARGETS if published(name).of.endswith("decay")]
    ratios = [audit.row(name).ours.value / published(name).value for name in decays]
    constants = listed(
        [
            f"{short(one.value, 3)} where it has {published(name).printed}"
            for name in decays
            if (one := audit.finding.beside(published(name))) is not None
        ]
    )
    path = published("mean_free_path")
    return (
        f"Of {len(audit.rows)} numbers that the report prints about its results, "
        f"{counts[REPRODUCED]} come out of the scene as it states it: {listed(reproduced)}. "
        f"{counts[FOLLOWS]} are explained by its other numbers, "
        f"{counts[EXPLAINED] + counts[ALONE]} by another setting, and {counts[UNEXPLAINED]} not "
        f"at all. Its mean decay constants are {min(ratios):.1f} to "
        f"{max(ratios):.1f} times too small for its scene.",
        f"Of {len(audit.search.ranked)} settings compared, the one nearest to its decay constants, "
        f"mean speeds and pressure together is: {audit.finding.setting.words()}. It gives "
        f"{constants} 1/s. Its mean free path of {path.with_unit} is also {audit.search.factor:g} "
        f"times the {path.value / audit.search.factor:.3f} m of disks like its own, so that its "
        "theory seemed to agree.",
    )


def _scene_text(run: Run) -> str:
    """The report's scene, from its config."""
    experiment: Any = run.experiment
    balls, container = experiment.balls, experiment.container
    return (
        f"Unless a caption says otherwise: {starting_scene(experiment, 0).number} balls of radius "
        f"{balls.radius:g} m and mass {balls.mass:g} kg on {balls.rings} rings around one in the "
        f"middle, {balls.speed:g} m/s in random directions; a container of radius "
        f"{container.radius:g} m and mass {short(container.mass, 1)} kg that is free to move; the "
        "same coefficient of restitution (CoR) between balls and at the wall; "
        f"{experiment.collisions} collisions, of balls and with the wall together. The report "
        "leaves open how far the rings reach; here the outermost is at "
        f"{balls.ring_extent:g} of the container's radius R."
    )


def _value(fits: Fits, cor: float, quantity: str, model: str = "exponential") -> Mapping[str, Any]:
    """A decay constant by CoR, quantity and law."""
    return next(
        one
        for one in fits
        if (one["parameters"]["cor"], one["quantity"], one["model"]) == (cor, quantity, model)
    )


def _shown(one: Mapping[str, Any]) -> str:
    return with_error(one["value"], one["error"])


def _at_each(texts: Sequence[str]) -> str:
    """Something at each of the report's CoR below 1: ``a at CoR 0.8 and b at 0.9``."""
    first, *others = zip(texts, COEFFICIENTS, strict=True)
    return listed(
        [f"{first[0]} at CoR {first[1]:g}", *(f"{text} at {cor:g}" for text, cor in others)]
    )


def _energy_text(fits: Fits) -> str:
    one, haff = (
        [_value(fits, cor, "kinetic_energy", law) for cor in COEFFICIENTS]
        for law in ("exponential", "haff")
    )
    squares = [
        f"{a['r_squared']:.3f} instead of {b['r_squared']:.3f}"
        for a, b in zip(haff, one, strict=True)
    ]
    return (
        "Energy is constant at CoR 1 and falls at every collision below it; momentum of balls and "
        "container together stays what it was, all to rounding (figures 3 to 5). Fitted as the "
        f"report does, E = E₀ exp(−kt), k is {_at_each([_shown(each) for each in one])}, in 1/s, "
        f"over {one[0]['repeats']} repeats (figures 6 and 7); temperature decays alike (figures 8 "
        "and 9). The exponential starts too slowly and ends too fast, since a slower gas collides "
        "less often. Haff's law E = E₀/(1 + αt)², whose collision rate falls with the speeds, "
        f"leaves less: R² = {_at_each(squares)}."
    )


def _pressure_text(fits: Fits, audit: Audit) -> str:
    low = COEFFICIENTS[0]
    mean, local = (_value(fits, low, name) for name in ("pressure", "local_pressure"))
    return (
        "The report's pressure is the mean since the start, ΣJ/(2πRt). At CoR 1 it settles at "
        f"{_ours(audit, 'pressure')} Pa·m, ± being the spread of single runs. "
        "Below, it falls more slowly than the pressure of the moment, because the mean remembers "
        "the start: under Haff's law it goes as 1/(1 + αt), the root of the energy's law. That is "
        "where the report's k/2 comes from; momentum per hit is proportional to speed, but so is "
        f"the rate of hits, and the pressure follows the temperature. At CoR {low:g} it decays "
        f"with {_shown(local)} 1/s in windows of time, the mean since the start with "
        f"{_shown(mean)} 1/s. Table 4 has it beside the energy in the same windows."
    )


def _ideal_text(pictures: Pictures) -> str:
    points = [
        point for name in ("fig17", "fig17-text") for point in pictures[name].numbers["points"]
    ]
    repeats = sum(point["repeats"] for point in points if point["parameters"]["cor"] < 1)
    early = sum(pictures[name].numbers["ended_early"] for name in ("fig17", "fig17-text"))
    return (
        "The ideal gas law knows no radius. Two things raise the pressure of hard disks above it: "
        "balls keep each other out of the way, and their centres reach only to R − r while the "
        "force is spread over 2πR. With tiny balls both are gone (figure 16), but below CoR 1 "
        "another thing comes in: such balls hardly meet each other and lose their energy at the "
        "wall. A ball whose hits on the wall follow each other ever faster ends in a wall trap, "
        f"infinitely many hits in finite time, and the repeat ends there: {early} of {repeats} "
        "do so in both versions of figure 17; figures 25 and 26 have them go on."
    )


def _copies_text(runs: Runs) -> str:
    groups = listed(
        [
            f"those at {listed([f'{speed:g}' for speed in group])} m/s (figure {figure})"
            for figure, name in ((13, "temperature"), (18, "speeds"))
            for group in copies(_swept(runs[name], "balls.speed"))
        ]
    )
    return (
        "The points of a sweep share their random directions, and a speed that is doubled halves "
        f"all times and changes nothing else, to the last bit: {groups} are copies of each other "
        "in other units, not further evidence. Speeds are read at even times, never at "
        "collisions, which fast balls have more of."
    )


def _swept(run: Run, key: str) -> list[float]:
    """The values of a swept key."""
    return [float(value) for value in distinct(run.points, key)]


def copies(speeds: Sequence[float]) -> list[list[float]]:
    """The speeds that are powers of two apart, which doubles scale by exactly."""
    groups: dict[float, list[float]] = {}
    for speed in speeds:
        groups.setdefault(math.frexp(speed)[0], []).append(speed)
    return [sorted(group) for group in groups.values() if len(group) > 1]


def _audit_texts(audit: Audit, run: Run) -> tuple[str, ...]:
    """How numbers are judged, what was searched, and how far that decides."""
    radii, extents = _swept(run, "balls.radius"), _swept(run, "balls.ring_extent")
    windows = sorted({one.setting.window for one in audit.search.candidates})
    slips = dict.fromkeys(one.setting.slip.words for one in audit.search.candidates)
    slipped = [words.format(factor=f"{audit.search.factor:g}") for words in slips if words]
    points = len(run.points) * run.experiment.repeats
    return (
        "A value of ours is the printed one if it is within half of the last printed digit and "
        "twice the standard errors of both. The report's ± behind a mean of five runs is (largest "
        f"− smallest)/2, and the mean is certain to {2 * LORD:.2f} times that at 95 % (Lord 1947). "
        "What is meant exactly, a bound or a conserved momentum, has to come out to rounding, and "
        "a limit as near as theory says for the radius that was run.",
        f"What does not come out was searched for among {len(audit.search.candidates)} settings: "
        f"balls of {_or(radii)} m, the wall's CoR as the balls' or 1, rings to {_or(extents)} R, "
        f"the first {_or(windows)} collisions, the fitted curve held to its start or with its "
        f"amplitude free, and either no slip or one by {audit.search.factor:g}, the factor of the "
        f"mean free path: {'; '.join(slipped)}. Each gives decay constants of energy and pressure, "
        f"mean speeds and the pressure at CoR 1, {len(TARGETS)} numbers to be compared with the "
        "printed ones in uncertainties; χ² is the sum of the squares. "
        f"{len(audit.search.candidates) - len(audit.search.ranked)} settings in which single runs "
        "scatter by more than half of a number, so that it means nothing, are not ranked. "
        f"{audit.search.early} of the {points} repeats ended early, in a wall trap, and count up "
        "to there.",
        _decision_text(audit),
    )


def _or(values: Sequence[float]) -> str:
    """``0.1 or 1``."""
    return " or ".join(
        filter(None, [", ".join(f"{one:g}" for one in values[:-1]), f"{values[-1]:g}"])
    )


def _decision_text(audit: Audit) -> str:
    """How far the search can tell settings apart."""
    best = audit.finding
    costs = {part: _cost(audit, part) for part in _PARTS}
    # Five and three standard deviations of one number.
    decided = [_PARTS[part] for part, cost in costs.items() if cost > 25]
    likely = [_PARTS[part] for part, cost in costs.items() if 9 < cost <= 25]
    left = [_PARTS[part] for part, cost in costs.items() if cost <= 9]
    said = [
        how.format(listed(words))
        for how, words in (
            ("decides {} (more than 25)", decided),
            ("makes {} likely (9 to 25)", likely),
            ("leaves {} open (less than 9)", left),
        )
        if words
    ]
    free = with_error(audit.free.value, audit.free.error)
    return (
        f"The best setting has χ² = {best.score:.1f}; below {LIKELY:g}, which chance exceeds in "
        f"5 % of cases, there are {audit.near} of {len(audit.search.ranked)}. Table 3 has the best "
        f"of every other choice; what they add to χ² {listed(said)}. Left free, the slip in time "
        f"is {free}. Mean speeds and pressure belong to the stated speed and clock, so that it is "
        "the time axis under the fitted curves that is out, and the mean free path with it; what "
        "slipped there, the numbers do not say. No default of ours was changed for a printed "
        "number."
    )


def _cost(audit: Audit, part: str) -> float:
    """By how much the best setting with another choice of one part is worse in χ²."""
    best = audit.finding
    others = [
        one.score
        for one in audit.profile
        if getattr(one.setting, part) != getattr(best.setting, part)
    ]
    return min(others, default=math.inf) - best.score


def _beyond_text(pictures: Pictures, runs: Runs) -> str:
    stated, elastic = runs["restitution"], runs["elastic-wall"]
    points = pictures["decay-against-cor"].numbers["points"]
    early, total = sum(one["ended_early"] for one in points), sum(one["repeats"] for one in points)
    cors = [point.experiment.cor for point in stated.points]
    lowest = pictures["event-decay"].numbers["points"][0]
    rates = pictures["haff-time"].numbers["points"]
    falls = listed(
        [
            f"from {short(one['first_rate'], 2)} to {short(one['last_rate'], 2)} 1/s at CoR "
            f"{one['parameters']['cor']:g}"
            for one in (rates[0], rates[-1])
        ]
    )
    return (
        f"{len(cors)} coefficients from {min(cors):g} to {max(cors):g}, with "
        f"{stated.experiment.repeats} repeats of each for the wall as the report has it and "
        f"{elastic.experiment.repeats} for an elastic wall. With the inelastic wall {early} of "
        f"{total} repeats below CoR 1 end in a wall trap before their "
        f"{stated.experiment.collisions}th collision, most of them at small CoR; they are fitted "
        "up to there. The report asks for a τ that depends on time: that is Haff's law, in which "
        "the collision rate is proportional to the speeds, τ grows linearly in time, and the rate "
        f"of decay falls as 2α/(1 + αt): in figure 21 {falls}. Against collisions instead of time "
        "the decay is exponential at any density, until what is left is a common turning of the "
        "balls around the container, whose angular momentum a smooth wall cannot take: at CoR "
        f"{lowest['parameters']['cor']:g}, after {short(lowest['collisions_per_ball'])} collisions "
        f"a ball, {short(lowest['final_ratio'], 2)} of the energy is left where the collisions by "
        f"themselves would leave {short(lowest['theory'], 2)} (figure 22)."
    )


def _conclusion_text(audit: Audit, pictures: Pictures) -> str:
    holding = sum(one.holds for one in audit.claims)
    constants = [
        with_error(one["alpha"], one["alpha_error"])
        for one in pictures["decay-against-cor"].numbers["points"]
        if one["parameters"]["cor"] in COEFFICIENTS
    ]
    theories = [_ours(audit, f"theory_{cor}") for cor in COEFFICIENTS]
    found = [
        with_error(
            audit.row(f"energy_mean_{cor}").ours.value, audit.row(f"energy_mean_{cor}").ours.error
        )
        for cor in COEFFICIENTS
    ]
    return (
        f"Of {len(audit.claims)} sentences checked, {holding} hold. The report is right that "
        "energy falls faster at smaller CoR, that temperature follows it, and that small balls "
        "come near the ideal gas. Its constants are not those of its scene: there k is "
        f"{_at_each(found)}, in 1/s, and its formula gives {_at_each(theories)}. The two differ "
        "because in the formula a collision leaves e² of all the energy, where only the normal "
        "part of the relative motion is lost, and because its mean free path has 2πr instead of "
        "the 4r of disks and takes no account of how densely they lie. The "
        f"decay is Haff's, with α = {_at_each(constants)}. The pressure follows the temperature, "
        "and at its own temperature a cooling gas of tiny balls obeys the ideal gas law at any CoR."
    )


def _ours(audit: Audit, name: str) -> str:
    """Our value of a printed number, for the scene as stated."""
    ours = audit.row(name).ours
    return with_error(ours.value, ours.error)
