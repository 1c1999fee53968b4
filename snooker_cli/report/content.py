"""What the report says: sections as in the source report, every number from the results."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from snooker_cli.arrange import arrange
from snooker_cli.gallery.selection import distinct
from snooker_cli.report import accuracy, sliding, tables, trials
from snooker_cli.report.audit import ALONE, EXPLAINED, FOLLOWS, REPRODUCED, UNEXPLAINED, Audit
from snooker_cli.report.document import Block, Document, Figure, Heading, Paragraph
from snooker_cli.report.plates import BEYOND, ENERGY, IDEAL, MOTION, PRESSURE, SPEEDS, Plate
from snooker_cli.report.published import COEFFICIENTS, LORD, Property, published
from snooker_cli.report.search import LIKELY, TARGETS
from snooker_cli.words import listed, short, with_error

if TYPE_CHECKING:
    from snooker_cli.gallery import Picture
    from snooker_cli.results import Run

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

Fits = tables.Fits
Runs = Mapping[str, "Run"]
Pictures = Mapping[str, "Picture"]


def document(
    pictures: Pictures, audit: Audit, fits: Fits, runs: Runs, saved: Mapping[str, dict[str, Any]]
) -> Document:
    """The whole report as data; ``saved`` are the measurements kept with it, by name."""

    def figures(plates: Sequence[Plate]) -> list[Block]:
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
        tables.decay_constants("Table 1", fits, runs["decay"].experiment.repeats),
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
        tables.audit_rows("Table 2", audit),
        tables.candidates("Table 3", audit),
        tables.sentences("Table 4", audit),
        Heading("More coefficients, a τ that changes, many repeats"),
        Paragraph(_beyond_text(pictures, runs)),
        *figures(BEYOND),
        tables.many_coefficients("Table 5", pictures),
        *accuracy.blocks(saved["error"], pictures),
        *sliding.blocks(pictures),
        *trials.blocks(saved["hard"], saved["billion"], saved["physics"]),
        Heading("Conclusion", after_figures=True),
        Paragraph(_conclusion_text(audit, pictures)),
    ]
    return Document(TITLE, _summary(audit), tuple(blocks))


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
        f"Unless a caption says otherwise: {arrange(experiment, 0).number} balls of radius "
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
