"""``snooker bench error``: what each method to simulate costs, and how wrong it is."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from snooker_cli.analysis.observables import (
    losses,
    mean_and_error,
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.engine import replay, simulate
from snooker_cli.figures import NEUTRAL, FigureData, Layer, Line, Points, Reference
from snooker_cli.formatting import Column, counted, short, table_lines, with_error
from snooker_cli.scene import EPSILON
from snooker_cli.validation.exact_twin import trajectory
from snooker_cli.validation.methods import (
    Method,
    Trajectory,
    all_methods,
    first_different,
    rms_distance,
)
from snooker_cli.validation.reference_scenes import SCENES, ReferenceScene, rings
from snooker_cli.validation.study import Record, Study, header_lines, machine, small

CHECKPOINTS = (1, 2, 5, 10, 20, 50, 100, 150, 200, 300, 500)
"""Numbers of events after which errors of position are measured."""

COMPARED_AFTER = 100
"""Methods are compared after this many events, or the last checkpoint before: later, chaos makes
all errors alike."""

MOST_RUNS, ENOUGH = 5, 1.0
"""A method is timed at most this often, or until its runs take this long, s."""

ROUNDING = 1e-9
"""An overlap that is deeper, m, is not made by rounding: a collision came late or not at all."""

SMALL, LARGE = 1e-13, 1e-3
"""The Lyapunov exponent is fitted where errors of position, m, are between these."""


@dataclass(frozen=True)
class AccuracyStudy(Study):
    """The methods beside the exact twin, and beside each other in averages.

    scenes, steps : followed event by event; the steps of time stepping for them, s
    ensembles, averaged_steps : averages over ``repeats`` starts and ``time`` (s); the steps, s
    horizons : for these scenes and numbers of repeats, how far ahead they can be predicted
    """

    name = "error"
    title = "error against cost"
    libraries = ("numpy", "numba", "mpmath")

    scenes: tuple[ReferenceScene, ...]
    steps: tuple[float, ...]
    ensembles: tuple[ReferenceScene, ...]
    averaged_steps: tuple[float, ...]
    time: float
    repeats: int
    horizons: tuple[tuple[ReferenceScene, int], ...]
    quick: bool = False

    def results(self, report: Callable[[str], None]) -> Record:
        """Measure scenes, ensembles and horizons."""
        found: dict[str, list[Record]] = {"scenes": [], "ensembles": [], "horizons": []}
        for scene in self.scenes:
            report(scene.description)
            found["scenes"].append(against_truth(scene, all_methods(self.steps)))
        for scene in self.ensembles:
            report(f"averages over {self.repeats} repeats, {scene.description}")
            methods = averages(scene, all_methods(self.averaged_steps), self.time, self.repeats)
            found["ensembles"].append(
                {
                    "name": scene.name,
                    "what": scene.description,
                    "time": self.time,
                    "repeats": self.repeats,
                    "methods": methods,
                }
            )
        for scene, repeats in self.horizons:
            report(f"how far ahead, {scene.description}")
            found["horizons"].append(horizon(scene, repeats))
        return found

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """The methods on each scene, averages, and horizons."""
        yield from header_lines(record)
        yield ""
        yield LEGEND
        for scene in record["scenes"]:
            yield ""
            yield from _scene_lines(scene)
        for ensemble in record["ensembles"]:
            yield ""
            yield from _ensemble_lines(ensemble)
        yield ""
        yield from _horizon_lines(record["horizons"])

    @staticmethod
    def figures(record: Record) -> dict[str, FigureData]:
        """Two figures for each scene."""
        found = {}
        for scene in record["scenes"]:
            found[f"error-against-cost-{scene['name']}"] = error_against_cost(record, scene)
            found[f"error-growth-{scene['name']}"] = error_growth(record, scene)
        return found


def full_study() -> AccuracyStudy:
    """A minute or two of measuring."""
    report, cooling = SCENES["report"], SCENES["report-cor-0.8"]
    return AccuracyStudy(
        scenes=(report, cooling, SCENES["dilute"], SCENES["mixture"]),
        steps=(1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        ensembles=(report, cooling),
        averaged_steps=(1e-2, 1e-3, 1e-4),
        time=1.0,
        repeats=128,
        horizons=((report, 2), (SCENES["dilute"], 4)),
    )


def quick_study() -> AccuracyStudy:
    """The same for seven balls, in seconds."""
    light = SCENES["light-container"]
    lossy = partial(rings, number=1, restitution=0.9)
    return AccuracyStudy(
        scenes=(ReferenceScene(light.name, light.description, 50, light.start),),
        steps=(1e-2, 1e-3, 1e-4),
        ensembles=(ReferenceScene("seven", "seven balls, cor 0.9", 50, lossy),),
        averaged_steps=(1e-2, 1e-3),
        time=2.0,
        repeats=4,
        horizons=((ReferenceScene("seven", "seven balls", 50, partial(rings, number=1), 0.30), 1),),
        quick=True,
    )


# What is measured


@dataclass(frozen=True)
class ConservationErrors:
    """How far a trajectory in a circle violates the conservation laws, over values of the start.

    energy : change of the kinetic energy plus the losses in collisions, over the energy
    momentum : of balls and container, over the sum of the balls' |p|; ``None`` if it is fixed
    angular_momentum : about the origin, over the sum of the balls' |x||p|
    """

    energy: float
    momentum: float | None
    angular_momentum: float


def conservation_errors(course: Trajectory) -> ConservationErrors:
    """The errors of a trajectory in a circle."""
    start, finish = course.start, course.finish
    speeds = np.sqrt(np.sum(start.velocities**2, axis=1))
    arms = np.sqrt(np.sum(start.positions**2, axis=1))
    energy = total_energy(finish) - total_energy(start) + losses(start, course.events)
    momentum = np.sqrt(np.sum((total_momentum(finish) - total_momentum(start)) ** 2))
    turned = abs(total_angular_momentum(finish) - total_angular_momentum(start))
    return ConservationErrors(
        energy=abs(energy) / total_energy(start),
        momentum=float(momentum / np.sum(start.masses * speeds)) if start.free else None,
        angular_momentum=turned / float(np.sum(start.masses * arms * speeds)),
    )


def against_truth(reference: ReferenceScene, methods: Sequence[Method]) -> Record:
    """The methods on one scene, beside the exact twin.

    The record of a method has ``seconds`` (processor time, the median of ``runs``), ``collisions``
    until the end of the scene, events before the ``first_different`` one, and ``place_errors``: m,
    root mean square over the balls, at the exact times of the checkpoints.
    """
    scene, collisions = reference.start(), reference.collisions
    truth = trajectory(scene, collisions + 1)
    times = truth.events.time
    # The end is between two events, so that no rounding decides which events are before it.
    end = float(times[-2] + times[-1]) / 2
    collisions = len(times) - 1
    checkpoints = [k for k in CHECKPOINTS if k < collisions] + [collisions]
    positions = truth.states[checkpoints, :-1, :2]
    moments = np.append(times[[k - 1 for k in checkpoints]], end)
    results = []
    for method in methods:
        method.run(scene, moments[:1])  # compiles the kernels
        course = method.run(scene, moments)
        seconds = [course.seconds]
        while len(seconds) < MOST_RUNS and sum(seconds) < ENOUGH:
            seconds.append(method.run(scene, moments).seconds)
        median = statistics.median(seconds)
        results.append(
            {
                "method": method.name,
                "step": method.step,
                "seconds": median,
                "runs": len(seconds),
                "events_per_second": collisions / median,
                "collisions": len(course.events),
                "first_different": min(first_different(course.events, truth.events), collisions),
                "place_errors": rms_distance(course.positions[:-1], positions),
                "overlap": course.overlap,
                "ledger": asdict(conservation_errors(course)),
            }
        )
    return {
        "name": reference.name,
        "what": reference.description,
        "balls": scene.number,
        "collisions": collisions,
        "certain": min(truth.certain, collisions),
        "digits": truth.digits,
        "check_digits": truth.check_digits,
        "time": end,
        "checkpoints": checkpoints,
        "results": results,
    }


def averages(
    reference: ReferenceScene, methods: Sequence[Method], time: float, repeats: int
) -> list[Record]:
    """Averages of each method over repeats, and their differences from the first method's.

    The difference is taken repeat by repeat: both start alike, so its error is smaller than that of
    the means. A method's record also has its deepest overlap, m, and the number of repeats with
    overlaps.
    """
    found: list[Record] = []
    first: dict[str, np.ndarray] = {}
    for method in methods:
        courses = [
            method.run(reference.start(repeat), np.array([time])) for repeat in range(repeats)
        ]
        rows = [quantities(course, time) for course in courses]
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        first = first or columns
        overlaps = [course.overlap for course in courses]
        found.append(
            {
                "method": method.name,
                "step": method.step,
                "biases": [_bias(name, values, first[name]) for name, values in columns.items()],
                "overlap": max(overlaps),
                "overlapping": sum(overlap > ROUNDING for overlap in overlaps),
            }
        )
    return found


def _bias(quantity: str, values: np.ndarray, first: np.ndarray) -> Record:
    """Mean over repeats and its difference from the first method's, with standard errors."""
    mean, error = mean_and_error(values)
    difference, difference_error = mean_and_error(values - first)
    return {
        "quantity": quantity,
        "mean": mean,
        "error": error,
        "difference": difference,
        "difference_error": difference_error,
    }


