"""Every number and sentence that the source report prints, beside our results."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np

from snooker_cli import Circle, theory
from snooker_cli.figures.figure_data import NEUTRAL, FigureData, Layer, Line, Points, Reference
from snooker_cli.formatting import listed, ratio, short, with_error
from snooker_cli.reproduction.explanations import FACTOR
from snooker_cli.reproduction.run_results import SETTLED, NumbersOfRun
from snooker_cli.reproduction.source_values import (
    AGREES,
    COEFFICIENTS,
    ROUNDING,
    SOURCE_VALUES,
    STATEMENTS,
    OurValue,
    SourceValue,
)

CLOSE = 0.05  # the source report calls values within 5 % equal

REFUSED = 0.01
"""A law is refused if deviations as large have a probability below this."""

KEYS = [f"{cor:g}" for cor in COEFFICIENTS]


def text(known: Any) -> str:
    """An estimate with its standard error."""
    return with_error(known["value"], known["error"])


def at_each(texts: list[str]) -> str:
    """``a at CoR 0.8 and b at CoR 0.9``."""
    return listed([f"{one} at CoR {key}" for one, key in zip(texts, KEYS, strict=True)])


def comparison(found: NumbersOfRun) -> list[NumbersOfRun]:
    """A row for each printed number: the number, ``ours``, whether it ``agrees``, and a ``note``.

    The note is another formula that gives the number; ``formula`` is its value, if it has one.
    """
    rows = []
    for number in SOURCE_VALUES.values():
        ours = our_value(found, number)
        row = {**asdict(number), "ours": asdict(ours), "agrees": ours.agrees(number)}
        row |= {"value": number.value, "digits": number.digits}
        row |= {"note": number.follows, "formula": None}
        if number.repeats:
            row["note"] = "printed again"
        if ours.allowed:
            row["note"] = f"theory allows ± {ours.allowed:.5f} at this radius"
        if number.name == "mean_free_path":
            # Of disks of the stated radius, with 4r; and of disks of a tenth of it.
            path = theory.mean_free_path(found["density"], found["radius"])
            row |= {"note": "10 × 1/(√2 n 4r)", "formula": FACTOR * path}
        if number.name == "cross_section":
            section = 1 / (math.sqrt(2) * found["density"] * SOURCE_VALUES["mean_free_path"].value)
            row |= {"note": "1/(√2 n λ) with its λ", "formula": section}
        rows.append(row)
    return rows


def our_value(found: NumbersOfRun, number: SourceValue) -> OurValue:
    """Our value of a printed number, for the scene as stated."""
    cor, name = f"{number.cor:g}" if number.cor else "", number.quantity
    if name.endswith((" decay", "decay, doubled")):
        quantity = {"energy": "kinetic_energy"}.get(word := name.split()[0], word)
        row = found["stated"][cor]["fits"][quantity]["exponential"]
        twice = 2.0 if name.endswith("doubled") else 1.0
        return OurValue(twice * row["value"], twice * row["error" if number.mean else "deviation"])
    if number.cor and name in ("tau", "theory", "mean speed"):
        known = found["stated"][cor][{"mean speed": "speed"}.get(name, name)]
        return OurValue(known["value"], known["error"])
    if name == "pressure":
        known = found["elastic"]["pressure"]
        return OurValue(known["value"], known["deviation"])
    if name in ("temperature ratio", "pressure ratio"):
        return _limit(found, number)
    figures, radius = found["figures"], found["radius"]
    single = {
        "central distance": figures["fig01"]["largest_distance"],
        "pair distance": figures["fig02"]["smallest_distance"],
        "momentum x": 1 + figures["fig04"]["largest_deviation"],
        "momentum y": 1 + figures["fig05"]["largest_deviation"],
        "density": found["density"],
        "cross-section": 2 * math.pi * radius,
        "mean free path": found["source_path"],
    }
    return OurValue(single[name])


def _limit(found: NumbersOfRun, number: SourceValue) -> OurValue:
    """A ratio to the ideal gas at CoR 1 for small balls; in the limit it is 1."""
    if number.quantity == "temperature ratio":
        point = min(found["figures"]["fig16"]["points"], key=_radius)
        return OurValue(point["ratio"], point["ratio_error"], abs(point["theory"] - 1))
    figures = found["figures"]["fig17"], found["figures"]["fig17-text"]
    (point,) = (
        point
        for figure in figures
        for point in figure["points"]
        if point["parameters"]["cor"] == 1 and _radius(point) == number.radius
    )
    container = Circle(found["container_radius"])
    disks: float = theory.fluid_state(found["balls"], 1.0, _radius(point), container).pressure
    expected = disks / theory.ideal_gas_pressure(found["balls"], 1.0, container.area)
    value, error = point["over_ideal_at_mean"], point["over_ideal_at_mean_error"]
    return OurValue(value, error, abs(expected - 1))


def _radius(point: NumbersOfRun) -> float:
    return float(point["parameters"]["balls.radius"])


# The printed numbers over ours, as figures.

OVERVIEWS: dict[str, tuple[str, tuple[tuple[str, ...], ...]]] = {
    "printed-by-cor": (
        "Numbers at CoR 0.8 and 0.9",
        (
            ("energy decay", "temperature decay"),
            ("pressure decay", "pressure decay, doubled"),
            ("theory", "tau", "mean speed"),
        ),
    ),
    "printed-others": (
        "All other numbers",
        (
            ("central distance", "pair distance", "momentum x", "momentum y"),
            ("density", "cross-section", "mean free path"),
            ("pressure", "temperature ratio", "pressure ratio"),
        ),
    ),
}
"""The titles of the figures of printed numbers, and their groups of quantities, by file."""

READ = "Filled: our value agrees. Bars: two combined standard errors; some are hidden by markers."
"""How to read these figures."""

APART = 0.13  # lines of text from the middle of a line to the marker of a CoR


def overview(file: str, printed: Sequence[NumbersOfRun]) -> FigureData:
    """Printed numbers over ours on a logarithmic axis: a line for each, or for one at both CoR.

    printed : the rows of `comparison`
    """
    title, groups = OVERVIEWS[file]
    names, layers = list[str](), list[Layer]([Reference("x", 1.0)])
    for quantities in groups:
        names += [""] * bool(names)
        for row in (row for row in printed if row["quantity"] in quantities):
            name = row["what"].removesuffix(f", CoR {row['cor']:g}" if row["cor"] else "")
            if name not in names:
                names.append(name)
            layers += _printed_over_ours(row, names.index(name))
    caption = f"{title} that the source report prints, over those of the stated scene. {READ}"
    return FigureData(
        file, title, "printed / reproduced", "", tuple(layers), caption, x_log=True, y_names=names
    )


def _printed_over_ours(row: NumbersOfRun, place: int) -> Iterator[Layer]:
    """The marker of a printed number and its interval, which is symmetric on the axis."""
    number, ours = SOURCE_VALUES[row["name"]], row["ours"]
    over = row["value"] / ours["value"]
    error = math.hypot(number.standard_error / row["value"], ours["error"] / ours["value"])
    ends = over * np.exp(AGREES * error * np.array([-1.0, 1.0]))
    series, label, y = NEUTRAL, None, float(place)
    if row["cor"]:
        series, label = KEYS.index(key := f"{row['cor']:g}"), f"CoR {key}"
        y += APART * (2 * series - 1)
    yield Line(ends, np.repeat(y, 2), series=series, style="solid")
    yield Points(np.array([over]), np.array([y]), label=label, series=series, filled=row["agrees"])


Check: TypeAlias = Callable[[NumbersOfRun], tuple[bool | None, dict[str, Any]]]


def statements(found: NumbersOfRun) -> list[NumbersOfRun]:
    """Every sentence about results that a number can decide, with our check and its result.

    Keys: ``name``, ``where``, ``text``, ``check`` (in words), ``holds``; ``None`` if nothing
    decides.
    """
    rows = []
    for name, one in STATEMENTS.items():
        # The numbers of the source report decide some sentences alone.
        check: Check = CHECKS.get(name, lambda _, one=one: (one.get("holds"), {}))  # type: ignore[misc]
        holds, values = check(found)
        row = {"name": name, "where": one["where"], "text": one["text"]}
        rows.append({**row, "check": one["check"].format(**values), "holds": holds})
    return rows


def elastic_deviation(found: NumbersOfRun) -> float:
    """The largest change of the energy at CoR 1, as a share."""
    points = found["figures"]["fig03"]["points"]
    return float(next(p["largest_deviation"] for p in points if p["elastic"]))


def temperature_apart(found: NumbersOfRun) -> float:
    """How far the k of the temperature is from that of the energy, as a share."""
    fits = [found["stated"][key]["fits"] for key in KEYS]
    constants = [
        [f[q]["exponential"]["value"] for q in ("temperature", "kinetic_energy")] for f in fits
    ]
    return max(abs(float(ours / energy) - 1) for ours, energy in constants)


def tiny_balls(found: NumbersOfRun, *, sliding: bool) -> list[NumbersOfRun]:
    """The points of the tiny balls of figure 17 below CoR 1, stopped by traps or sliding on."""
    collapse = "slide" if sliding else "stop"
    points = found["figures"]["sliding"]["points"]
    return [point for point in points if point["parameters"]["collapse"] == collapse]


def by_radius(found: NumbersOfRun) -> dict[float, float]:
    """P V/NT of elastic balls at the stated speed, by radius (m)."""
    points = found["figures"]["fig13"]["points"]
    chosen = (p for p in points if p["parameters"]["balls.speed"] == found["speed"])
    return {_radius(point): point["over_ideal"] for point in chosen}


def maxwell_distances(found: NumbersOfRun) -> tuple[float, float]:
    """Distance of cumulative shares of speeds from Maxwell's law: at most ours, and by theory."""
    speeds = [0.01 * k for k in range(600)]  # in units of √(2T/m), where T is 1/2
    shares = [theory.maxwell_speed_cdf(v, 0.5) for v in speeds]
    fixed = [theory.fixed_energy_speed_cdf(v, found["balls"], 0.5) for v in speeds]
    expected = max(abs(a - b) for a, b in zip(shares, fixed, strict=True))
    ours = max(point["distance_from_fixed_energy"] for point in found["figures"]["fig18"]["points"])
    return expected + ours, expected


