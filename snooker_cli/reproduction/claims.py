"""The sentences of the paper that depend on results: a name, and the test that each must pass.

``templates/paper.md.j2`` has ``{{ holds("name") }}`` before each of them. `make report` stops with
the name of a sentence that the data no longer support.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from snooker_cli.errors import UserError
from snooker_cli.reproduction.explanations import FACTOR
from snooker_cli.reproduction.printed import (
    KEYS,
    REFUSED,
    by_radius,
    elastic_deviation,
    temperature_apart,
    tiny_balls,
)
from snooker_cli.reproduction.run_results import NumbersOfRun
from snooker_cli.reproduction.source_values import ROUNDING, SOURCE_VALUES, OurValue

SIGMAS = 2.0  # standard errors beyond which a difference is one

AS_STATED = {
    *("largest_distance", "smallest_distance", "momentum_x", "momentum_y", "density", "pressure"),
    *("speed_0.9", "equipartition", "ratio_text", "ratio_caption"),
}
"""The printed numbers that the text names as agreeing."""


def energy(found: NumbersOfRun, where: str, law: str) -> list[Any]:
    """The fits of a law to the energy, at CoR 0.8 and 0.9, from five repeats or as stated."""
    fits = found["five"] if where == "five" else {k: found["stated"][k]["fits"] for k in KEYS}
    return [fits[key]["kinetic_energy"][law] for key in KEYS]


def refused(rows: list[Any]) -> list[bool]:
    """Whether each law is refused."""
    return [row["probability"] < REFUSED for row in rows]


def row_of(found: NumbersOfRun, name: str) -> Any:
    """The comparison of a printed number."""
    return next(row for row in found["printed"] if row["name"] == name)


def tiny_path(found: NumbersOfRun) -> float:
    """The mean free path of balls of 0.01 m at the stated density, m."""
    stated = row_of(found, "mean_free_path")["formula"] / FACTOR
    return float(stated * found["radius"] / 0.01)


def ended_early(found: NumbersOfRun) -> dict[float, int]:
    """Repeats that ended early, by CoR."""
    points = found["figures"]["decay-against-cor"]["points"]
    return {point["parameters"]["cor"]: point["ended_early"] for point in points}


def above(known: Any, limit: float) -> bool:
    """Whether an estimate is above a limit by more than chance."""
    return bool(known["value"] - limit > SIGMAS * known["error"])


def local_exponents(found: NumbersOfRun) -> list[float]:
    """d ln P/d ln T of the pressure at each moment: 1 if it follows T, 1/2 if its root."""
    windows = [found["stated"][key]["windows"] for key in KEYS]
    return [1 - math.log(one["kept"]["value"]) / math.log(one["cooling"]) for one in windows]


def decay_factors(found: NumbersOfRun) -> list[float]:
    """Our mean decay constants of energy and pressure over the printed ones."""
    names = [name for name in SOURCE_VALUES if name.startswith(("energy_mean", "pressure_mean"))]
    return [row_of(found, n)["ours"]["value"] / SOURCE_VALUES[n].value for n in names]


def tiny_ratios(found: NumbersOfRun, name: str, *, sliding: bool) -> list[float]:
    """P V/NT of the tiny balls below CoR 1, ``at_mean`` or ``at_end`` temperature."""
    return [point[f"over_ideal_{name}"] for point in tiny_balls(found, sliding=sliding)]


def starts_apart(found: NumbersOfRun) -> list[float]:
    """Haff's α of mixed starts less that of rings, with the stated wall, in standard errors."""
    rings = {row["cor"]: row["alpha"] for row in found["haff"]["restitution"]}
    apart = []
    for row in found["mixed"][0]:
        one, other = row["alpha"], rings[row["cor"]]
        error = math.hypot(one["error"], other["error"])
        apart.append((one["value"] - other["value"]) / error)
    return apart


def last_rates(found: NumbersOfRun) -> dict[float, float]:
    """The last rates of decay less those of Haff's law with the fitted α, in errors, by CoR."""
    return {
        point["parameters"]["cor"]: (point["last_rate"] - point["fitted_last_rate"])
        / point["last_rate_error"]
        for point in found["figures"]["haff-time"]["points"]
    }


def missed(found: NumbersOfRun) -> list[set[str]]:
    """The printed numbers that each explanation does not give."""
    return [set(one["values"]) - set(one["agreeing"]) for one in found["explanations"].values()]


def methods(found: NumbersOfRun) -> list[Any]:
    """The methods of the saved measurement of errors: ours, the source report's, time steps."""
    return list(found["measured"]["error"]["scenes"][0]["results"])


