"""The proof of a repeat: how many of its events are certain, and bounds of their errors.

A certificate has the scene, the true events, and intervals of their times that any program can
check; docs/accuracy.md explains its format.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from importlib import import_module
from itertools import islice
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from snooker_cli import __version__, store
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.engine.replay import Replay, replay
from snooker_cli.errors import StoreError, UnsoundError, UserError, install_advice, notice
from snooker_cli.files import sources_hash
from snooker_cli.formatting import counted, duration, listed, plain
from snooker_cli.laws import RULES
from snooker_cli.results_cache import from_cache
from snooker_cli.runs import RunFolder
from snooker_cli.runs.verification import ADVICE, config_of, origin_fault, simulated_again
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import CONTAINER, SLIDE, StopReason, Trace
from snooker_cli.validation.exact_twin import (
    Collision,
    Floats,
    Interval,
    Twin,
    UndecidedError,
    above,
    follow,
    unsupported_key,
)

Record: TypeAlias = dict[str, Any]
Counting: TypeAlias = Callable[[Iterable[Any], str, int], Iterable[Any]]  # shows how many came

ROUNDINGS = 64
"""As many roundings of places and times may decide what the next event of the engine is."""

ERRORS = {"time": "s", "place": "m", "impulse": "kg m/s"}
"""Of an event's time, of the places of its balls then, and of its impulse: names and units."""

SOURCES = (
    *("validation/exact_twin.py", "validation/proof.py", "runs/*.py", "engine/*.py"),
    *("containers.py", "laws.py"),
)


class OwnEvent(NamedTuple):
    """An event of the engine, s, and its balls and container just after it.

    The other fields are as in ``Events``; what these do not have is 0.
    """

    state: Scene
    time: float
    i: int
    j: int
    impulse: float
    tangential: float = 0.0
    residual: float = 0.0


def own_events(trace: Trace) -> Iterator[OwnEvent]:
    """The engine's events, carried out again."""
    events, start = trace.events, trace.start
    assert events is not None
    run, names = Replay(trace), [name for name in events.columns if name in OwnEvent._fields]
    columns = (events.columns[name].tolist() for name in names)
    for done, row in enumerate(zip(*columns, strict=True), start=1):
        own = dict(zip(names, row, strict=True))
        states = run.all_states(np.array([done]), np.array([own["time"]]))
        yield OwnEvent(states.scene(start, 0), **own)


def prove(
    trace: Trace,
    collisions: int,
    counting: Counting = lambda items, _label, _total: items,
    *,
    limited: bool = True,
) -> Record:
    """The certificate of a repeat's first collisions: its events beside those of the exact twin.

    It ends at the first event that is different. Its ``verdict`` is "all"; "rounding" if that makes
    the next event another one; "wrong" if it does not explain the next event, its time or its
    impulse, or if the end and the finish do not follow from all events; "undecided" if no precision
    decides what is next; "slide", which the twin does not have; or "interrupted". ``ending`` is
    "certain" if the twin shows that no further event is possible up to the end, else empty.

    limited : whether the repeat had a time limit

    Raises ``ValueError`` for a scene that has no exact twin.
    """
    end, began, number = trace.stop, time.process_time(), len(trace.events or ())
    compared = min(number, collisions)
    # Up to the end of such a repeat there must be no further event.
    whole = compared == number and end.reason in (StopReason.TIME, StopReason.NOTHING_LEFT)
    until = end.time if end.reason is StopReason.TIME else np.inf
    verdict, reason, last = (
        "all",
        "",
        OwnEvent(trace.start, 0.0, CONTAINER, CONTAINER, 0.0),
    )
    twin, worst, own = Twin(trace.start), np.zeros(3), own_events(trace)
    bounds: list[list[float]] = []
    rows: list[list[Any]] = []
    try:
        truth = counting(islice(follow(trace.start, until), compared + whole), "", compared)
        for twin, collision in truth:
            event = next(own, None)
            if event is None and not collision.time < until:
                break
            if event is not None and event.j == SLIDE:
                verdict, reason = "slide", "a slide, which has no twin"
                break
            if collision.j == CONTAINER and settles(collision.i, len(rows), trace):
                verdict, reason = "slide", "a bounce before a slide, which has no twin"
                break
            if event is None or (event.i, event.j) != collision[1:3]:
                verdict, reason = difference(last, event, collision, until)
                break
            if reason := wrong_contact(event) or wrong_impulse(last.state, event):
                verdict = "wrong"
                break
            worst, last = np.maximum(worst, errors(event, twin, collision)), event
            rows.append([event.i, event.j, *exactly(collision.time)])
            if len(rows) in (1, 10, 100, 1000, 10_000):
                bounds.append([len(rows), *worst.tolist()])
        else:
            if len(rows) < compared:
                verdict, reason = difference(last, next(own), None, until)
    except UndecidedError as question:
        verdict, reason = "undecided", f"not decided: {question}"
    except KeyboardInterrupt:
        verdict, reason = "interrupted", "not computed"
    if rows and bounds[-1][0] < len(rows):
        bounds.append([len(rows), *worst.tolist()])
    reason = f"event {len(rows) + 1} is {reason}" if reason else ""
    if verdict not in ("wrong", "interrupted") and (fault := wrong_end(trace, limited)):
        verdict, reason = "wrong", fault
    versions = {"snooker": __version__, "engine": ENGINE_VERSION}
    return {
        "certain": len(rows),
        "compared": compared,
        "verdict": verdict,
        "reason": reason,
        "ending": "certain" if whole and verdict == "all" else "",
        "bounds": [dict(zip(("events", *ERRORS), row, strict=True)) for row in bounds],
        "bits": twin.bits,
        "seconds": round(time.process_time() - began, 2),
        "versions": versions | {"python-flint": import_module("flint").__version__},
        "scene": scene_record(trace.start),
        "events": rows,
    }


