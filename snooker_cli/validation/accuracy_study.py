"""Work and precision: what each way to simulate costs, and how wrong it is."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli.analysis.observables import (
    losses,
    total_angular_momentum,
    total_energy,
    total_momentum,
)
from snooker_cli.figures import NEUTRAL, FigureData, Layer, Line, Points, Reference, plain
from snooker_cli.formatting import short
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.validation.exact_twin import (
    Horizon,
    Question,
    first_different,
    horizon,
    rms_distance,
    trajectory,
)
from snooker_cli.validation.methods import Method, all_methods
from snooker_cli.validation.reference_scenes import CASES, Case, rings
from snooker_cli.validation.study import machine, origin

if TYPE_CHECKING:
    from snooker_cli.scene import Scene
    from snooker_cli.validation.methods import Method, Trajectory


# What a course must keep, whatever its trajectory: energy, momentum, angular momentum.


@dataclass(frozen=True)
class ConservationErrors:
    """How far the books are out, each as a part of what there was at the start.

    energy : change of kinetic energy and the losses that the impulses stand for
    momentum : of balls and container, over the sum of the balls' |p|; ``None`` if it is fixed
    angular_momentum : about the origin, over the sum of the balls' |x||p|
    """

    energy: float
    momentum: float | None
    angular_momentum: float


def ledger(course: Trajectory) -> ConservationErrors:
    """The books of a course in a circle."""
    start, finish, events = course.start, course.finish, course.events
    speeds = np.sqrt(np.sum(start.velocities**2, axis=1))
    arms = np.sqrt(np.sum(start.positions**2, axis=1))
    energy = total_energy(finish) - total_energy(start) + losses(start, events)
    momentum = np.sqrt(np.sum((total_momentum(finish) - total_momentum(start)) ** 2))
    turned = abs(total_angular_momentum(finish) - total_angular_momentum(start))
    return ConservationErrors(
        energy=abs(energy) / total_energy(start),
        momentum=float(momentum / np.sum(start.masses * speeds)) if start.free else None,
        angular_momentum=turned / float(np.sum(start.masses * arms * speeds)),
    )


CHECKPOINTS = (1, 2, 5, 10, 20, 50, 100, 150, 200, 300, 500)
"""The events after which errors of place are taken, those that a scene has."""

MOST_RUNS, ENOUGH = 5, 1.0
"""A method is timed so often, or until its runs have taken so long, s."""


@dataclass(frozen=True)
class Plan:
    """What to measure.

    cases, steps : scenes with an exact course, and the steps of time stepping for them, s
    ensembles, repeats, ensemble_steps : averages over so many repeats, with these steps, s
    questions : how far ahead scenes can be computed
    """

    cases: tuple[Case, ...]
    steps: tuple[float, ...]
    ensembles: tuple[RepeatBias, ...]
    repeats: int
    ensemble_steps: tuple[float, ...]
    questions: tuple[Question, ...]


@dataclass(frozen=True)
class Result:
    """A method on a scene.

    seconds, runs : processor time, the median of so many runs
    events_per_second : the exact twin's events over ``seconds``
    collisions : events until the scene's end
    first_different : events before the first in which other bodies collide than in truth
    place_errors : m, root mean square over the balls, at the checkpoints' true times
    """

    method: str
    step: float | None
    seconds: float
    runs: int
    events_per_second: float
    collisions: int
    first_different: int
    place_errors: tuple[float, ...]
    overlap: float
    ledger: ConservationErrors


@dataclass(frozen=True)
class Study:
    """The methods on one scene; ``time`` in s is between its last event and the next."""

    name: str
    what: str
    balls: int
    collisions: int
    certain: int
    digits: int
    check_digits: int
    time: float
    checkpoints: tuple[int, ...]
    results: tuple[Result, ...]


def full_plan() -> Plan:
    """The plan of ``snooker bench error``: a minute or two."""
    elastic = RepeatBias("report", "the report's scene, elastic", 1.0, rings)
    cooling = RepeatBias(
        "report-cor-0.8",
        "the report's scene, cor 0.8",
        1.0,
        lambda repeat: rings(repeat, restitution=0.8),
    )
    return Plan(
        cases=_cases("report", "report-cor-0.8", "dilute", "mixture"),
        steps=(1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        ensembles=(elastic, cooling),
        repeats=128,
        ensemble_steps=(1e-2, 1e-3, 1e-4),
        questions=(
            Question("report", "the report's scene, elastic", 0.041, 2, rings),
            Question("dilute", "with balls of 0.1 m", 0.196, 4, lambda k: rings(k, radius=0.1)),
        ),
    )


def quick_plan() -> Plan:
    """The same for seven balls, in seconds: to see that it works, not to be quoted."""

    def seven(repeat: int) -> Scene:
        return rings(repeat, number=1, restitution=0.9)

    (light,) = _cases("light-container")
    return Plan(
        cases=(Case(light.name, light.what, 50, light.start),),
        steps=(1e-2, 1e-3, 1e-4),
        ensembles=(RepeatBias("seven", "seven balls, cor 0.9", 2.0, seven),),
        repeats=4,
        ensemble_steps=(1e-2, 1e-3),
        questions=(Question("seven", "seven balls", 0.30, 1, lambda k: rings(k, number=1)),),
    )


def measured(plan: Plan, tell: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Carry out a plan; the measurement, with where and when it was made, as JSON has it.

    tell : is told what is about to be done
    """
    began = datetime.now(UTC)
    studies, biases, horizons = [], [], []
    for case in plan.cases:
        tell(case.what)
        studies.append(asdict(study(case, all_methods(plan.steps))))
    for ensemble in plan.ensembles:
        tell(f"averages over {plan.repeats} repeats, {ensemble.what}")
        found = averages(ensemble, all_methods(plan.ensemble_steps), plan.repeats)
        biases.append(_averaged(ensemble, plan.repeats, found))
    for question in plan.questions:
        tell(f"how far ahead, {question.what}")
        each = [horizon(question, repeat) for repeat in range(question.repeats)]
        horizons.append(_asked(question, each))
    record = origin("error against cost", began, "numpy", "numba", "mpmath") | {
        "scenes": studies,
        "ensembles": biases,
        "horizons": horizons,
    }
    as_json: dict[str, Any] = plain(record)
    return as_json


