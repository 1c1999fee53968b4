"""``snooker bench speed``: collisions per second of one thread, cost of storage, and memory."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from snooker_cli import store
from snooker_cli.config import parse
from snooker_cli.engine import ENGINE_VERSION, simulate, simulation
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.validation.study import Cells, Record, Study, header_lines, table

MASS = 1e7
"""Mass of a free container, kg; balls have 1 kg."""

TEMPLATE = """
container: {{radius: 10.0, mass: {mass}}}
balls: {{count: {balls}, packing: {packing}, speed: 10.0, speeds: maxwell}}
cor: 1
collisions: 1
seed: 1
"""

PAGE_COUNTS = Path("/proc/self/statm")


@dataclass(frozen=True)
class SpeedCase:
    """An elastic gas in a circle: a lattice with Maxwell's speeds.

    free : whether the container moves
    engine : "allpairs" or "cells" instead of the automatic choice
    """

    balls: int
    packing: float
    free: bool = False
    engine: str | None = None

    def scene(self) -> Scene:
        """Its start."""
        mass = MASS if self.free else ".inf"
        text = TEMPLATE.format(balls=self.balls, packing=self.packing, mass=mass)
        return starting_scene(parse(text).experiment, 0)


LIKE_THE_SOURCE_REPORT = tuple(
    SpeedCase(37, packing, free) for packing in (0.37, 0.0037) for free in (True, False)
)
MANY = (
    *(SpeedCase(1000, packing) for packing in (0.004, 0.04, 0.2, 0.4, 0.55, 0.7)),
    *(SpeedCase(37, packing) for packing in (0.04, 0.2)),
    SpeedCase(1000, 0.4, free=True),
    SpeedCase(100_000, 0.4),
)
MOST = SpeedCase(1_000_000, 0.4)
BOTH_ENGINES = tuple(
    SpeedCase(balls, packing, free, engine)
    for packing in (0.4, 0.004)
    for free in (False, True)
    for balls in (19, 37, 61, 127, 217, 397)
    for engine in ("allpairs", "cells")
)
"""Numbers of balls around the one up to which all pairs are faster."""


@dataclass(frozen=True)
class SpeedStudy(Study):
    """Which gases to time, and how long.

    events : collisions in a repeat; more for many balls, so that the engine sorts them once
    stirring : collisions a ball before timing
    recorded : collisions of a run that is stored
    resident : the gas whose memory is measured
    """

    name = "speed"
    libraries = ("numpy", "numba", "h5py")

    cases: tuple[SpeedCase, ...] = (*LIKE_THE_SOURCE_REPORT, *MANY, *BOTH_ENGINES)
    resident: SpeedCase = SpeedCase(100_000, 0.4)
    recorded: int = 1_000_000
    events: int = 200_000
    repeats: int = 5
    stirring: int = 10
    quick: bool = False

    def results(self, report: Callable[[str], None]) -> Record:
        """Measure memory, speeds and recording."""
        report(f"memory of {self.resident.balls:,} balls")
        used = {"balls": self.resident.balls, "bytes_a_ball": memory(self.resident)}
        timings = []
        for number, case in enumerate(self.cases, start=1):
            gas = f"{case.balls:,} balls at packing {case.packing:g}"
            report(f"gas {number} of {len(self.cases)}: {gas}")
            timings.append(self.timing(case))
        report("recording")
        stored = recording(SpeedCase(37, 0.37, free=True), self.recorded, self.repeats)
        return {"cases": timings, "recording": stored, "memory": used}

    def events_of(self, case: SpeedCase) -> int:
        """Collisions in a repeat of a case."""
        sorting = simulation.REORDER_AFTER * case.balls * (case.balls >= simulation.REORDERED)
        return max(self.events, sorting // self.repeats)

    def timing(self, case: SpeedCase) -> Record:
        """Collisions per second of processor time: the repeats are equal parts of one run.

        The run looks at the clock after each chunk of events. The first chunk includes compiling,
        so it is not timed.
        """
        scene, events = case.scene(), self.events_of(case)
        first = max(self.stirring * case.balls, simulation.CHUNK)
        looks: list[tuple[int, float]] = []

        def look(collisions: int) -> bool:
            looks.append((collisions, time.process_time()))
            return False

        wanted = first + self.repeats * events
        simulate(scene, collisions=wanted, sink=lambda _: None, watch=look, engine=case.engine)
        collisions, clock = np.array(looks).T
        edges = first + events * np.arange(self.repeats + 1)
        rates = events / np.diff(np.interp(edges, np.cumsum(collisions), clock))
        in_cells = simulation.engine_for(scene, case.engine) is simulation.InCells
        return asdict(case) | {
            "engine": "cells" if in_cells else "allpairs",
            "median": np.median(rates),
            "lowest": np.min(rates),
            "highest": np.max(rates),
            "repeats": self.repeats,
            "events": events,
        }

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """Speeds and costs."""
        yield from header_lines(record)
        yield ""
        yield from table(record["cases"], CELLS, left=("container", "engine"))
        yield ""
        stored, used = record["recording"], record["memory"]
        low, cost, high = (f"{100 * stored[key]:+.0f} %" for key in ("lowest", "median", "highest"))
        yield (
            f"storing every collision instead of a summary, {stored['balls']} balls, "
            f"{stored['collisions']:,} collisions: {cost} time ({low} to {high}), "
            f"{stored['bytes_an_event']:.1f} bytes a collision"
        )
        if used["bytes_a_ball"] is not None:
            yield f"memory with {used['balls']:,} balls: {used['bytes_a_ball']:.0f} bytes a ball"


FULL_STUDY = SpeedStudy()
ALL_STUDY = replace(FULL_STUDY, cases=(*FULL_STUDY.cases, MOST), resident=MOST)
QUICK_STUDY = SpeedStudy(
    cases=(*LIKE_THE_SOURCE_REPORT[1:], *BOTH_ENGINES[:6], SpeedCase(100, 0.4)),
    resident=SpeedCase(5000, 0.4),
    recorded=5000,
    events=20_000,
    repeats=2,
    stirring=2,
    quick=True,
)


# What is measured


def recording(case: SpeedCase, collisions: int, repeats: int) -> Record:
    """What it costs to store every collision: whole runs with events beside runs with summaries.

    Median, lowest and highest are of the ratio of times less one, in pairs of runs. The file has
    ``bytes_an_event``.
    """
    scene = case.scene()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "repeat.h5"
        for summary in (True, False):
            _stored(scene, 1, summary, path)  # compiles the kernels
        costs = []
        for _ in range(repeats):
            of_summary = _stored(scene, collisions, True, path)
            costs.append(_stored(scene, collisions, False, path) / of_summary - 1)
        size = path.stat().st_size
    return {
        "balls": case.balls,
        "packing": case.packing,
        "collisions": collisions,
        "repeats": repeats,
        "median": statistics.median(costs),
        "lowest": min(costs),
        "highest": max(costs),
        "bytes_an_event": size / collisions,
    }


def _stored(scene: Scene, collisions: int, summary: bool, path: Path) -> float:
    """Seconds of a run with its file."""
    provenance = store.Provenance("{}", "", "{}", 0, ENGINE_VERSION, "{}", "", "", "", 0.0)
    began = time.perf_counter()
    with store.Recorder(path) as recorder:
        trace = simulate(scene, collisions=collisions, summary=summary, sink=recorder.add)
        recorder.end(0, trace)
        recorder.finish(provenance)
    return time.perf_counter() - began


def memory(case: SpeedCase) -> float | None:
    """Resident bytes a ball of a run; ``None`` where the system has no count."""
    if not PAGE_COUNTS.exists():
        return None
    few = replace(case, balls=min(case.balls, 2 * simulation.REORDERED))
    simulate(few.scene(), collisions=few.balls)  # compiling takes memory too
    before, during = _resident(), []

    def look(_: int) -> bool:
        during.append(_resident())
        return False

    simulate(case.scene(), collisions=case.balls, sink=lambda _: None, watch=look)
    return (max(during) - before) / case.balls


def _resident() -> int:
    """Resident bytes of this process, on Linux."""
    import resource

    return int(PAGE_COUNTS.read_text(encoding="ascii").split()[1]) * resource.getpagesize()


# The record as a table

CELLS: Cells = {
    "balls": lambda case: f"{case['balls']:,}",
    "packing": lambda case: f"{case['packing']:g}",
    "container": lambda case: "free" if case["free"] else "fixed",
    "engine": lambda case: str(case["engine"]),
    "collisions/s": lambda case: f"{case['median'] / 1e6:.2f} M",
    "lowest to highest": lambda c: f"{c['lowest'] / 1e6:.2f} to {c['highest'] / 1e6:.2f} M",
    "repeats": lambda case: str(case["repeats"]),
    "collisions each": lambda case: f"{case['events']:,}",
}
