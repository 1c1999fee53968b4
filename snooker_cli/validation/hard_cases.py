"""``snooker bench hard``: scenes that could break an engine.

No ball may be lost or overlap another, every number must be finite, and a run must end and give the
reason.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from snooker_cli.analysis.observables import losses, total_energy
from snooker_cli.config import load
from snooker_cli.config.template_configs import EXAMPLES
from snooker_cli.engine import States, replay, series, simulate
from snooker_cli.engine.frames import NEAR
from snooker_cli.errors import UnsoundError, check_name
from snooker_cli.neighbours import Floats
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs.plan import points_and_classes
from snooker_cli.scene import EPSILON, PLACE, Scene
from snooker_cli.trace import Events, StopReason, Trace, even_choice
from snooker_cli.validation.methods import (
    deepest_overlap,
    farthest_escape,
    imbalance,
)
from snooker_cli.validation.proof import prove
from snooker_cli.validation.study import PLANS, Record, Step, Study

# What must be true of a trace, and how far rounding alone can violate it.
#
# The bounds are for the worst case, in which all roundings have the same sign. They are linear in
# the number of events; measured errors grow as its square root and stay far below.
#
# - A collision takes about ten operations, each exact to half an epsilon of a property of a body:
#   ``OPERATIONS`` epsilon an event, of the energy at the start, the momenta and their arms. The
#   impulse acts along the actual offset, so errors of position do not matter to these three.
# - A contact is the root of a quadratic. It is exact to some epsilon of the distance to it and of
#   the clock: ``PLACE`` epsilon of the largest distances, and of the distance that the fastest
#   body covers until then. A ball that hits the wall several times in a row keeps its distance
#   from the centre with all errors, so these add up until it meets a ball.

OPERATIONS = 16

BUDGET = 1_000_000
"""Pairs of balls, times states, that are checked; of more states, evenly distributed ones."""

FOLLOWED = 300  # events that the exact twin follows
LEAST = 1e-305  # replaces a zero that an error is divided by


class Check(NamedTuple):
    """An error and its bound. An error that is not a number never holds."""

    name: str
    error: float
    bound: float

    @property
    def holds(self) -> bool:
        return self.error <= self.bound


def checks(trace: Trace) -> list[Check]:
    """The checks of any trace; the first is that all numbers are valid, or the only one.

    A summary has no events, so its overlaps are those at the end.
    """
    broken = _broken_numbers(trace)
    results = [Check("numbers", broken, 0.0)]
    if broken:
        return results
    start, finish = trace.start, trace.finish
    try:
        states, flights = _states(trace)
    except UnsoundError:  # a ball is far outside the container
        return [*results, Check("escape", math.inf, 0.0)]
    velocities, positions, masses = states.velocities, states.positions, start.masses
    if start.free:
        velocities = np.hstack([velocities, states.container_velocity[:, np.newaxis]])
        positions = np.hstack([positions, states.container_position[:, np.newaxis]])
        masses = np.append(masses, start.container_mass)
    speeds = np.hypot(*np.moveaxis(velocities, -1, 0))
    own, drifts = _own_speeds(start, velocities)
    flights = np.where((own > 0.0) & (not start.slides), flights, 0.0)
    arms = np.hypot(*np.moveaxis(positions, -1, 0))

    lost = 0.0 if trace.events is None else losses(start, trace.events)
    violations = imbalance(start, finish, lost)
    scales = {}
    elastic = start.restitution == start.wall_restitution == 1.0
    known = start.surface is None and not start.slides
    if known and (trace.events is not None or elastic):
        scales["energy"] = total_energy(start)
    if start.free or not start.container.has_wall:
        scales["momentum"] = float(np.max(speeds @ masses))
    if start.container.keeps_rotation and not (start.surface and start.surface.rubs_wall):
        scales["angular momentum"] = float(np.max((speeds * arms) @ masses))
    rounding = OPERATIONS * EPSILON * (trace.collisions + start.number)
    for name, scale in scales.items():
        results.append(Check(name, violations[name] / max(scale, LEAST), rounding))

    diameter = 2 * float(np.max(start.radii)) if start.number > 1 else 0.0
    clock = float(np.max(own * (states.time + flights)))
    reach = 2 * float(np.max(arms) + drifts * np.max(arms[0]))
    tolerance = PLACE * EPSILON * (reach + diameter + clock)
    results.append(Check("overlap", deepest_overlap(start, states, flights), tolerance))
    if trace.events is not None and start.container.has_wall:
        escape = farthest_escape(start, states)
        results.append(Check("escape", escape, tolerance * (1 + longest_run(trace.events))))
    return results


def _own_speeds(start: Scene, velocities: Floats) -> tuple[Floats, float]:
    """The largest speed beside the common velocity in each state, m/s; and how far balls drift.

    velocities : (*states*, *bodies*, 2), m/s

    Where balls may share a velocity, the engine computes without it as soon as others are NEAR it.
    Until then a ball drifts 1/NEAR times as far as it flies. Later, velocities in the laboratory
    have lost digits that matter for a flight. Then the speed is 0.
    """
    across, up = (True, True) if start.free else start.container.periodic
    if not (across or up):
        return np.max(np.hypot(*np.moveaxis(velocities, -1, 0)), axis=1), 0.0
    common = np.mean(velocities, axis=1, keepdims=True) * (across, up)
    own = np.max(np.hypot(*np.moveaxis(velocities - common, -1, 0)), axis=1)
    shared = np.hypot(*np.moveaxis(common[:, 0], -1, 0))
    return np.where(own > NEAR * shared, own, 0.0), 1.0 / NEAR


def _broken_numbers(trace: Trace) -> float:
    """The number of values that are not finite, negative or out of order."""
    finish = trace.finish
    columns = [finish.positions, finish.velocities, finish.container_position]
    columns += [finish.container_velocity, np.array([trace.stop.time])]
    columns += [np.asarray(column) for column in series(trace).columns.values()]
    broken = sum(int(np.sum(~np.isfinite(column))) for column in columns)
    if trace.events is not None:
        events = trace.events
        broken += int(np.sum(~(events.impulse >= 0))) + int(np.sum(~(np.diff(events.time) >= 0)))
        broken += int(np.sum((events.i < 0) | (events.i >= trace.start.number)))
        broken += int(np.sum(~events.at_wall & (events.j <= events.i)))
    return float(broken + (finish.number != trace.start.number))


def _states(trace: Trace) -> tuple[States, Floats]:
    """States at the start, after each event or some of them, and at the end; of a summary the last.

    The second array has the time of free flight after each, s.
    """
    number, end = trace.start.number, trace.stop.time
    if trace.events is None:
        return States.of([end], [trace.finish]), np.zeros(1)
    times = np.concatenate([[0.0], trace.events.time, [end]])
    pairs = max(1, number * (number - 1) // 2)
    rows = max(2, min(len(times), BUDGET // pairs, BUDGET // number))
    kept = even_choice(len(times), rows)
    return replay(trace, times[kept]), np.diff(times, append=end)[kept]


def longest_run(events: Events) -> int:
    """The largest number of wall hits in a row of one ball."""
    runs, longest = Counter[int](), 0
    columns = (events.i.tolist(), events.j.tolist(), events.at_wall.tolist())
    for i, j, at_wall in zip(*columns, strict=True):
        if at_wall:
            runs[i] += 1
            longest = max(longest, runs[i])
        else:
            runs[i] = runs[j] = 0
    return longest


def _collapses_below(critical: float, trace: Trace) -> Iterator[Check]:
    """A run collapses if, and only if, its restitution is below a critical one."""
    collapsed = trace.stop.reason is StopReason.COLLAPSE
    wrong = collapsed != (trace.start.restitution < critical)
    yield Check("wrong endings", float(wrong), 0)


def galperin(trace: Trace) -> Iterator[Check]:
    """Masses m and 100^k m collide as often as the first k + 1 digits of pi (Galperin 2003)."""
    power = round(math.log(float(trace.start.masses[1] / trace.start.masses[0]), 100))
    expected = int(math.pi * 10**power)
    yield Check("collisions too many or few", abs(trace.collisions - expected), 0)


def random_walk(trace: Trace) -> Iterator[Check]:
    """The roundings of elastic collisions in a fixed circle have random signs.

    Those of n collisions add up to the root of n times one of them, four epsilons of a ball's; six
    standard deviations of that never happen. With equal signs a billion give 5,000 times as much.
    """
    start = trace.start
    walk = 6 * math.sqrt(trace.collisions) * 4 * EPSILON
    energy = total_energy(start)
    drift = float(np.max(abs(series(trace).kinetic_energy - energy)))
    yield Check("drift of energy, of a ball's", drift * start.number / energy, walk)


FACTS: dict[str, Callable[[Trace], Iterator[Check]]] = {
    "two_collapse": partial(_collapses_below, 3 - 2 * math.sqrt(2)),
    "three_collapse": partial(_collapses_below, 7 - 4 * math.sqrt(3)),
    "galperin": galperin,
    "random_walk": random_walk,
}
"""What is known exactly of a run, by the names in plans.yaml."""


FOLDER = EXAMPLES / "hard"  # the configs of the cases

LONGEST, SLOWEST = 60.0, 1e5
"""A run hangs if it takes longer than this time, s, plus its collisions at this rate, 1/s."""

INVARIANTS = ("energy", "momentum", "angular momentum", "overlap", "escape")
"""The checks that most cases have."""


CASES: dict[str, Record] = PLANS["hard"]
"""The cases by the names of their configs; plans.yaml explains what is known of them."""


def hard_plan(names: Sequence[str]) -> Record:
    """The plan of the named cases, or of all but those that take minutes.

    Raises ``UserError`` if there is no such case.
    """
    for name in names:
        check_name(name, CASES, "hard case", "`snooker init --list`")
    of_default = [name for name, known in CASES.items() if not known.get("by_name_only")]
    return {"cases": [*dict.fromkeys(names)] or of_default, "quick": False}


def steps(plan: Record) -> Iterator[Step]:
    """The cases to simulate."""
    for name in plan["cases"]:
        yield Step(f"{name} ...", "cases", partial(verdict, name))


def all_hold(record: Record) -> bool:
    """Whether no case fails."""
    return all(case["holds"] for case in record["cases"])


HARD = Study("hard", ("numpy", "numba", "flint"), steps, passed=all_hold)


def verdict(name: str) -> Iterator[Record]:
    """The row of a case: of its points the worst of each check, ``endings`` and ``faults``."""
    loaded = load(FOLDER / f"{name}.yaml")
    endings: Counter[str] = Counter()
    worst: dict[str, Check] = {}
    events, faults = 0, []
    points, _ = points_and_classes(loaded)
    for point in points:
        config = point.config
        scene = starting_scene(config, 0)
        limit = config.collisions
        deadline = time.monotonic() + LONGEST + (limit or 0) / SLOWEST
        trace = simulate(
            scene,
            collisions=limit,
            time=config.time,
            summary=not config.keeps_events,
            watch=lambda *_, deadline=deadline: time.monotonic() > deadline,
        )
        results, wrong = judged(trace, CASES[name])
        for check in results:
            before = worst.setdefault(check.name, check)
            worst[check.name] = max(before, check, key=lambda c: (not c.holds, c.error))
        endings[trace.stop.reason.value] += 1
        events += trace.collisions
        label = ", ".join(f"{key}={v}" for key, v in point.as_json().items())
        faults += [f"{label}: {fault}" if label else fault for fault in wrong]
    yield {
        "name": name,
        "why": str(loaded.config.title),
        "events": events,
        "runs": endings.total(),
        "endings": [{"reason": reason, "runs": runs} for reason, runs in endings.items()],
        "worst": {
            check.name: {"error": check.error, "bound": check.bound, "holds": check.holds}
            for check in worst.values()
        },
        "holds": not faults,
        "faults": faults,
    }


def judged(trace: Trace, known: Record) -> tuple[list[Check], list[str]]:
    """The checks of a trace, and a sentence for each fault.

    known : what plans.yaml knows of the case
    """
    results = checks(trace)
    if results[0].holds:  # nothing is measured of broken numbers
        if trace.events is not None:
            proof = prove(trace, FOLLOWED)
            results.append(Check("wrong collisions", float(proof["verdict"] == "wrong"), 0.0))
        if "fact" in known:
            results += FACTS[known["fact"]](trace)
    faults = [
        f"{check.name}: {check.error:.2g} is over {check.bound:.2g}"
        for check in results
        if not check.holds
    ]
    reason = trace.stop.reason
    if reason not in known["endings"]:
        faults.append(f"it ended as {reason.value} instead of {' or '.join(known['endings'])}")
    return results, faults