def study(case: Case, ways: Sequence[Method]) -> Study:
    """The methods on one scene, against the exact twin."""
    scene = case.start()
    truth = trajectory(scene, case.collisions + 1)
    collisions = len(truth.events) - 1
    events, time = truth.events, truth.events.time
    # Between its last event and the next, so that no rounding decides which of them are in.
    end = float(time[collisions - 1] + time[collisions]) / 2
    checkpoints = tuple(sorted({k for k in CHECKPOINTS if k < collisions} | {collisions}))
    places = truth.states[list(checkpoints), :-1, :2]
    moments = np.append(time[[k - 1 for k in checkpoints]], end)
    results = []
    for way in ways:
        way.run(scene, moments[:1])  # compiles what it needs
        course = way.run(scene, moments)
        seconds = [course.seconds]
        while len(seconds) < MOST_RUNS and sum(seconds) < ENOUGH:
            seconds.append(way.run(scene, moments).seconds)
        median = statistics.median(seconds)
        errors = rms_distance(course.positions[:-1], places)
        results.append(
            Result(
                method=way.name,
                step=way.step,
                seconds=median,
                runs=len(seconds),
                events_per_second=collisions / median,
                collisions=len(course.events),
                first_different=min(first_different(course.events, events), collisions),
                place_errors=tuple(errors.tolist()),
                overlap=course.overlap,
                ledger=ledger(course),
            )
        )
    return Study(
        name=case.name,
        what=case.what,
        balls=scene.number,
        collisions=collisions,
        certain=min(truth.certain, collisions),
        digits=truth.digits,
        check_digits=truth.check_digits,
        time=end,
        checkpoints=checkpoints,
        results=tuple(results),
    )