def _exponential(found: NumbersOfRun) -> tuple[bool, dict[str, Any]]:
    energies = [found["stated"][key]["fits"]["kinetic_energy"] for key in KEYS]
    words = [
        " against ".join(
            ratio(fits[law]["chi_squared_per_degree"]) for law in ("exponential", "haff")
        )
        for fits in energies
    ]
    holds = all(fits["exponential"]["probability"] >= REFUSED for fits in energies)
    return holds, {"judged": at_each(words)}


def _half_rate(found: NumbersOfRun) -> tuple[bool, dict[str, Any]]:
    windows = [found["stated"][key]["windows"] for key in KEYS]
    falls = [one["cooling"] / one["kept"]["value"] for one in windows]
    rates = [math.log(p) / math.log(w["cooling"]) for p, w in zip(falls, windows, strict=True)]
    values = {"cooling": listed([short(one["cooling"], 2) for one in windows]), "since": SETTLED}
    values["falls"] = listed([short(fall, 2) for fall in falls])
    values["of_mean"] = listed([text(found["stated"][key]["slope"]) for key in KEYS])
    return all(abs(rate - 0.5) < abs(rate - 1) for rate in rates), values


def _tiny(found: NumbersOfRun, which: str) -> tuple[bool, dict[str, Any]]:
    points = tiny_balls(found, sliding=True)
    estimates = {
        name: [{"value": p[key], "error": p[f"{key}_error"]} for p in points]
        for name, key in (("at_mean", "over_ideal_at_mean"), ("at_end", "over_ideal_at_end"))
    }
    values = {name: at_each([*map(text, each)]) for name, each in estimates.items()}
    mean, elastic = estimates["at_mean"], our_value(found, SOURCE_VALUES["ratio_caption"])
    grows = abs(elastic.value - 1) - abs(mean[0]["value"] - 1)
    radius = SOURCE_VALUES["ratio_caption"].radius
    low, high = (row["temperature"] for row in found["traps"] if row["radius"] == radius)
    values |= {"low": text(low), "high": text(high)}
    warmer = high["value"] - low["value"]
    return {
        "excess": any(one["value"] - 1 > max(2 * one["error"], CLOSE) for one in mean),
        "divergence": grows > 2 * math.hypot(elastic.error, mean[0]["error"]),
        "colder": warmer > 2 * math.hypot(low["error"], high["error"]),
    }[which], values


