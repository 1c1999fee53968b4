"""Each type of scene gives the same bits on every processor, and without a compiler.

``python tests/engine/test_bits.py > tests/golden/engine.json`` writes the hashes anew. Other bits
need another ENGINE_VERSION: old results must not be mixed with new ones.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import MISSING, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from command_line import output_of
from numpy.typing import ArrayLike
from scenes import gas, report_scene

from snooker_cli.containers import SHAPES
from snooker_cli.engine import ENGINE_VERSION, replay, series, simulate, simulation
from snooker_cli.laws import LAWS, Constant, Driven, Sides, Thermal, Viscoelastic
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Series, StopReason, Trace, joined

GOLDEN = json.loads(Path(__file__).parents[1].joinpath("golden/engine.json").read_text("utf-8"))


def hash_of(columns: Iterable[ArrayLike], start: str = "") -> str:
    """SHA-256 of a text and of numbers, as little-endian 64 bits."""
    sha = hashlib.sha256(start.encode())
    for column in map(np.asarray, columns):
        sha.update(column.astype("<f8" if column.dtype.kind == "f" else "<i8").tobytes())
    return sha.hexdigest()


NAMES = [field.name for field in fields(Series) if field.default is MISSING]


def observables(columns: Series) -> list[np.ndarray]:
    """The columns that all scenes have."""
    return [getattr(columns, name) for name in NAMES]


def bits(trace: Trace) -> str:
    """A hash of a trace's records, ending and final state."""
    if trace.summary is not None:
        columns = [*observables(trace.summary.series), trace.summary.speed_histogram]
    else:
        events = trace.events
        columns = [events.time, events.i, events.j, events.impulse]
    finish = trace.finish
    columns += [finish.positions, finish.velocities]
    columns += [finish.container_position, finish.container_velocity, trace.stop.time]
    return hash_of([*columns, trace.wall_events, trace.pair_events], trace.stop.reason)


# --- one hash for each type of scene ----------------------------------------------------------


class Case(NamedTuple):
    """A scene, how to simulate it, and how it ends."""

    scene: Callable[[], Scene]
    collisions: int = 2000
    summary: bool = False
    long: bool = False
    stop: StopReason = StopReason.COLLISIONS


def soft(**changes: Any) -> Scene:
    """The report's balls in a fixed circle with a rule that makes some collisions elastic."""
    return replace(report_scene(cor=0.8), **changes)


def sliding(**changes: Any) -> Scene:
    """A dilute gas of the report that slides along the wall after a wall trap."""
    return replace(report_scene(radius=0.1, **{"cor": 0.8, **changes}), slides=True)


circle = partial(gas, "circle", 60, 0.3)
box = partial(gas, "box", 60, 0.3, cor=0.9, aspect=1.5)
periodic = partial(gas, "periodic", 60, 0.3, cor=0.9)
light = partial(circle, mixed=True, cor=0.9, container_mass=20.0)
trapped = partial(report_scene, radius=0.1, cor=0.8)

SIDES = Sides(Thermal(80.0), Driven(0.5, 2.0), Constant(0.7), Viscoelastic(0.9, 9.0))
"""All laws of walls: left, right, bottom and top."""


def heated(scene: Scene, wall_law: Any, *, cor_speed: float | None = None) -> Scene:
    """The scene with another law at the wall, perhaps a CoR of balls that depends on speed."""
    pair_law = scene.pair_law if cor_speed is None else Viscoelastic(scene.restitution, cor_speed)
    return replace(scene, pair_law=pair_law, wall_law=wall_law, wall_key=987654321)


ADVICE = (
    "increase ENGINE_VERSION in snooker_cli/engine/__init__.py if stored runs change, then run "
    "python tests/engine/test_bits.py > tests/golden/engine.json"
)

TRAP, COLLAPSE = StopReason.WALL_TRAP, StopReason.COLLAPSE

# The scenes share the kernels that other tests compile, but for those that take long.
CASES = {
    "circle": Case(partial(circle, cor=0.95)),
    "circle, mixture": Case(partial(circle, cor=0.95, mixed=True)),
    "circle, free": Case(partial(circle, cor=0.95, container_mass=20.0)),
    "circle, free, mixture": Case(light),
    "circle, free, mixture, summary": Case(light, summary=True),
    "circle, elastic": Case(circle),
    "circle, summary": Case(partial(circle, cor=0.95), summary=True),
    "circle, tc": Case(partial(soft, contact_duration=0.1)),
    "circle, elastic below": Case(partial(soft, elastic_below=1.0)),
    "circle, wall trap": Case(trapped, stop=TRAP),
    "circle, sliding": Case(sliding),
    "circle, sliding, summary": Case(sliding, summary=True),
    "circle, driven": Case(lambda: heated(circle(cor=0.9), Driven(0.9, 2.0))),
    "circle, thermal": Case(lambda: heated(circle(cor=0.9), Thermal(20.0), cor_speed=5.0)),
    "circle, viscoelastic": Case(lambda: heated(trapped(), Viscoelastic(0.8, 5.0), cor_speed=5.0)),
    "box": Case(box),
    "box, mixture": Case(partial(box, mixed=True)),
    "box, summary": Case(box, summary=True),
    "box, sides": Case(lambda: heated(box(), SIDES)),
    "channel, driven": Case(
        lambda: heated(gas("channel", 60, 0.3, cor=0.9, aspect=1.5), Driven(0.9, 2.0))
    ),
    "periodic box": Case(periodic),
    "periodic box, elastic": Case(partial(periodic, cor=1.0)),
    "periodic box, summary": Case(periodic, summary=True),
    "periodic box, tc": Case(lambda: replace(periodic(cor=0.6), contact_duration=0.1)),
    "periodic box, collapse": Case(partial(periodic, cor=0.1), 100_000, stop=COLLAPSE),
    "periodic box, mixture": Case(partial(periodic, mixed=True), long=True),
    # Balls are put into the order of their cells after 20 collisions of each.
    "5,000 balls, re-ordered": Case(partial(gas, "periodic", 5000, 0.3, cor=0.98), 110_000),
    "20,000 balls, prefetched": Case(partial(gas, "periodic", 20_000, 0.3, cor=0.98), 5000),
}
SHORT = [name for name, case in CASES.items() if not case.long]


