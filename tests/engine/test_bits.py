"""The same scene gives the same bits on another CPU, and without a compiler."""

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import digest, mixed_scene, report_scene, same_events, twin_collisions

from snooker_cli.containers import Box, Container, PeriodicBox
from snooker_cli.engine import ENGINE_VERSION, replay, series, simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

TESTS = Path(__file__).parents[1]


def numpy_found() -> list[str]:
    """Instructions of this processor that NumPy has code of its own for, beside its baseline's."""
    return np.show_config("dicts")["SIMD Extensions"].get("found", [])  # left out if empty


FOUND = numpy_found()

DISABLED = {
    "AVX-512": [name for name in FOUND if name == "X86_V4" or name.startswith("AVX512")],
    "all": FOUND,
}
"""Those that NumPy is kept from, so that this processor stands for others."""

SCENES = {
    "fixed": lambda: report_scene(cor=0.9),
    "free": lambda: report_scene(cor=0.9, container_mass=1e7),
    "mixed": lambda: mixed_scene(restitution=0.9),
    "mixed, free": lambda: mixed_scene(50.0, 0.9),
    "into a trap": lambda: report_scene(radius=0.1, cor=0.8, container_mass=1e7),
    "cells": lambda: report_scene(cor=0.9),
    "cells, mixed, free": lambda: mixed_scene(50.0, 0.9),
    "cells, mixed, box": lambda: boxed(mixed_scene(restitution=0.9), Box),
    "cells, periodic": lambda: boxed(report_scene(cor=0.9), PeriodicBox),
}


def boxed(scene: Scene, shape: type[Container]) -> Scene:
    """The same balls in a box as wide as the circle, the first of them at rest."""
    moving = np.arange(scene.number) > 0
    return replace(
        scene,
        velocities=scene.velocities * moving[:, np.newaxis],
        container=shape(20.0, 20.0),
    )


def run(name: str, collisions: int, *, summary: bool = False) -> Trace:
    """A run of one of the scenes, in cells if its name says so."""
    engine = "cells" if name.startswith("cells") else None
    return simulate(SCENES[name](), collisions=collisions, summary=summary, engine=engine)


def bits(name: str) -> list[str]:
    """All bits of a short run and of what is derived from it."""
    trace = run(name, 250)
    states = replay(trace, [trace.stop.time / 2, trace.stop.time])
    columns = series(trace)
    summary = run(name, 60, summary=True).summary
    return [
        digest(trace.events),
        str(trace.stop),
        states.positions.tobytes().hex(),
        states.container_velocities.tobytes().hex(),
        columns.energy_moment.tobytes().hex(),
        summary.series.mean_speed.tobytes().hex(),
        summary.speed_histogram.tobytes().hex(),
    ]


def partly_mixed(name: str) -> Scene:
    """Different radii and equal masses, or the other way round."""
    return replace(mixed_scene(restitution=0.9), **{name: np.full(37, 0.9)})


def first_events(name: str) -> list[list[float]]:
    events = simulate(partly_mixed(name), collisions=30).events
    return [column.tolist() for column in (events.time, events.i, events.j, events.impulse)]


def output_of(program: str, **environment: str) -> str:
    """What a Python process of its own prints; there, every warning is an error."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join(map(str, (TESTS, TESTS / "engine", TESTS.parent)))}
        | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def long_runs() -> list[str]:
    """The digests of 20,000 events with either engine."""
    scenes = {
        "allpairs": report_scene(cor=0.9, wall_cor=1.0),
        "cells": replace(mixed_scene(50.0, 0.9), wall_restitution=1.0),
    }
    return [
        digest(simulate(scene, collisions=20_000, engine=engine).events)
        for engine, scene in scenes.items()
    ]


def test_the_same_bits_twice():
    assert long_runs() == long_runs()


@pytest.mark.long
def test_the_same_bits_on_the_most_generic_processor(tmp_path):
    """Compiled anew for a CPU without wide vectors and without fused multiplication."""
    program = "import test_bits; print(*test_bits.long_runs())"
    generic = output_of(program, NUMBA_CPU_NAME="generic", NUMBA_CACHE_DIR=str(tmp_path))
    assert generic.split() == long_runs()


@pytest.fixture(scope="module")
def plain_python() -> dict[str, Any]:
    """``bits`` and ``first_events`` where nothing is compiled."""
    program = """
import json, test_bits
found = {name: test_bits.bits(name) for name in test_bits.SCENES}
found |= {name: test_bits.first_events(name) for name in ("radii", "masses")}
print(json.dumps(found))
"""
    return json.loads(output_of(program, NUMBA_DISABLE_JIT="1"))


@pytest.mark.parametrize("name", SCENES)
def test_the_same_bits_in_plain_python(plain_python, name):
    assert plain_python[name] == bits(name)


@pytest.mark.parametrize("name", ["radii", "masses"])
def test_plain_python_of_partly_mixed_scenes_is_the_twins(plain_python, name):
    """30 events let rounding grow little."""
    time, i, j, impulse = plain_python[name]
    twin = twin_collisions(partly_mixed(name), 30)
    assert [(event.i, event.j) for event in twin] == list(zip(i, j, strict=True))
    assert [event.time for event in twin] == pytest.approx(time, abs=1e-11)
    assert [event.impulse for event in twin] == pytest.approx(impulse, rel=1e-9)


def test_different_scenes_differ():
    """The comparison can fail."""
    a, b = (simulate(report_scene(repeat), collisions=10).events for repeat in (0, 1))
    assert not same_events(a, b)


# By engine version: the events and the ending of the scenes below, which take no random numbers
# but PCG64's raw ones. Other bits are a new version, for old results must not be mixed with new.
# ``python tests/test_bits.py`` prints the hash.
GOLDEN = {6: "fa8b9b46c379b61dd4027283959810d0c9c3bb8ce24e37d8ab6932a1fd604c0f"}


def golden() -> str:
    """A hash of what this engine gives."""
    found = hashlib.sha256()
    for name in SCENES:
        trace = run(name, 400)
        found.update(f"{digest(trace.events)} {trace.stop.reason} {trace.stop.time!r}".encode())
    return found.hexdigest()


def test_other_bits_are_another_engine_version():
    assert golden() == GOLDEN[ENGINE_VERSION]


if __name__ == "__main__":
    print(golden())