def _averaged(ensemble: RepeatBias, repeats: int, found: Sequence[Averages]) -> dict[str, Any]:
    return {
        "name": ensemble.name,
        "what": ensemble.what,
        "time": ensemble.time,
        "repeats": repeats,
        "methods": [asdict(one) for one in found],
    }


def _asked(question: Question, found: Sequence[Horizon]) -> dict[str, Any]:
    exponents = [one.exponent for one in found]
    return {
        "name": question.name,
        "what": question.what,
        "exponent": question.exponent,
        "estimate": question.estimate,
        "median": statistics.median(one.parted for one in found),
        "mean_exponent": statistics.fmean(exponents),
        "repeats": [asdict(one) for one in found],
    }


def _cases(*names: str) -> tuple[Case, ...]:
    """Cases of the catalogue by name."""
    return tuple(case for name in names for case in CASES if case.name == name)


# What a method does to averages over many starts, where no trajectory can be compared.

ROUNDING = 1e-9
"""No overlap that rounding makes is deeper, m: a collision came late or not at all."""


@dataclass(frozen=True)
class RepeatBias:
    """Starts, a repeat each, that are followed for the same time, s."""

    name: str
    what: str
    time: float
    start: Callable[[int], Scene]


@dataclass(frozen=True)
class Bias:
    """A quantity's mean over the repeats, and how far it is from the first method's.

    Standard errors over the repeats. The difference is taken repeat by repeat: both start alike, so
    that its error is smaller than that of the means.
    """

    quantity: str
    mean: float
    error: float
    difference: float
    difference_error: float


@dataclass(frozen=True)
class Averages:
    """A method's averages, the deepest overlap in any of its repeats, m, and how many overlap."""

    method: str
    step: float | None
    biases: tuple[Bias, ...]
    overlap: float
    overlapping: int


def averages(ensemble: RepeatBias, methods: Sequence[Method], repeats: int) -> list[Averages]:
    """The averages of each method; the others are set against the first."""
    found: list[Averages] = []
    moments = np.array([ensemble.time])
    columns: dict[str, np.ndarray] = {}
    for method in methods:
        rows, overlaps = [], []
        for repeat in range(repeats):
            course = method.run(ensemble.start(repeat), moments)
            rows.append(quantities(course, ensemble.time))
            overlaps.append(course.overlap)
        values = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        columns = columns or values
        biases = tuple(
            Bias(name, *_mean(value), *_mean(value - columns[name]))
            for name, value in values.items()
        )
        overlapping = sum(overlap > ROUNDING for overlap in overlaps)
        found.append(Averages(method.name, method.step, biases, max(overlaps), overlapping))
    return found


def quantities(course: Trajectory, time: float) -> dict[str, float]:
    """Averages of one repeat over a time, s.

    The decay constant, k = ln(E(0)/E(t))/t of balls and container, is left out where all collisions
    are elastic.
    """
    start, events = course.start, course.events
    at_wall = events.at_wall
    found = {
        "pressure, Pa m": float(np.sum(events.impulse[at_wall]))
        / (start.container.wall_length * time),
        "collisions, 1/s": len(events) / time,
    }
    if min(start.restitution, start.wall_restitution) == 1:
        return found
    before, after = (each.kinetic_energy + each.container_energy for each in (start, course.finish))
    return {"decay constant, 1/s": math.log(before / after) / time, **found}


def _mean(values: np.ndarray) -> tuple[float, float]:
    """Mean and its standard error."""
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.nan
    return float(np.mean(values)), error


# A saved measurement of ``error`` -> pictures: error against cost, and how errors grow.

Record = dict[str, Any]

COMPARED_AFTER = 100
"""Errors are compared after so many events, or the last before: later, chaos levels them."""


def pictures(measurement: Record) -> list[tuple[str, FigureData]]:
    """Two pictures for each scene of a measurement, each with a name for its files."""
    exponents = {each["name"]: each["exponent"] for each in measurement["horizons"]}
    found = []
    for scene in measurement["scenes"]:
        name, exponent = scene["name"], exponents.get(scene["name"])
        found.append((f"error-against-cost-{name}", against_cost(measurement, scene)))
        found.append((f"error-growth-{name}", growing(measurement, scene, exponent)))
    return found


