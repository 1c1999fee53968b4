"""Certificates: the events that are certain, what ends them, wrong engines, and an own check."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import certificates
import hostile
import numpy as np
import pytest
import repeating
from command_line import SMALL, Snooker, output_of
from scenes import gas, scene_of

from snooker_cli import runs, store
from snooker_cli.config import load
from snooker_cli.config.template_configs import EXAMPLES
from snooker_cli.engine import replay, simulate
from snooker_cli.laws import Surface
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RunFolder
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, SLIDE, Events, Snapshots, StopReason, Trace
from snooker_cli.validation.methods import rings
from snooker_cli.validation.proof import prove, proven

FRICTION = Surface(0.4, 0.5, 0.3, 0.7, 0.2)
ROUGH = replace(
    rings(number=1, restitution=0.9, container_mass=20.0),
    surface=Surface(0.5, 0.5, 0.3, 0.3, math.inf),
    spins=np.linspace(-5, 6, 7),
)
"""Seven balls that spin, in a light container."""


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Seven balls in a light container, until long after chaos has separated it from the truth."""
    return simulate(rings(number=1, restitution=0.9, container_mass=20.0), collisions=400)


def test_chaos_ends_the_certain_events(trace: Trace) -> None:
    """Bounds grow, and the other event is right from the engine's own places."""
    proof = prove(trace, 1000)
    assert (proof["compared"], proof["verdict"]) == (400, "rounding")
    assert 100 < proof["certain"] < 300
    assert len(proof["events"]) == proof["certain"]
    first, *_, last = proof["bounds"]
    assert 0 < first["time"] < 1e-15 < 1e-6 < last["time"] < 1
    assert 0 < first["place"] < 1e-14 < 1e-6 < last["place"] < 20
    few = prove(trace, 50)
    assert (few["certain"], few["verdict"]) == (50, "all")
    assert few["events"] == proof["events"][:50]


def test_a_repeat_that_ends_at_a_time_has_no_further_event() -> None:
    scene = scene_of([(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)])
    whole = simulate(scene, time=10.0)
    assert (prove(whole, 10)["certain"], prove(whole, 10)["verdict"]) == (1, "all")
    assert whole.events is not None
    none = replace(whole, events=whole.events[:0])
    assert prove(none, 10)["reason"].startswith(
        "event 1 is missing; from snooker's own places, ball 0"
    )


def test_bounces_before_a_slide_are_not_wrong() -> None:
    """While a ball bounces infinitely often, another has an event far away."""
    config = load(EXAMPLES / "sliding.yaml", overrides=["cor=0.9", "collapse=slide"])
    slid = simulate(starting_scene(config.points()[0].config, 0), collisions=500)
    proof = prove(slid, 500)
    assert (proof["verdict"], proof["certain"]) == ("slide", 379)
    assert proof["reason"] == "event 380 is a bounce before a slide, which has no twin"
    assert slid.events is not None
    assert slid.events.j[379] != SLIDE


# Wrong engines

WRONG = """
import math, os, sys
from snooker_cli.cli import main
from snooker_cli.engine import prediction

right = prediction.pair_delay

def wrong(x, y, u, v, contact_squared):
    delay = right(x, y, u, v, contact_squared)
    FAULT
    return delay

prediction.pair_delay = wrong
os.chdir(os.environ["HERE"])
sys.argv = ["snooker", "run", "small.yaml", "--jobs", "1"]
main()
"""

