"""What beside the number of balls decides how long a run takes: recording, cooling, memory."""

from __future__ import annotations

import gc
import statistics
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from snooker_cli import store
from snooker_cli.bench.speed import Case, Effort, Kernel, with_losses
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.engine.engines import REORDERED
from snooker_cli.scene import Scene

COLD = 1e-6
"""Energy of a gas that has cooled, over that of its start."""

PIECE = 2
"""Collisions a ball between two looks at the energy."""

PIECES = 10
"""That make the start and the end of which the speeds are compared."""

LONGEST = 2000
"""Collisions a ball after which a gas that does not get cold is given up."""

PAGE_COUNTS = Path("/proc/self/statm")


@dataclass(frozen=True)
class Recording:
    """What it costs to store every collision, whole runs with their files compared.

    seconds, processor_seconds : medians of runs with events over those with summaries, less one
    spread : lowest and highest of the first, in pairs of runs one after the other
    bytes_an_event : of the file with events
    """

    balls: int
    packing: float
    collisions: int
    repeats: int
    seconds: float
    processor_seconds: float
    spread: tuple[float, float]
    bytes_an_event: float


def recording(case: Case, collisions: int, repeats: int) -> Recording:
    """Simulate and store, with events and with a summary in turn."""
    scene = case.scene()
    times: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "repeat.h5"
        for summary in times:
            _stored(scene, 1, summary, path)
        for _ in range(repeats):
            for summary, found in times.items():
                found.append(_stored(scene, collisions, summary, path))
                if not summary:
                    size = path.stat().st_size
    wall, processor = (
        [one[k] / other[k] - 1 for one, other in zip(times[False], times[True], strict=True)]
        for k in (0, 1)
    )
    return Recording(
        balls=case.balls,
        packing=case.packing,
        collisions=collisions,
        repeats=repeats,
        seconds=statistics.median(wall),
        processor_seconds=statistics.median(processor),
        spread=(min(wall), max(wall)),
        bytes_an_event=size / collisions,
    )


def _stored(scene: Scene, collisions: int, summary: bool, path: Path) -> tuple[float, float]:
    """Seconds, and processor seconds of all threads, that a run with its file takes."""
    told = store.Provenance("{}", "", "{}", 0, 0, ENGINE_VERSION, "{}", "", "", "", 0.0)
    clock, processor = time.perf_counter(), time.process_time()
    with store.Recorder(path, scene) as recorder:
        trace = simulate(scene, collisions=collisions, summary=summary, sink=recorder.add)
        recorder.finish(trace, told)
    return time.perf_counter() - clock, time.process_time() - processor


@dataclass(frozen=True)
class Cooling:
    """The engine's speed in a gas that has lost all but a millionth of its energy.

    ratio, lowest, highest : of collisions per second at the end and at the start; ``None`` where
        no gas became so cold
    collisions : a ball, until then
    """

    balls: int
    packing: float
    cor: float
    repeats: int
    ratio: float | None
    lowest: float | None
    highest: float | None
    collisions: float | None


def cooling(case: Case, effort: Effort) -> Cooling:
    """Let a gas cool, several times; walls are elastic, so that none is trapped at one."""
    stirred = Kernel(case.scene())
    stirred.advance(effort.stirring * case.balls)
    places, generator = stirred.places(), np.random.default_rng(1)
    found = []
    for _ in range(effort.repeats):
        start = without_rotation(with_losses(places, case.cor, 1.0, generator))
        one = _cooled(Kernel(start), case.balls)
        if one is not None:
            found.append(one)
    ratios, collisions = zip(*found, strict=True) if found else ((), ())
    return Cooling(
        balls=case.balls,
        packing=case.packing,
        cor=case.cor,
        repeats=len(found),
        ratio=statistics.median(ratios) if found else None,
        lowest=min(ratios, default=None),
        highest=max(ratios, default=None),
        collisions=statistics.median(collisions) / case.balls if found else None,
    )


def without_rotation(scene: Scene) -> Scene:
    """The same balls with no angular momentum, which a smooth round wall would conserve.

    With it, a gas that has cooled goes on to turn, at a ten-thousandth of its energy.
    """
    x, y = (scene.positions - scene.container_position).T
    u, v = scene.velocities.T
    turning = np.sum(scene.masses * (x * v - y * u)) / np.sum(scene.masses * (x * x + y * y))
    return replace(scene, velocities=scene.velocities - turning * np.stack([-y, x], axis=1))


def _cooled(kernel: Kernel, balls: int) -> tuple[float, int] | None:
    """The speed when cold over that at the start, and the collisions until cold; or neither."""
    start = _speed(kernel, balls)
    while kernel.energy > COLD:
        done, _ = kernel.advance(PIECE * balls)
        if done < PIECE * balls or kernel.collisions > LONGEST * balls:
            return None
    collisions = kernel.collisions
    return _speed(kernel, balls) / start, collisions


def _speed(kernel: Kernel, balls: int) -> float:
    """Collisions per second over some pieces."""
    done, seconds = kernel.advance(PIECES * PIECE * balls)
    return done / seconds


def memory(case: Case) -> float | None:
    """Bytes a ball that become resident with a scene and its engine; where the system tells."""
    few = replace(case, balls=min(case.balls, 2 * REORDERED))
    Kernel(few.scene()).advance(few.balls)  # compiles, which takes memory too
    gc.collect()
    before = _resident()
    kernel = Kernel(case.scene())
    kernel.advance(case.balls)
    after = _resident()
    return None if before is None or after is None else (after - before) / case.balls


def _resident() -> int | None:
    """Bytes of this process that are in memory, on Linux."""
    try:
        pages = int(PAGE_COUNTS.read_text(encoding="ascii").split()[1])
    except OSError:
        return None
    import resource

    return pages * resource.getpagesize()