def quantities(course: Trajectory, time: float) -> dict[str, float]:
    """Averages of one repeat over a time, s.

    The decay constant is k = ln(E(0)/E(t))/t of balls and container; elastic scenes have none.
    """
    start, events = course.start, course.events
    impulse = float(np.sum(events.impulse[events.at_wall]))
    found = {
        "pressure, Pa m": impulse / (start.container.wall_length * time),
        "collisions, 1/s": len(events) / time,
    }
    if min(start.restitution, start.wall_restitution) == 1:
        return found
    decay = math.log(total_energy(start) / total_energy(course.finish)) / time
    return {"decay constant, 1/s": decay, **found}


def horizon(reference: ReferenceScene, repeats: int) -> Record:
    """How far ahead a scene can be predicted: where the engine and the exact twin diverge."""
    found = [_horizon(reference, repeat) for repeat in range(repeats)]
    return {
        "name": reference.name,
        "what": reference.description,
        "exponent": reference.exponent,
        "estimate": reference.horizon,
        "median": statistics.median(one["parted"] for one in found),
        "mean_exponent": statistics.fmean(one["exponent"] for one in found),
        "repeats": found,
    }


def _horizon(reference: ReferenceScene, repeat: int) -> Record:
    """Events before other bodies collide, and the growth rate of errors, 1/event, in a repeat."""
    scene, collisions = reference.start(repeat), math.ceil(reference.horizon)
    while True:
        truth = trajectory(scene, collisions)
        trace = simulate(scene, collisions=collisions)
        assert trace.events is not None
        parted = first_different(trace.events, truth.events)
        if parted < truth.certain or truth.certain < collisions:
            break
        collisions = math.ceil(1.25 * collisions)
    times = truth.events.time[:parted]
    times = times[times <= trace.stop.time]
    positions = replay(trace, times).positions
    errors = rms_distance(positions, truth.states[1 : len(times) + 1, :-1, :2])
    kept = np.flatnonzero((errors > SMALL) & (errors < LARGE))
    exponent = math.nan
    if len(kept) > 1:
        exponent = float(np.polyfit(kept, np.log(errors[kept]), 1)[0])
    return {
        "repeat": repeat,
        "parted": parted,
        "exponent": exponent,
        "certain": truth.certain,
        "digits": truth.digits,
    }


