"""``snooker bench speed``: short repeats per second, and collisions per second of several gases."""

import math
import statistics
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from snooker_cli.analysis import run_analysis
from snooker_cli.config import load
from snooker_cli.engine import simulate, simulation
from snooker_cli.errors import UserError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import RunFolder, create
from snooker_cli.runs.execution import Watcher, execute
from snooker_cli.runs.processes import processors
from snooker_cli.scene import Scene
from snooker_cli.validation.study import PLANS, Record, Step, Study, lattice_gas

MASS = 1e7  # mass of a free container, kg; balls have 1 kg


class SpeedCase(NamedTuple):
    """An elastic gas in a circle: a lattice with Maxwell's speeds.

    free : whether the container moves
    """

    balls: int
    packing: float
    free: bool = False

    def scene(self) -> Scene:
        """Its start."""
        container = {"radius": 10.0, "mass": MASS if self.free else math.inf}
        return starting_scene(lattice_gas(container, count=self.balls, packing=self.packing), 0)


def steps(plan: Record) -> Iterator[Step]:
    """The rates: each has a name, its median, lowest and highest value, 1/s."""
    short, gases = plan["short"], [SpeedCase(*case) for case in plan["cases"]]
    measured = partial(short_repeats, short, plan["rounds"])
    yield Step(f"{short:,} short repeats", "rates", measured)
    for number, case in enumerate(gases, start=1):
        gas = f"{case.balls:,} balls at packing {case.packing:g}"
        timed = partial(timing, case, plan["events"], plan["repeats"], plan["stirring"])
        yield Step(f"gas {number} of {len(gases)}: {gas}", "rates", timed)


SPEED = Study("speed", ("numpy", "numba", "h5py"), steps)


def timing(case: SpeedCase, events: int, repeats: int, stirring: int) -> Iterator[Record]:
    """Collisions per second of processor time: the repeats are equal parts of one run.

    The run looks at the clock after each chunk of events. The first chunk includes compiling,
    so it is not timed.

    events : collisions in a repeat; more for many balls, so that the engine sorts them once
    stirring : collisions a ball before timing
    """
    sorting = simulation.REORDER_AFTER * case.balls * (case.balls >= simulation.REORDERED)
    events = max(events, sorting // repeats)
    first = max(stirring * case.balls, simulation.CHUNK)
    looks: list[tuple[int, float]] = []

    def look(collisions: int, _share: float) -> bool:
        looks.append((collisions, time.process_time()))
        return False

    simulate(case.scene(), collisions=first + repeats * events, sink=lambda _: None, watch=look)
    collisions, clock = np.array(looks).T
    # The time at which each part ended is interpolated between two looks.
    edges = first + events * np.arange(repeats + 1)
    container = "free" if case.free else "fixed"
    name = f"collisions/s: {case.balls:,} balls, packing {case.packing:g}, {container}"
    yield {
        "rate": name,
        **_spread(events / np.diff(np.interp(edges, np.cumsum(collisions), clock))),
        **case._asdict(),
        "repeats": repeats,
        "events": events,
    }


def short_repeats(repeats: int, rounds: int) -> Iterator[Record]:
    """Repeats per second of ``rounds`` whole runs, and of the analysis that `snooker fit` makes.

    A small run before them compiles. Raises ``UserError`` if a repeat fails.
    """
    _short_run(2)
    rates = zip(*(_short_run(repeats) for _ in range(rounds)), strict=True)
    for what, of_rounds in zip(("simulated", "analysed"), rates, strict=True):
        yield {
            "rate": f"repeats/s: {repeats:,} of 37 balls, 500 collisions, {what}",
            **_spread(of_rounds),
            "threads": processors(),
            "rounds": rounds,
        }


def _short_run(repeats: int) -> tuple[float, float]:
    """Repeats per second of a run as `snooker run` does it, and of `snooker fit` with its file."""
    loaded = load(PLANS["short_repeats"] | {"repeats": repeats})
    with tempfile.TemporaryDirectory() as folder:
        run = RunFolder(Path(folder, "short"), loaded.config, loaded.points())
        began = time.perf_counter()
        create(run)
        results = execute(run, workers=processors(), watcher=Watcher(), cancelled=threading.Event())
        stored = time.perf_counter()
        if all(result.error is None for result in results):
            run_analysis.fits(run)
        analysed = time.perf_counter()
    if errors := [result.error for result in results if result.error]:
        raise UserError(f"a repeat failed: {errors[0]}", "set TMPDIR to another folder")
    return repeats / (stored - began), repeats / (analysed - stored)


def _spread(rates: Sequence[float]) -> dict[str, float]:
    return {"median": statistics.median(rates), "lowest": min(rates), "highest": max(rates)}