def against_cost(measurement: Record, scene: Record) -> FigureData:
    """The error of place after some events over the processor time of one event."""
    checkpoints = scene["checkpoints"]
    place = max(k for k, events in enumerate(checkpoints) if events <= COMPARED_AFTER)
    events = checkpoints[place]
    layers: list[Layer] = []
    records = []
    for series, (label, results) in enumerate(_ways(scene)):
        cost = np.array([1e6 * one["seconds"] / scene["collisions"] for one in results])
        error = np.array([one["place_errors"][place] for one in results])
        if len(results) > 1:
            layers.append(Line(cost, error, None, series))
        layers.append(Points(cost, error, label=label, series=series))
        records += [
            {"method": one["method"], "microseconds_per_event": c, "place_error": e}
            for one, c, e in zip(results, cost.tolist(), error.tolist(), strict=True)
        ]
    ours, *others = records
    nearest = min(others, key=lambda one: float(one["place_error"]))
    return FigureData(
        kind="error-against-cost",
        title=f"Error against cost, {scene['what']}",
        x_label="processor time per event (µs)",
        y_label=f"error of place after {events} events (m)",
        layers=tuple(layers),
        caption=f"Root mean square over {scene['balls']} balls, against the exact twin. After "
        f"{events} events snooker is off by {short(ours['place_error'], 2)} m at "
        f"{short(ours['microseconds_per_event'])} µs an event, start and end of a run of "
        f"{scene['collisions']} events included; of the others, {nearest['method']} comes nearest, "
        f"with {short(nearest['place_error'], 2)} m at "
        f"{short(nearest['microseconds_per_event'])} µs. {_origin(measurement)}",
        numbers={"scene": scene["name"], "events": events, "methods": records},
        x_log=True,
        y_log=True,
    )


def growing(measurement: Record, scene: Record, exponent: float | None) -> FigureData:
    """The error of place over the number of events."""
    events = np.array(scene["checkpoints"], dtype=np.float64)
    shown = [
        one
        for _, results in _ways(scene)
        for one in results[:: max(1, len(results) - 1)]  # of many steps, the longest and shortest
    ]
    layers: list[Layer] = [
        Line(events, np.array(one["place_errors"]), one["method"], series)
        for series, one in enumerate(shown)
    ]
    said = ""
    if exponent is not None:
        # From the rounding of a number near 1 up to the balls' own distances.
        end = min(float(events[-1]), math.log(1 / EPSILON) / exponent)
        x = np.linspace(1.0, end, 50)
        y = EPSILON * np.exp(exponent * x)
        layers.append(Line(x, y, f"one rounding, times exp({exponent:g} n)", NEUTRAL, "dashed"))
        said = f"Chaos multiplies an error by exp({exponent:g}) an event. "
    return FigureData(
        kind="error-growth",
        title=f"How errors grow, {scene['what']}",
        x_label="event",
        y_label="error of place (m)",
        layers=(*layers, Reference("y", EPSILON)),
        caption=f"Root mean square over {scene['balls']} balls, against the exact twin, at its "
        f"events. {said}The line across is one rounding of 1 m. {_origin(measurement)}",
        numbers={"scene": scene["name"], "exponent": exponent},
        y_log=True,
    )


def _ways(scene: Record) -> Iterator[tuple[str, Sequence[Record]]]:
    """The methods, with all steps of time stepping as one, from the longest step on."""
    results = scene["results"]
    for one in results:
        if one["step"] is None:
            yield one["method"], [one]
    stepped = sorted((one for one in results if one["step"]), key=lambda one: -one["step"])
    if stepped:
        first, last = stepped[0]["step"], stepped[-1]["step"]
        yield f"time steps of {short(first)} to {short(last)} s", stepped


def _origin(measurement: Record) -> str:
    """Where and when it was measured."""
    return (
        f"Measured on {measurement['date'][:10]} with snooker {measurement['snooker']} on one "
        f"processor: {machine(measurement)}."
    )
