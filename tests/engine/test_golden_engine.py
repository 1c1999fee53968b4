"""Bits of the engine's results for each type of scene, against hashes in ``golden/engine.json``.

``python tests/test_golden_engine.py > tests/golden/engine.json`` writes the table anew. Other bits
need another ENGINE_VERSION: old results must not be mixed with new ones.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import astuple, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scenes import gas, report_scene
from test_bits import DISABLED, numpy_found, output_of
from test_bits import GOLDEN as OF_SHORT_RUNS

from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace

GOLDEN = Path(__file__).parents[1].joinpath("golden") / "engine.json"


class Case(NamedTuple):
    """A scene, how to simulate it, and how it ends."""

    scene: Callable[[], Scene]
    collisions: int = 2000
    engine: str | None = None
    summary: bool = False
    long: bool = False
    stop: StopReason = StopReason.COLLISIONS


def soft(**changes: Any) -> Scene:
    """The report's balls in a fixed circle with a rule that makes some collisions elastic."""
    return replace(report_scene(cor=0.8), **changes)


def sliding(**changes: Any) -> Scene:
    """A dilute gas of the report that slides along the wall after a wall trap."""
    return replace(report_scene(radius=0.1, cor=0.8, **changes), slides=True)


circle = partial(gas, "circle", 60, 0.3)
box = partial(gas, "box", 60, 0.3, cor=0.9, aspect=1.5)
periodic = partial(gas, "periodic", 60, 0.3, cor=0.9)
light = partial(circle, mixed=True, cor=0.9, container_mass=20.0)
trapped = partial(report_scene, radius=0.1, cor=0.8)

TRAP, COLLAPSE = StopReason.WALL_TRAP, StopReason.COLLAPSE

# The scenes share the kernels that other tests compile, but for those that take long.
CASES = {
    "all pairs, fixed": Case(partial(circle, cor=0.95), engine="allpairs"),
    "all pairs, fixed, mixture": Case(partial(circle, cor=0.95, mixed=True), engine="allpairs"),
    "all pairs, free": Case(partial(circle, cor=0.95, container_mass=20.0), engine="allpairs"),
    "all pairs, free, mixture": Case(light, engine="allpairs"),
    "all pairs, elastic": Case(circle, engine="allpairs"),
    "all pairs, summary": Case(partial(circle, cor=0.95), engine="allpairs", summary=True),
    "all pairs, tc": Case(partial(soft, contact_duration=0.1), engine="allpairs"),
    "all pairs, elastic below": Case(partial(soft, elastic_below=1.0), engine="allpairs"),
    "all pairs, wall trap": Case(trapped, engine="allpairs", stop=TRAP),
    "all pairs, sliding": Case(sliding),
    "all pairs, sliding, summary": Case(sliding, summary=True),
    "cells, fixed": Case(partial(circle, cor=0.95), engine="cells"),
    "cells, fixed, summary": Case(partial(circle, cor=0.95), engine="cells", summary=True),
    "cells, free, mixture": Case(light, engine="cells"),
    "cells, free, mixture, summary": Case(light, engine="cells", summary=True),
    "cells, tc": Case(partial(soft, contact_duration=0.1), engine="cells"),
    "cells, elastic below": Case(partial(soft, elastic_below=1.0), engine="cells"),
    "cells, wall trap": Case(trapped, engine="cells", stop=TRAP),
    "box": Case(box),
    "box, mixture": Case(partial(box, mixed=True)),
    "box, summary": Case(box, summary=True),
    "periodic box": Case(periodic),
    "periodic box, elastic": Case(partial(periodic, cor=1.0)),
    "periodic box, summary": Case(periodic, summary=True),
    "periodic box, tc": Case(lambda: replace(periodic(cor=0.6), contact_duration=0.1)),
    "periodic box, collapse": Case(partial(periodic, cor=0.1), 100_000, stop=COLLAPSE),
    "cells, fixed, mixture": Case(partial(circle, cor=0.95, mixed=True), engine="cells", long=True),
    "cells, free": Case(partial(circle, cor=0.95, container_mass=20.0), engine="cells", long=True),
    "periodic box, mixture": Case(partial(periodic, mixed=True), long=True),
    # Balls are put into the order of their cells after 20 collisions of each.
    "5,000 balls, re-ordered": Case(partial(gas, "periodic", 5000, 0.3, cor=0.98), 110_000),
    "20,000 balls, prefetched": Case(partial(gas, "periodic", 20_000, 0.3, cor=0.98), 5000),
}


def simulated(name: str) -> Trace:
    """The trace of a case."""
    case = CASES[name]
    return simulate(
        case.scene(), collisions=case.collisions, engine=case.engine, summary=case.summary
    )


def bits(trace: Trace) -> str:
    """SHA-256 of a trace's records, ending and final state; of numbers as little-endian 64 bits."""
    if trace.summary is not None:
        columns = [*astuple(trace.summary.series), trace.summary.speed_histogram]
    else:
        events = trace.events
        columns = [events.time, events.i, events.j, events.impulse]
    finish = trace.finish
    columns += [finish.positions, finish.velocities]
    columns += [finish.container_position, finish.container_velocity, trace.stop.time]
    columns += [trace.wall_events, trace.pair_events]
    found = hashlib.sha256(trace.stop.reason.encode())
    for column in map(np.asarray, columns):
        found.update(column.astype("<f8" if column.dtype.kind == "f" else "<i8").tobytes())
    return found.hexdigest()


def table(*, long: bool = True) -> dict[str, Any]:
    """What ``golden/engine.json`` holds, of the present engine."""
    names = [name for name, case in CASES.items() if long or not case.long]
    hashes = {name: bits(simulated(name)) for name in names}
    return {"engine_version": ENGINE_VERSION, "hashes": hashes}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long) if case.long else name
        for name, case in CASES.items()
    ],
)
def test_other_bits_are_another_engine_version(name):
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    assert golden["engine_version"] == ENGINE_VERSION
    trace = simulated(name)
    assert trace.stop.reason is CASES[name].stop
    assert bits(trace) == golden["hashes"][name]


@pytest.mark.parametrize("which", DISABLED)
def test_the_same_bits_where_numpy_has_other_instructions(which):
    """NumPy rounds exp, log and pow as its code for a processor does; no scene may need them."""
    if not DISABLED[which]:
        pytest.skip(f"NumPy's code for this processor does not use {which}")
    program = """
import json, test_bits, test_golden_engine
found = [test_bits.numpy_found(), test_bits.golden(), test_golden_engine.table(long=False)]
print(json.dumps(found))
"""
    disabled = " ".join(DISABLED[which])
    found, old, now = json.loads(output_of(program, NPY_DISABLE_CPU_FEATURES=disabled))
    assert found == [name for name in numpy_found() if name not in DISABLED[which]]
    assert old == OF_SHORT_RUNS[ENGINE_VERSION]
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    assert now["hashes"].items() <= golden["hashes"].items()


def test_every_hash_has_its_case_and_all_differ():
    hashes = json.loads(GOLDEN.read_text(encoding="utf-8"))["hashes"]
    assert hashes.keys() == CASES.keys()
    assert len(set(hashes.values())) == len(CASES)


if __name__ == "__main__":
    print(json.dumps(table(), indent=1))