def settles(ball: int, done: int, trace: Trace) -> bool:
    """Whether a ball bounces until it slides: bounces are no events then, but others may be."""
    events = trace.events
    assert events is not None
    partners = events.j[done:][(events.i[done:] == ball) | (events.j[done:] == ball)]
    return trace.start.slides and (not len(partners) or bool(partners[0] == SLIDE))


def errors(event: OwnEvent, twin: Twin, truth: Collision) -> Floats:
    """Bounds of the errors that ``ERRORS`` names."""
    moment = twin.number(event.time) + event.residual
    apart = (
        twin.nearest(
            twin.balls[k].position(truth.time) - twin.vector(*event.state.positions[k].tolist())
        )
        for k in (event.i, event.j)
        if k != CONTAINER
    )
    places = max(above(abs(way)) for way in apart)
    true = twin.vector(truth.impulse, truth.tangential)
    push = above(abs(twin.vector(event.impulse, event.tangential) - true))
    return np.array([above(abs(moment - truth.time)), places, push])


def wrong_contact(event: OwnEvent) -> str:
    """What is wrong with an event if rounding does not explain the gap of its bodies then."""
    state, i, j = event.state, event.i, event.j
    if j == CONTAINER:
        place, radius = state.positions[[i]] - state.container_position, state.radii[[i]]
        gap = float(state.container.wall_gaps(place, radius)[0])
    else:
        offset = state.container.nearest_image(state.positions[i] - state.positions[j])
        gap = float(np.hypot(*offset) - state.radii[i] - state.radii[j])
    wrong = abs(gap) > place_rounding(event)
    return f"{contact_in_words(event.time, i, j)}, with a gap of {gap:.2g} m" if wrong else ""


def wrong_impulse(before: Scene, event: OwnEvent) -> str:
    """What is wrong with an event if rounding does not explain its stored impulses.

    They are compared with the change of velocity and of spin of its lighter ball.
    """
    bodies = [k for k in (event.i, event.j) if k != CONTAINER]
    k = min(bodies, key=lambda ball: float(before.masses[ball]))
    change = event.state.velocities[k] - before.velocities[k]
    impulse, given, mass = float(before.masses[k] * np.hypot(*change)), 0.0, before.masses[k]
    # The impulse is at most twice this mass times the speed of approach.
    velocities = [before.velocities[bodies], event.state.velocities[bodies]]
    speeds = np.hypot(*np.vstack([*velocities, before.container_velocity]).T)
    if before.surface is not None and before.spins is not None and event.state.spins is not None:
        turning = before.radii[bodies] * np.array([before.spins[bodies], event.state.spins[bodies]])
        change = turning[1] - turning[0]
        given = -float(before.surface.inertia * mass * change[bodies.index(k)])
        speeds = np.append(speeds, np.abs(turning))
    rounding = ROUNDINGS * EPSILON * float(mass * np.sum(speeds))
    whole = math.hypot(event.impulse, event.tangential)
    for name, stored, found in (
        ("an", whole, impulse),
        ("a tangential", event.tangential, given),
    ):
        if not abs(stored - found) <= rounding:
            words = f"with {name} impulse of {stored:.6g} kg m/s for {found:.6g} kg m/s"
            return f"{contact_in_words(event.time, event.i, event.j)}, {words}"
    return ""