FAULTS = {
    "grazing contacts are missed": """if delay < math.inf:
        x, y = x + u * delay, y + v * delay
        if (x * u + y * v) ** 2 < 0.01 * contact_squared * (u * u + v * v):
            return math.inf""",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_engine_is_found(fault: str, here: Path, snooker: Snooker) -> None:
    """Its files are as good as others to all other checks."""
    (here / "small.yaml").write_text(SMALL, "utf-8")
    output_of(WRONG.replace("FAULT", FAULTS[fault]), HERE=str(here), NUMBA_DISABLE_JIT="1")
    assert snooker("verify", "small").code == 0
    ended = snooker("verify", "small", "--exact", "--point", "1", "--repeat", "2", "--json")
    (proof,) = json.loads(ended.out)["exact"]
    assert (ended.code, proof["verdict"]) == (1, "wrong")
    assert proof["certain"] < 50


def test_events_that_change_places_are_found(finished: Path, snooker: Snooker) -> None:
    """The two successive events of different balls that are nearest in time."""
    run = runs.open_run("small")
    (path,) = run.batches(1)
    repeats = store.read(path)
    trace, header = repeats[0]
    events = trace.events
    assert events is not None
    balls = [
        {i, j} - {CONTAINER} for i, j in zip(events.i.tolist(), events.j.tolist(), strict=True)
    ]
    free = [k for k in range(60) if balls[k].isdisjoint(balls[k + 1])]
    first = min(free, key=lambda k: events.time[k + 1] - events.time[k])
    order = np.arange(len(events))
    order[[first, first + 1]] = first + 1, first
    changed = (column[order] for column in (events.i, events.j, events.impulse))
    wrong = replace(trace, events=Events(events.time, *changed))
    others = [(other.repeat, right) for right, other in repeats[1:]]
    store.write(path, [(header.repeat, wrong), *others], header.provenance)
    assert snooker("verify", "small").code == 0
    ended = snooker("verify", "small", "--exact", "--point", "1", "--json")
    (proof,) = json.loads(ended.out)["exact"]
    assert (ended.code, proof["verdict"], proof["certain"]) == (1, "wrong", first)


FORGED = {
    "impulses halved": hostile.with_traces(lambda trace: scaled(trace, 0.5)),
    "finish halved": hostile.with_traces(
        lambda trace: replace(
            trace, finish=replace(trace.finish, velocities=trace.finish.velocities / 2)
        )
    ),
    "last event dropped": hostile.with_traces(lambda trace: shortened(trace)),
    "later end": hostile.with_traces(
        lambda trace: replace(trace, stop=trace.stop._replace(time=2 * trace.stop.time))
    ),
}
"""Files whose hashes are right, and whose numbers are not."""


def scaled(trace: Trace, factor: float) -> Trace:
    assert trace.events is not None
    return replace(trace, events=replace(trace.events, impulse=factor * trace.events.impulse))


def shortened(trace: Trace, end: float | None = None) -> Trace:
    """The trace before its last event, with the finish that follows from the others.

    end : time of the finish [that of the last event but one], s
    """
    assert trace.events is not None
    at_wall, events = bool(trace.events.at_wall[-1]), trace.events[:-1]
    trace = replace(
        trace,
        stop=trace.stop._replace(time=float(events.time[-1]) if end is None else end),
        events=events,
        wall_events=trace.wall_events - at_wall,
        pair_events=trace.pair_events - (not at_wall),
    )
    states = replay(trace, [trace.stop.time])
    finish = replace(
        trace.finish,
        positions=states.positions[0],
        velocities=states.velocities[0],
        container_position=states.container_position[0],
        container_velocity=states.container_velocity[0],
    )
    return replace(trace, finish=finish)


@pytest.mark.parametrize("name", FORGED)
def test_forged_numbers_are_found(name: str, finished: Path, snooker: Snooker) -> None:
    """Point 1 of the run is elastic, and its repeats end at their number of collisions."""
    (path,) = runs.open_run("small").batches(1)
    assert snooker("verify", "small", "--exact", "--point", "1").code == 0
    FORGED[name](path)
    ended = snooker("verify", "small", "--exact", "--point", "1")
    assert ended.code == 1, ended.out
    read = snooker("verify", "small")
    found_by_reading = name == "last event dropped"
    assert (read.code, "than the config's" in read.out) == (int(found_by_reading), found_by_reading)


EARLY = [reason for reason in StopReason if not reason.complete]


@pytest.mark.parametrize("reason", sorted(set(EARLY) - {StopReason.INTERRUPTED}))
def test_a_forged_ending_is_found(reason: StopReason, finished: Path, snooker: Snooker) -> None:
    """The first events of a repeat that goes on, with a reason why it would end there."""
    (path,) = runs.open_run("small").batches(1)

    def cut(trace: Trace) -> Trace:
        beginning = simulate(trace.start, collisions=60)
        return replace(beginning, stop=beginning.stop._replace(reason=reason))

    hostile.with_traces(cut)(path)
    assert snooker("verify", "small").code == 0
    ended = snooker("verify", "small", "--exact", "--point", "1")
    assert ended.code == 1
    assert f"the stored ending is reason {reason}, time " in ended.out


def proof_of(run: RunFolder) -> dict[str, Any]:
    return proven(run, 0, 0, 1000, lambda items, _label, _total: items)


def test_an_event_that_is_missing_before_the_end_is_found(one_point: str, tmp_path: Path) -> None:
    """Far behind what is certain, in a repeat that ends at a time."""
    run = repeating.made(tmp_path, one_point.replace("collisions: 150", "time: 40"), "repeats=1")
    repeating.done(run)
    proof = proof_of(run)
    assert (proof["verdict"], proof["ending"]) == ("rounding", "simulated")
    (path,) = run.batches(0)

    hostile.with_traces(lambda trace: shortened(trace, trace.stop.time))(path)
    proof = proof_of(run)
    assert proof["verdict"] == "wrong"
    assert proof["reason"].startswith("a new simulation has another finish and number of coll")


SUMMARIES = {
    "summary.series.time": "time",
    "summary.series.kinetic_energy": "kinetic_energy",
    "summary.series.wall_impulse": "wall_impulse",
    "summary.series.mean_speed": "mean_speed",
    "summary.speed_histogram": "speed_histogram",
    "finish.velocities": "finish",
}
"""What is changed, and its word in the reason."""


@pytest.mark.parametrize("record", ["summary", "snapshots"])
def test_forged_summaries_are_found(record: str, one_point: str, tmp_path: Path) -> None:
    """One number of a column, of a state, or of the ending, with right hashes."""
    changes = ["collisions=1000", f"record={record}", "repeats=1"]
    if record == "snapshots":
        changes.append("snapshots=[1, 5, 20]")
    run = repeating.made(tmp_path, one_point.replace("collisions: 150\n", ""), *changes)
    repeating.done(run)
    (path,) = run.batches(0)
    ((trace, _),) = store.read(path)
    good = proof_of(run)
    assert (good["ending"], good["verdict"]) == ("simulated", "rounding")

    def nudged(place: str) -> Trace:
        outer, _, last = place.rpartition(".")
        part: Any = trace
        for name in filter(None, outer.split(".")):
            part = getattr(part, name)
        values = getattr(part, last).copy()
        if values.dtype == np.int64:
            most = int(np.argmax(values[-2]))
            values[-2, [most, most + 1]] += (-1, 1)
        else:
            values.flat[-2] = np.nextafter(values.flat[-2], 0.0)
        changed: Any = replace(part, **{last: values})
        if "series" in outer:
            changed = replace(trace.summary, series=changed)  # type: ignore[type-var]
        return replace(trace, **{outer.split(".")[0]: changed})

    for place, word in SUMMARIES.items():
        forged = nudged(place)
        hostile.with_traces(lambda _, forged=forged: forged)(path)  # type: ignore[misc]
        proof = proof_of(run)
        assert proof["verdict"] == "wrong", place
        assert proof["reason"] == f"a new simulation has another {word} than the stored repeat"
    if trace.snapshots is None:
        return
    states = [trace.snapshots.read(k) for k in range(3)]
    states[1] = replace(states[1], velocities=-states[1].velocities)
    forged = replace(trace, snapshots=Snapshots(trace.snapshots.time, states.__getitem__))
    hostile.with_traces(lambda _: forged)(path)
    assert "another snapshots than" in proof_of(run)["reason"]


@pytest.mark.parametrize("row", [0, 7])
@pytest.mark.parametrize("change", ["sign", "size", "spin"])
def test_forged_impulses_of_rough_balls_are_found(change: str, row: int) -> None:
    trace = simulate(ROUGH, collisions=20)
    assert prove(trace, 20)["verdict"] == "all"
    assert trace.events is not None
    assert trace.events.tangential is not None
    tangential, spins = trace.events.tangential.copy(), trace.finish.spins
    assert spins is not None
    if change == "spin":
        trace = replace(trace, finish=replace(trace.finish, spins=np.roll(spins, row + 1)))
    tangential[row] *= {"sign": -1, "size": 1 + 1e-9, "spin": 1}[change]
    wrong = replace(trace, events=replace(trace.events, tangential=tangential))
    proof = prove(wrong, 20)
    assert proof["verdict"] == "wrong"
    words = "the stored finish" if change == "spin" else f"event {row + 1} is ba"
    assert proof["reason"].startswith(words)


# Certificates


@pytest.mark.parametrize(
    "scene",
    [
        rings(number=1, restitution=0.9, container_mass=20.0),
        gas("box", 7, 0.2, mixed=True, cor=0.9),
        ROUGH,
        replace(gas("box", 7, 0.2, mixed=True, cor=0.9), surface=FRICTION, spins=np.arange(7.0)),
    ],
    ids=["circle", "box", "rough, in a light circle", "rough, in a box"],
)
def test_another_program_can_check_a_certificate(scene: Scene) -> None:
    """And it finds one whose events are in another order, or at another time."""
    proof = json.loads(json.dumps(prove(simulate(scene, collisions=40), 40)))
    assert certificates.check(proof) == proof["certain"] == 40
    rows = proof["events"]
    i, j, middle, radius, exponent = rows[20]
    moved = [i, j, hex(int(middle, 16) + 2 ** (-40 - exponent)), radius, exponent]
    for wrong in ([*rows[:20], moved], [*rows[:20], rows[21]], [*rows[:10], *rows[11:]]):
        with pytest.raises(certificates.CheckError):
            certificates.check(proof | {"events": wrong})


def test_a_certificate_is_kept(
    finished: Path, snooker: Snooker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As long as nothing that it follows from changes."""
    monkeypatch.setenv("SNOOKER_CACHE_DIR", str(tmp_path / "kept"))
    command = ("verify", "small", "--exact", "--point", "1", "--repeat", "2")
    first = snooker(*command, "--json", "--out", "certificate.json")
    assert first.err.startswith("snooker: computing up to 150 events; this takes about a second")
    written = json.loads(Path("certificate.json").read_text("utf-8"))
    assert certificates.check(written | {"events": written["events"][:10]}) == 10
    again = snooker(*command, "--json")
    assert (again.out, again.err) == (first.out, "")
    assert "computing" in snooker(*command, "--collisions", "100").err
    assert "computing" in snooker(*command[:-1], "1", "--json").err


def test_a_summary_is_simulated_again(here: Path, snooker: Snooker) -> None:
    Path("small.yaml").write_text(SMALL, "utf-8")
    snooker("run", "small.yaml", "-o", "record=summary", "-o", "repeats=1", "--out", "summary")
    ended = snooker("verify", "summary", "--exact", "--json")
    assert [proof["certain"] for proof in json.loads(ended.out)["exact"]] == [150, 114]


def test_an_interrupt_keeps_what_is_known(trace: Trace) -> None:
    def counting(items: Any, _label: str, _total: int) -> Iterator[Any]:
        yield from islice(items, 20)
        raise KeyboardInterrupt

    proof = prove(trace, 100, counting)
    assert (proof["certain"], proof["verdict"]) == (20, "interrupted")