def simulated(name: str) -> Trace:
    """The trace of a case."""
    case = CASES[name]
    return simulate(case.scene(), collisions=case.collisions, summary=case.summary)


def hashes(names: Iterable[str]) -> dict[str, str]:
    """The present engine's hashes of some cases."""
    return {name: bits(simulated(name)) for name in names}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long) if case.long else name
        for name, case in CASES.items()
    ],
)
def test_other_bits_are_another_engine_version(name):
    assert GOLDEN["engine_version"] == ENGINE_VERSION
    trace = simulated(name)
    assert trace.stop.reason is CASES[name].stop
    known = GOLDEN["hashes"].get(name)
    assert bits(trace) == known, f"{name}: {'other bits' if known else 'a new case'}; {ADVICE}"


def test_each_shape_and_each_law_has_a_case():
    scenes = [case.scene() for case in CASES.values() if case.collisions < 5000]
    laws = {law.name for s in scenes for law in (s.pair_law, *s.wall_law.parts)}
    shapes = {scene.container.name for scene in scenes}
    missing = (SHAPES.keys() - shapes) | (LAWS.keys() - laws - {"sides"})
    assert not missing, f"add a case with {missing} to CASES in tests/engine/test_bits.py"


def test_every_hash_has_its_case_and_all_differ():
    differing = GOLDEN["hashes"].keys() ^ CASES.keys()
    assert not differing, f"{differing}: {ADVICE}"
    assert len(set(GOLDEN["hashes"].values())) == len(CASES)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long) if case.long else name
        for name, case in CASES.items()
    ],
)
def test_a_repeat_that_is_continued_has_the_same_bits(name, monkeypatch):
    """Also from arrays in another memory, as they are read from a file."""
    case = CASES[name]
    # Not the chunks of many balls: balls are put into the order of their cells between these.
    monkeypatch.setattr(simulation, "CHUNK", 280 if case.stop is StopReason.COLLISIONS else 30)
    parts: list[Events] = []
    checkpoint, stops = None, 0
    while True:
        trace = simulate(
            case.scene(),
            collisions=case.collisions,
            summary=case.summary,
            sink=parts.append,
            watch=lambda *_: True,
            checkpoint=checkpoint,
        )
        if trace.checkpoint is None:
            break
        assert trace.stop.reason is StopReason.INTERRUPTED
        stops += 1
        checkpoint = {key: values.copy() for key, values in trace.checkpoint.items()}
    assert stops >= 5 or case.collisions == 5000
    whole = trace if case.summary else replace(trace, events=joined(parts))
    assert bits(whole) == GOLDEN["hashes"][name]


# --- other processors, and no compiler --------------------------------------------------------

FEW_EVENTS = (
    "circle",
    "circle, free, mixture",
    "circle, tc",
    "circle, wall trap",
    "circle, sliding",
    "circle, thermal",
    "box, sides",
    "periodic box",
)
"""Cases of which plain Python simulates some events too."""


def all_bits(name: str) -> list[str]:
    """Hashes of a short run, of its replay and series, and of a summary."""
    scene = CASES[name].scene()
    trace = simulate(scene, collisions=250)
    states = replay(trace, [trace.stop.time / 2, trace.stop.time])
    derived = [states.positions, states.container_velocity, *observables(series(trace))]
    return [bits(trace), hash_of(derived), bits(simulate(scene, collisions=60, summary=True))]


def test_plain_python_has_the_same_bits() -> None:
    """Nothing is compiled there."""
    program = f"""
import json, test_bits
print(json.dumps({{name: test_bits.all_bits(name) for name in {FEW_EVENTS}}}))
"""
    plain = json.loads(output_of(program, NUMBA_DISABLE_JIT="1"))
    assert plain == {name: all_bits(name) for name in FEW_EVENTS}


def numpy_found() -> list[str]:
    """Instructions of this processor that NumPy has code of its own for, beside its baseline's."""
    return np.show_config("dicts")["SIMD Extensions"].get("found", [])  # left out if empty


@pytest.mark.skipif(not numpy_found(), reason="NumPy has one code for this processor")
def test_other_instructions_of_numpy():
    """NumPy rounds exp, log and pow as its code for a processor does; no scene may need them."""
    program = """
import json, test_bits as t
print(json.dumps([t.numpy_found(), t.hashes(t.SHORT)]))
"""
    output = output_of(program, NPY_DISABLE_CPU_FEATURES=" ".join(numpy_found()))
    names, of_types = json.loads(output)
    assert names == []
    assert of_types.items() <= GOLDEN["hashes"].items()


@pytest.mark.long
def test_the_most_generic_processor(tmp_path):
    """Compiled anew for a CPU without wide vectors and without fused multiplication."""
    program = """
import json, test_bits
print(json.dumps(test_bits.hashes(["circle", "circle, free, mixture"])))
"""
    output = output_of(program, NUMBA_CPU_NAME="generic", NUMBA_CACHE_DIR=str(tmp_path))
    assert json.loads(output).items() <= GOLDEN["hashes"].items()


if __name__ == "__main__":
    print(json.dumps({"engine_version": ENGINE_VERSION, "hashes": hashes(CASES)}, indent=1))