def steps_are_slower_and_wrong(found: NumbersOfRun) -> bool:
    """Whether each time step is slower than ours, and its error is more than 10⁶ times as large."""
    place = found["measured"]["error"]["scenes"][0]["checkpoints"].index(100)
    own, _, *steps = methods(found)
    return all(
        step["place_errors"][place] > 1e6 * own["place_errors"][place]
        and step["events_per_second"] < own["events_per_second"]
        for step in steps
    )


def changed_averages(found: NumbersOfRun) -> set[str]:
    """Methods with an average that differs from ours by more than three standard errors."""
    return {
        method["method"]
        for ensemble in found["measured"]["error"]["ensembles"]
        for method in ensemble["methods"][1:]
        for bias in method["biases"]
        if abs(bias["difference"]) > 3 * bias["difference_error"]
    }


def rotation_is_most(found: NumbersOfRun) -> bool:
    """Whether a rotation, and not the collisions, leaves most of the energy at the least CoR."""
    point = found["figures"]["event-decay"]["points"][0]
    left = point["final_ratio"]
    return bool(point["theory"] < 0.1 * left and 0.5 < point["theory_above_floor"] / left < 1)


CLAIMS: Mapping[str, Callable[[NumbersOfRun], bool]] = {
    # What agrees, and what does not
    "the named numbers agree, and no other": lambda found: (
        {row["name"] for row in found["printed"] if row["agrees"]} == AS_STATED
    ),
    "printed decay constants are several times too small": lambda found: (
        min(decay_factors(found)) > 5
    ),
    "the printed path is ten times that of the stated disks": lambda found: OurValue(
        row_of(found, "mean_free_path")["formula"]
    ).rounds_to(SOURCE_VALUES["mean_free_path"]),
    "no formula gives the printed cross-section": lambda found: (
        not OurValue(row_of(found, "cross_section")["formula"]).rounds_to(
            SOURCE_VALUES["cross_section"]
        )
    ),
    "no change gives all numbers": lambda found: all(missed(found)),
    "the last row misses k at CoR 0.8 alone": lambda found: (
        missed(found)[-1] == {"energy_mean_0.8"}
    ),
    # Conserved quantities
    "distances keep their bounds to rounding": lambda found: (
        found["figures"]["fig01"]["largest_excess"] < 10 * ROUNDING
        and found["figures"]["fig02"]["largest_overlap"] < 2 * ROUNDING
    ),
    "energy and momentum are kept to rounding": lambda found: (
        max(
            elastic_deviation(found),
            *(found["figures"][name]["largest_deviation"] for name in ("fig04", "fig05")),
        )
        < ROUNDING
    ),
    # Laws of decay
    "energy falls faster at smaller CoR": lambda found: (
        (k := [point["k"] for point in found["figures"]["decay-against-cor"]["points"]])
        == sorted(k, reverse=True)
    ),
    "all five repeats are complete": lambda found: all(
        row["complete"] == row["requested"]
        for key in KEYS
        for laws in found["five"][key].values()
        for row in laws.values()
    ),
    "temperature decays as energy": lambda found: temperature_apart(found) < 1e-5,
    "five repeats refuse the exponential": lambda found: all(
        refused(energy(found, "five", "exponential"))
    ),
    "five repeats do not refuse Haff's law": lambda found: (
        not any(refused(energy(found, "five", "haff")))
    ),
    "two hundred repeats refuse both laws": lambda found: all(
        refused(energy(found, "stated", "exponential") + energy(found, "stated", "haff"))
    ),
    "Haff's law is closer": lambda found: all(
        haff["chi_squared_per_degree"] < exponential["chi_squared_per_degree"] / 5
        for haff, exponential in zip(
            energy(found, "stated", "haff"), energy(found, "stated", "exponential"), strict=True
        )
    ),
    # Pressure
    "the mean pressure falls at somewhat more than half": lambda found: all(
        above(found["stated"][key]["slope"], 0.5) and found["stated"][key]["slope"]["value"] < 0.6
        for key in KEYS
    ),
    "the pressure at each moment falls about as T": lambda found: all(
        0.9 < exponent < 1.1 for exponent in local_exponents(found)
    ),
    "the pressure's exponential is refused": lambda found: all(
        refused([found["stated"][key]["fits"]["pressure"]["exponential"] for key in KEYS])
    ),
    # Ideal gas
    "small balls approach the ideal gas": lambda found: (
        abs(by_radius(found)[min(by_radius(found))] - 1) < 0.02
    ),
    "the path of tiny balls is longer than the container": lambda found: (
        tiny_path(found) > 2 * found["container_radius"]
    ),
    "the ideal gas law fails as balls grow": lambda found: (
        [*map(by_radius(found).get, sorted(by_radius(found)))] == sorted(by_radius(found).values())
    ),
    "most tiny balls below CoR 1 end in a trap": lambda found: (
        found["figures"]["fig17"]["ended_early"]
        > 0.5 * sum(p["repeats"] for p in found["figures"]["fig17"]["points"][:2])
    ),
    "the excess of figure 17 is that of the final temperature": lambda found: all(
        max(abs(ratio - 1) for ratio in tiny_ratios(found, "at_mean", sliding=sliding)) < 0.02
        and min(tiny_ratios(found, "at_end", sliding=sliding)) > 1.2
        for sliding in (False, True)
    ),
    "all sliding repeats are complete": lambda found: all(
        row["complete"] == row["repeats"] for row in found["traps"]
    ),
    "the excess depends on when a run ends": lambda found: all(
        slid - stopped > 0.05
        for slid, stopped in zip(
            tiny_ratios(found, "at_end", sliding=True),
            tiny_ratios(found, "at_end", sliding=False),
            strict=True,
        )
    ),
    "speeds follow the law at fixed energy": lambda found: all(
        point["probability"] >= REFUSED for point in found["figures"]["fig18"]["points"]
    ),
    # Beyond the source report
    "most repeats that end early have a small CoR": lambda found: (
        sum(number for cor, number in ended_early(found).items() if cor < 0.7)
        > 0.5 * sum(ended_early(found).values())
    ),
    "all repeats at the lowest CoR with an elastic wall are complete": lambda found: (
        found["haff"]["elastic-wall"][0]["complete"]
        == found["figures"]["event-decay"]["points"][0]["repeats"]
    ),
    "theory is too high for balls from rings": lambda found: all(
        row["excess"] > SIGMAS * row["error"] for row in found["haff"]["restitution"]
    ),
    "a mixed start cools faster": lambda found: min(starts_apart(found)) > SIGMAS,
    "theory is within five percent of mixed starts": lambda found: all(
        abs(row["excess"]) < 0.05 for rows in found["mixed"] for row in rows
    ),
    "late rates are below Haff's law, but at CoR 0.95": lambda found: (
        {cor for cor, errors in last_rates(found).items() if errors > -SIGMAS} == {0.95}
        and abs(last_rates(found)[0.95]) < SIGMAS
    ),
    "a rotation is most of the energy left": rotation_is_most,
    "time steps are slower and wrong": steps_are_slower_and_wrong,
    "the source report's algorithm drops an event": lambda found: (
        methods(found)[1]["first_different"] < methods(found)[0]["first_different"]
        and methods(found)[0]["first_different"] == methods(found)[0]["collisions"]
    ),
    "only long time steps change averages": lambda found: (
        changed_averages(found) == {method["method"] for method in methods(found)[2:4]}
    ),
    "one rounding changes no average": lambda found: all(
        abs(bias["difference"]) < 3 * bias["difference_error"]
        for scene in found["measured"]["certain"]["rounding"]
        for bias in scene["methods"][1]["biases"]
    ),
    "all hard cases hold": lambda found: all(
        case["holds"] for name in ("hard", "billion") for case in found["measured"][name]["cases"]
    ),
    "exactly known values agree": lambda found: all(
        row["agreement"] == "yes" or (row["systematic"] and row["agreement"] == "only with open")
        for row in found["measured"]["physics"]["rows"]
    ),
    "an inelastic gas is colder than its wall": lambda found: all(
        above(row["colder"], 1) for row in found["warm"] if row["cor"] < 1
    ),
    "size changes PV/NT more than the CoR": lambda found: (
        found["warm"][-3]["virial"] / found["warm"][0]["virial"]
        > 10 * (found["warm"][-1]["weaker"]["value"] - 1)
    ),
    "the wall is warmer than the middle": lambda found: (
        found["figures"]["profiles"]["points"][0]["last_temperature"]
        > 2 * found["figures"]["profiles"]["points"][0]["first_temperature"]
    ),
}


def check(found: NumbersOfRun) -> None:
    """Raise ``UserError`` with the first sentence that the results do not support."""
    for name, test in CLAIMS.items():
        if not test(found):
            raise UserError(
                f"the results do not support the sentence “{name}”",
                "change the sentence in paper.md.j2 and its test in claims.py",
            )