# The record as tables

LEGEND = """\
events/s: of processor time for a whole short run
m at n: error of position at the exact time of event n, root mean square over the balls
true: events before the first with other bodies; events: how many until the same time
overlap: the deepest of two bodies, or of a ball and the wall
energy, momentum, angular: violation of the conservation law, relative"""


def _scene_lines(scene: Record) -> Iterator[str]:
    """Cost and errors of each method on one scene."""
    collisions, checkpoints = scene["collisions"], scene["checkpoints"]
    yield (
        f"{scene['name']}: {scene['what']}; {counted(collisions, 'event')}, "
        f"{scene['certain']} of them certain in {scene['digits']} digits"
    )
    shown = [k for k, events in enumerate(checkpoints) if events in (10, 100, collisions)]
    headings = (
        "events/s",
        *(f"m at {checkpoints[k]}" for k in shown),
        *("true", "events", "overlap, m", "energy", "momentum", "angular"),
    )
    rows = [
        [
            one["method"],
            f"{one['events_per_second']:,.0f}",
            *(small(one["place_errors"][k]) for k in shown),
            str(one["first_different"]),
            str(one["collisions"]),
            small(one["overlap"]),
            *(small(one["ledger"][name]) for name in ("energy", "momentum", "angular_momentum")),
        ]
        for one in scene["results"]
    ]
    yield from table_lines([Column("method"), *(Column(each, True) for each in headings)], rows)


def _ensemble_lines(ensemble: Record) -> Iterator[str]:
    """Averages over repeats, and their differences from snooker's."""
    yield (
        f"averages of {ensemble['what']}: {ensemble['repeats']} repeats of {ensemble['time']:g} s, "
        "and differences from snooker's, ± standard error"
    )
    first, *_ = ensemble["methods"]
    headings = [each for bias in first["biases"] for each in (bias["quantity"], "difference")]
    rows = [[one["method"]] for one in ensemble["methods"]]
    for row, one in zip(rows, ensemble["methods"], strict=True):
        for bias in one["biases"]:
            difference = with_error(bias["difference"], bias["difference_error"])
            row += [with_error(bias["mean"], bias["error"]), "–" if one is first else difference]
        row += [small(one["overlap"]), str(one["overlapping"])]
    headings += ["overlap, m", "in repeats"]
    yield from table_lines([Column("method"), *(Column(each, True) for each in headings)], rows)