def _tau(found: NumbersOfRun) -> tuple[bool, dict[str, Any]]:
    low, high = (found["stated"][key]["tau"]["value"] for key in KEYS)
    return low > high, {"low": low, "high": high}


def _worse(found: NumbersOfRun) -> tuple[bool, dict[str, Any]]:
    ratios = by_radius(found)
    rising = [ratios[radius] for radius in sorted(ratios)]
    words = listed([f"{ratios[radius]:.3f} at {radius:g} m" for radius in sorted(ratios)])
    return rising == sorted(rising), {"ratios": words}


def _small(found: NumbersOfRun) -> tuple[bool, dict[str, Any]]:
    ratios = by_radius(found)
    above = ratios[min(ratios)] - 1
    return abs(above) < CLOSE, {"above": 100 * above}


def _maxwell(found: NumbersOfRun) -> tuple[bool, dict[str, Any]]:
    off, expected = maxwell_distances(found)
    return off < CLOSE, {"off": off, "expected": expected, "number": found["balls"]}


def _radius_of_17(found: NumbersOfRun) -> tuple[None, dict[str, Any]]:
    ratios = [our_value(found, SOURCE_VALUES[n]) for n in ("ratio_text", "ratio_caption")]
    return None, {"ratios": listed([with_error(one.value, one.error) for one in ratios])}


CHECKS: dict[str, Check] = {
    "radius_of_figure_17": _radius_of_17,
    "energy_conserved": lambda found: (
        elastic_deviation(found) < ROUNDING,
        {"off": short(elastic_deviation(found), 1)},
    ),
    "exponential": _exponential,
    "temperature_follows": lambda found: (
        temperature_apart(found) < CLOSE,
        {"apart": short(temperature_apart(found), 1)},
    ),
    "half_rate": _half_rate,
    "tau_longer": _tau,
    "small_balls_ideal": _small,
    "worse_with_radius": _worse,
    "pressure_excess": lambda found: _tiny(found, "excess"),
    "divergence": lambda found: _tiny(found, "divergence"),
    "lower_temperatures": lambda found: _tiny(found, "colder"),
    "maxwell_boltzmann": _maxwell,
}
"""How results decide a sentence: whether it holds, and what the braces of its check refer to."""
