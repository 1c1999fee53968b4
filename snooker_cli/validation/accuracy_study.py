"""``snooker bench error``: what each method to simulate costs, and how wrong it is."""

import math
import statistics
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from snooker_cli.analysis.observables import losses, mean_and_error, total_energy
from snooker_cli.figures.figure_data import NEUTRAL, FigureData, Layer, Line, Points, Reference
from snooker_cli.formatting import short
from snooker_cli.scene import EPSILON
from snooker_cli.validation.exact_twin import trajectory
from snooker_cli.validation.methods import (
    Method,
    Trajectory,
    all_methods,
    first_different,
    imbalance,
    rms_distance,
    start_of,
)
from snooker_cli.validation.study import Record, Step, Study, machine

CHECKPOINTS = (1, 2, 5, 10, 20, 50, 100, 150, 200, 300, 500)
"""Numbers of events after which errors of position are measured."""

COMPARED_AFTER = 100
"""Methods are compared after this many events, or the last checkpoint before: later, chaos makes
all errors alike."""

MOST_RUNS, ENOUGH = 5, 1.0
"""A method is timed at most this often, or until its runs take this long, s."""

LEAST_OVERLAP = 1e-9
"""An overlap that is deeper, m, is not made by rounding: a collision came late or not at all."""


def steps(plan: Record) -> Iterator[Step]:
    """The methods beside the exact twin, and beside each other in averages; see plans.yaml."""
    for scene in plan["scenes"]:
        methods = all_methods(plan["steps"])
        yield Step(scene["description"], "scenes", partial(against_truth, scene, methods))
    time, repeats = plan["time"], plan["repeats"]
    for scene in plan["ensembles"]:
        methods = all_methods(plan["averaged_steps"])
        label = f"averages over {repeats} repeats, {scene['description']}"
        yield Step(label, "ensembles", partial(averages, scene, methods, time, repeats))


def against_truth(known: Record, methods: Sequence[Method]) -> Iterator[Record]:
    """The methods on one scene of plans.yaml, beside the exact twin.

    The record of a method has ``seconds`` (processor time, the median), ``collisions``
    until the end of the scene, events before the ``first_different`` one, and ``place_errors``: m,
    root mean square over the balls, at the exact times of the checkpoints.
    """
    scene = start_of(known)
    truth, states = trajectory(scene, known["collisions"] + 1)
    times = truth.time
    # The end is between two events, so that no rounding decides which events are before it.
    end = float(times[-2] + times[-1]) / 2
    collisions = len(times) - 1
    checkpoints = [k for k in CHECKPOINTS if k < collisions] + [collisions]
    positions = states[checkpoints, :-1, :2]
    moments = np.append(times[[k - 1 for k in checkpoints]], end)
    results = []
    for method in methods:
        method.run(scene, moments[:1])  # compiles the kernels
        course = method.run(scene, moments)
        seconds = [course.seconds]
        # Short runs are timed several times; the median is robust against other processes.
        while len(seconds) < MOST_RUNS and sum(seconds) < ENOUGH:
            seconds.append(method.run(scene, moments).seconds)
        median = statistics.median(seconds)
        results.append(
            {
                "method": method.name,
                "step": method.step,
                "seconds": median,
                "events_per_second": collisions / median,
                "collisions": len(course.events),
                "first_different": min(first_different(course.events, truth), collisions),
                "place_errors": rms_distance(course.positions[:-1], positions),
                "overlap": course.overlap,
                "energy": imbalance(scene, course.finish, losses(scene, course.events))["energy"]
                / total_energy(scene),
            }
        )
    exponent = known.get("exponent")
    yield {
        "name": known["name"],
        "what": known["description"],
        "balls": scene.number,
        "collisions": collisions,
        "exponent": exponent,
        # Events until an error of one rounding is as large as its quantity, ln(1/ε)/λ.
        "horizon": math.log(1 / EPSILON) / exponent if exponent else None,
        "checkpoints": checkpoints,
        "results": results,
    }


def averages(
    known: Record, methods: Sequence[Method], time: float, repeats: int
) -> Iterator[Record]:
    """Averages of each method over repeats, and their differences from the first method's.

    The difference is taken repeat by repeat: both start alike, so its error is smaller than that of
    the means. A method's record also has its deepest overlap, m, and the number of repeats with
    overlaps.
    """
    records: list[Record] = []
    first: dict[str, np.ndarray] = {}
    for method in methods:
        starts = (start_of(known, repeat) for repeat in range(repeats))
        courses = [method.run(start, np.array([time])) for start in starts]
        rows = [quantities(course, time) for course in courses]
        columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        first = first or columns
        biases = []
        for name, values in columns.items():
            means = dict(zip(("mean", "error"), mean_and_error(values), strict=True))
            apart = mean_and_error(values - first[name])
            differences = dict(zip(("difference", "difference_error"), apart, strict=True))
            biases.append({"quantity": name, **means, **differences})
        overlaps = [course.overlap for course in courses]
        records.append(
            {
                "method": method.name,
                "step": method.step,
                "biases": biases,
                "overlap": max(overlaps),
                "overlapping": sum(overlap > LEAST_OVERLAP for overlap in overlaps),
            }
        )
    about = {"name": known["name"], "what": known["description"]}
    yield about | {"time": time, "repeats": repeats, "methods": records}