def wrong_end(trace: Trace, limited: bool) -> str:
    """What is wrong with a repeat whose end and finish do not follow from its stored events.

    limited : whether it had a time limit
    """
    events, stop = trace.events, trace.stop
    assert events is not None
    last = float(events.time[-1]) if len(events) else 0.0
    # Time passes after the last event only up to a limit, which ``origin_fault`` compares.
    waits = (StopReason.TIME, StopReason.NOTHING_LEFT) if limited else ()
    if stop.time != last and stop.reason not in waits:
        return f"the end is at {stop.time:.10g} s, and the last event at {last:.10g} s"
    with suppress(UnsoundError):
        states = replay(trace, [stop.time])
        finish = vars(trace.finish)
        if all(np.array_equal(values[0], finish[name]) for name, values in states.moving.items()):
            return ""
    return "the stored finish is not where the stored events lead"


def place_rounding(event: OwnEvent) -> float:
    """The error of a place that ``ROUNDINGS`` explain, m."""
    state = event.state
    ways = np.hypot(*state.velocities.T) * event.time
    size = np.max(abs(state.positions)) + max(state.container.size) + np.max(ways)
    return float(ROUNDINGS * EPSILON * size)


def difference(
    last: OwnEvent, event: OwnEvent | None, truth: Collision | None, until: float
) -> tuple[str, str]:
    """The verdict "rounding" or "wrong", and why, where the next event is not the true one.

    A twin begins at the engine's own, rounded, places. Rounding explains that the engine is later
    if the two bodies would overlap by no more than a rounding until then, or at all.

    last, event : before the difference, and the next one, if there is one up to a time, s
    """
    own, late, wrong, state = "missing", until, "", last.state
    if event is not None:
        own, late = contact_in_words(event.time, event.i, event.j), event.time
        wrong = wrong_contact(event)
    true = contact_in_words(float(truth.time), truth.i, truth.j) if truth else "none"
    with suppress(UndecidedError):
        for _, near in islice(follow(state), 1):
            moment, speed, overlap = last.time + float(near.time), float(near.speed), np.inf
            if near.j != CONTAINER:
                relative = np.hypot(*(state.velocities[near.i] - state.velocities[near.j]))
                overlap = (state.radii[near.i] + state.radii[near.j]) * (speed / relative) ** 2 / 2
            if min((late - moment) * speed, overlap) > place_rounding(last):
                follows = contact_in_words(moment, near.i, near.j)
                wrong = f"{own}; from snooker's own places, {follows} follows"
    if wrong:
        return "wrong", f"{wrong}; the true one is {true}"
    return "rounding", f"{own}; the true one is {true}: rounding, enlarged by chaos, decides"


def contact_in_words(moment: float, i: int, j: int) -> str:
    bodies = f"ball {i} and the wall" if j == CONTAINER else f"balls {i} and {j}"
    return f"{bodies} at {moment:.10g} s"


def exactly(interval: Interval) -> list[Any]:
    """An interval as [m, r, e]: from (m - r) 2^e to (m + r) 2^e; m and r hexadecimal texts."""
    (middle, first), (radius, second) = interval.mid().man_exp(), interval.rad().man_exp()
    exponent = min(int(first), int(second)) if radius else int(first)
    radius = int(radius) << max(int(second) - exponent, 0)
    return [hex(int(middle) << (int(first) - exponent)), hex(radius), exponent]


def scene_record(scene: Scene) -> Record:
    """A scene as JSON has it; doubles are read back to the bit, an infinite mass is null."""
    record: Record = plain(
        {
            name: value
            for name, value in vars(scene).items()
            if isinstance(value, np.ndarray | float)
        }
    )
    container = {"shape": scene.container.name, **scene.container.lengths}
    rules = RULES.dump_python(scene.rules, mode="json")
    return {"container": container, **rules, **record}