def _horizon_lines(horizons: Sequence[Record]) -> Iterator[str]:
    """How far ahead scenes can be predicted."""
    yield (
        "horizon: events before the first with other bodies than the exact one, beside ln(1/ε)/λ, "
        "where one rounding has grown to 1"
    )
    yield from table_lines(
        [
            Column("scene"),
            Column("event, each repeat"),
            Column("ln(1/ε)/λ", True),
            Column("λ measured, 1/event", True),
            Column("λ known", True),
        ],
        [
            [
                one["name"],
                ", ".join(str(each["parted"]) for each in one["repeats"]),
                f"{one['estimate']:.0f}",
                short(one["mean_exponent"]),
                f"{one['exponent']:g}",
            ]
            for one in horizons
        ],
    )


# The record as figures


def error_against_cost(record: Record, scene: Record) -> FigureData:
    """The error of position after some events over the processor time of one event."""
    checkpoint = max(k for k, events in enumerate(scene["checkpoints"]) if events <= COMPARED_AFTER)
    events = scene["checkpoints"][checkpoint]
    layers: list[Layer] = []
    shown: list[dict[str, Any]] = []
    for series, (label, results) in enumerate(_curves(scene)):
        cost = np.array([1e6 * one["seconds"] / scene["collisions"] for one in results])
        error = np.array([one["place_errors"][checkpoint] for one in results])
        if len(results) > 1:
            layers.append(Line(cost, error, None, series))
        layers.append(Points(cost, error, label=label, series=series))
        shown += [
            {"method": one["method"], "microseconds_per_event": x, "place_error": y}
            for one, x, y in zip(results, cost.tolist(), error.tolist(), strict=True)
        ]
    ours, *others = shown
    nearest = min(others, key=lambda one: float(one["place_error"]))
    return FigureData(
        kind="error-against-cost",
        title=f"Error against cost, {scene['what']}",
        x_label="processor time per event (µs)",
        y_label=f"error of position after {events} events (m)",
        layers=tuple(layers),
        caption=f"Root mean square over {scene['balls']} balls, beside the exact twin. After "
        f"{events} events snooker's error is {short(ours['place_error'], 2)} m at "
        f"{short(ours['microseconds_per_event'])} µs an event, in a run of {scene['collisions']} "
        f"events with its start and end. Of the others, {nearest['method']} is the most accurate: "
        f"{short(nearest['place_error'], 2)} m at {short(nearest['microseconds_per_event'])} µs. "
        f"{_origin(record)}",
        numbers={"scene": scene["name"], "events": events, "methods": shown},
        x_log=True,
        y_log=True,
    )


def error_growth(record: Record, scene: Record) -> FigureData:
    """The error of position over the number of events."""
    exponents = {each["name"]: each["exponent"] for each in record["horizons"]}
    exponent = exponents.get(scene["name"])
    events = np.array(scene["checkpoints"], dtype=np.float64)
    # Of many time steps, the longest and the shortest.
    shown = [one for _, found in _curves(scene) for one in found[:: max(1, len(found) - 1)]]
    layers: list[Layer] = [
        Line(events, np.array(one["place_errors"]), one["method"], series)
        for series, one in enumerate(shown)
    ]
    chaos = ""
    if exponent is not None:
        # From the rounding of a number near 1 to the distances of the balls.
        x = np.linspace(1.0, min(float(events[-1]), math.log(1 / EPSILON) / exponent), 50)
        label = f"one rounding, times exp({exponent:g} n)"
        layers.append(Line(x, EPSILON * np.exp(exponent * x), label, NEUTRAL, "dashed"))
        chaos = f"Chaos multiplies an error by exp({exponent:g}) an event. "
    return FigureData(
        kind="error-growth",
        title=f"How errors grow, {scene['what']}",
        x_label="event",
        y_label="error of position (m)",
        layers=(*layers, Reference("y", EPSILON)),
        caption=f"Root mean square over {scene['balls']} balls, beside the exact twin, at its "
        f"events. {chaos}The line across is one rounding of 1 m. {_origin(record)}",
        numbers={"scene": scene["name"], "exponent": exponent},
        y_log=True,
    )


def _curves(scene: Record) -> Iterator[tuple[str, Sequence[Record]]]:
    """Label and results of each method; all steps of time stepping are one, the longest first."""
    for one in scene["results"]:
        if one["step"] is None:
            yield one["method"], [one]
    stepped = sorted((one for one in scene["results"] if one["step"]), key=lambda one: -one["step"])
    if stepped:
        first, last = stepped[0]["step"], stepped[-1]["step"]
        yield f"time steps of {short(first)} to {short(last)} s", stepped


def _origin(record: Record) -> str:
    """When and where it was measured."""
    return (
        f"Measured on {record['date'][:10]} with snooker {record['snooker']} on one processor: "
        f"{machine(record)}."
    )