def quantities(course: Trajectory, time: float) -> dict[str, float]:
    """Averages of one repeat over a time, s.

    The decay constant is k = ln(E(0)/E(t))/t of balls and container; elastic scenes have none.
    """
    start, events = course.start, course.events
    impulse = float(np.sum(events.impulse[events.at_wall]))
    rates = {
        "pressure, Pa m": impulse / (start.container.wall_length * time),
        "collisions, 1/s": len(events) / time,
    }
    if min(start.restitution, start.wall_restitution) == 1:
        return rates
    decay = math.log(total_energy(start) / total_energy(course.finish)) / time
    return {"decay constant, 1/s": decay, **rates}


def figures(record: Record) -> dict[str, FigureData]:
    """The figures of each scene, by the names of their files."""
    pictures = {}
    for scene in record["scenes"]:
        pictures[f"error-against-cost-{scene['name']}"] = error_against_cost(record, scene)
        pictures[f"error-growth-{scene['name']}"] = error_growth(record, scene)
    return pictures


def error_against_cost(record: Record, scene: Record) -> FigureData:
    """The error of position after some events over the processor time of one event."""
    checkpoint = max(k for k, events in enumerate(scene["checkpoints"]) if events <= COMPARED_AFTER)
    events = scene["checkpoints"][checkpoint]
    layers: list[Layer] = []
    shown: list[dict[str, Any]] = []
    for series, (label, results) in enumerate(_curves(scene)):
        cost = np.array([1e6 * result["seconds"] / scene["collisions"] for result in results])
        error = np.array([result["place_errors"][checkpoint] for result in results])
        if len(results) > 1:
            layers.append(Line(cost, error, None, series))
        layers.append(Points(cost, error, label=label, series=series))
        shown += [
            {"method": result["method"], "microseconds_per_event": x, "place_error": y}
            for result, x, y in zip(results, cost.tolist(), error.tolist(), strict=True)
        ]
    return FigureData(
        kind="error-against-cost",
        title=f"Error against cost, {scene['what']}",
        x_label="processor time per event (µs)",
        y_label=f"error of position after {events} events (m)",
        layers=tuple(layers),
        caption=f"Root mean square over {scene['balls']} balls, beside the exact twin. After "
        f"{events} events snooker's error is {short(shown[0]['place_error'], 2)} m at "
        f"{short(shown[0]['microseconds_per_event'])} µs an event, in a run of "
        f"{scene['collisions']} events with its start and end. {_origin(record)}",
        numbers={"scene": scene["name"], "events": events, "methods": shown},
        x_log=True,
        y_log=True,
    )


def error_growth(record: Record, scene: Record) -> FigureData:
    """The error of position over the number of events."""
    exponent = scene["exponent"]
    events = np.array(scene["checkpoints"], dtype=np.float64)
    # The longest and the shortest of many time steps.
    curves = [results for _, results in _curves(scene)]
    shown = [result for results in curves for result in results[:: max(1, len(results) - 1)]]
    layers: list[Layer] = []
    for series, result in enumerate(shown):
        errors = np.array(result["place_errors"])
        layers.append(Line(events, errors, result["method"], series))
        layers.append(Points(events, errors, series=series))
    chaos = ""
    if exponent is not None:
        # From the rounding of a number near 1 to the distances of the balls.
        x = np.linspace(1.0, min(float(events[-1]), scene["horizon"]), 50)
        label = f"one rounding, times exp({exponent:g} n)"
        layers.append(Line(x, EPSILON * np.exp(exponent * x), label, NEUTRAL, "dashed"))
        chaos = f"Chaos multiplies an error by exp({exponent:g}) an event. "
    return FigureData(
        kind="error-growth",
        title=f"How errors grow, {scene['what']}",
        x_label="event",
        y_label="error of position (m)",
        layers=(*layers, Reference("y", EPSILON, "one rounding of 1 m")),
        caption=f"Root mean square over {scene['balls']} balls, beside the exact twin, at its "
        f"events, at the markers. {chaos}{_origin(record)}",
        numbers={"scene": scene["name"], "exponent": exponent},
        y_log=True,
    )


def _curves(scene: Record) -> Iterator[tuple[str, Sequence[Record]]]:
    """Label and results of each method; all steps of time stepping, the longest first, are one."""
    engine, source, *stepped = scene["results"]
    yield from ((result["method"], [result]) for result in (engine, source))
    steps = [short(result["step"]) for result in stepped]
    yield f"time steps of {steps[0]} to {steps[-1]} s", stepped


def _origin(record: Record) -> str:
    return (
        f"Measured on {record['date'][:10]} with snooker {record['snooker']} on one processor: "
        f"{machine(record)}."
    )


ERROR = Study("error", ("numpy", "numba", "flint"), steps, figures=figures)