def proven(run: RunFolder, point: int, repeat: int, collisions: int, counting: Counting) -> Record:
    """The certificate of a repeat of a run: the one that was kept, or a new one.

    It is made again after a change of the repeat, of the number of collisions, or of this code.

    Raises ``UserError`` if there is no such repeat, no exact twin of its scene, or no python-flint,
    and ``StoreError`` for a file that cannot be used.
    """
    run.chosen(point, repeat)
    status = run.status_of(point, repeat)
    status.raise_if_unusable()
    ((trace, header),) = store.read(status.path, [repeat])
    if key := unsupported_key(trace.start):
        raise UserError(f"{run.name}: --exact cannot follow a scene with {key}")
    try:
        flint = import_module("flint").__version__
    except ModuleNotFoundError:
        raise UserError("python-flint is not installed", install_advice("reference")) from None
    if fault := origin_fault(run, header):
        raise StoreError(status.path, fault, ADVICE)
    digests = header.provenance.digest, run.digests[point]
    about = {"point": point, "repeat": repeat}
    origin = [header.fingerprint, *digests, about, collisions, sources_hash(*SOURCES), flint]
    return from_cache(
        origin,
        lambda: about | _new_proof(run, trace, header, collisions, counting),
        lambda proof: proof["verdict"] != "interrupted",
    )


def _new_proof(
    run: RunFolder, stored: Trace, header: store.RepeatHeader, collisions: int, counting: Counting
) -> Record:
    """What is proven of a stored repeat, without its place in the run."""
    trace, limits = stored, config_of(run, header.provenance)
    summary = trace.events is None
    if summary:
        most = min(trace.collisions, collisions)
        trace = simulate(trace.start, collisions=most, time=limits.time)
    number = min(len(trace.events or ()), collisions)
    # Measured: in a dilute gas each ball may meet many others, and each of them is computed.
    dilution = min(trace.start.mean_free_path / max(trace.start.container.size), 1.0)
    seconds = number * (3e-4 + (1e-6 + 5e-5 * dilution) * trace.start.number)
    notice(f"computing up to {counted(number, 'event')}; this takes about {duration(seconds)}")
    proof: Record = {"stored": header.collisions, "summary": summary}
    proof |= prove(trace, collisions, counting, limited=limits.time is not None)
    if proof["verdict"] not in ("wrong", "interrupted"):
        proof |= rest_checked(run, header, stored, proof["ending"])
    return proof


def rest_checked(run: RunFolder, header: store.RepeatHeader, trace: Trace, ending: str) -> Record:
    """What a certificate says of the ending of a stored repeat, and of what is no event.

    Its ``ending`` is "certain", "number" of the config's collisions, "interrupted", "simulated" by
    this engine again, or "unchecked" where this engine cannot do that. A summary is compared with a
    new simulation, and so is an ending that is not certain and no number of collisions. If they
    differ, there is also the verdict "wrong", and why.
    """
    reason = trace.stop.reason
    simple = {StopReason.COLLISIONS: "number", StopReason.INTERRUPTED: "interrupted"}
    ending = ending or simple.get(reason, "")
    if ending and trace.summary is None:
        return {"ending": ending}
    if not run.can_be_replayed:
        return {"ending": "unchecked"}
    try:
        fault = difference_from_simulation(run, header, trace)
    except KeyboardInterrupt:
        return {"verdict": "interrupted", "reason": "the repeat was not simulated again"}
    return {"ending": "simulated"} | ({"verdict": "wrong", "reason": fault} if fault else {})


def difference_from_simulation(run: RunFolder, header: store.RepeatHeader, trace: Trace) -> str:
    """What of a stored repeat is not as a new simulation gives it; events are not compared."""
    kept, missed, given = trace.snapshots, set[str](), 0

    def compare(moment: float, state: Scene) -> None:
        nonlocal given
        same = kept is not None and given < len(kept) and kept.time[given] == moment
        if not (same and kept and store.scene_hash(kept.read(given)) == store.scene_hash(state)):
            missed.add("snapshots")
        given += 1

    again = simulated_again(
        run, header, watch=lambda *_: False, sink=lambda _: None, states=compare
    )
    if again.stop != trace.stop:
        ends = [stop.known() | {"message": ""} for stop in (trace.stop, again.stop)]
        own, true = (
            ", ".join(f"{name} {value}" for name, value in end.items() if value) for end in ends
        )
        return f"the stored ending is {own}; that of a new simulation is {true}"
    counts = (trace.wall_events, trace.pair_events), (again.wall_events, again.pair_events)
    if counts[0] != counts[1]:
        missed.add("number of collisions")
    if store.scene_hash(again.finish) != store.scene_hash(trace.finish):
        missed.add("finish")
    if given != (0 if kept is None else len(kept)):
        missed.add("snapshots")
    if trace.summary is not None and again.summary is not None:
        held, columns = (
            summary.series.columns | {"speed_histogram": summary.speed_histogram}
            for summary in (trace.summary, again.summary)
        )
        missed |= {name for name in columns if not np.array_equal(columns[name], held[name])}
    if not missed:
        return ""
    return f"a new simulation has another {listed(sorted(missed))} than the stored repeat"
