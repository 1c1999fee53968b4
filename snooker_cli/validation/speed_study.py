"""``snooker bench speed``: short repeats and collisions per second, cost of storage, and memory."""

import json
import math
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from snooker_cli import store
from snooker_cli.config import parse
from snooker_cli.engine import ENGINE_VERSION, simulate, simulate_batch, simulation
from snooker_cli.errors import UNREADABLE, UserError, error_text
from snooker_cli.placement.starting_scene import starting_scene, starting_scenes
from snooker_cli.runs import Run, create
from snooker_cli.runs.batch import Job
from snooker_cli.runs.execution import Watcher, execute, processors
from snooker_cli.runs.plan import batch_size
from snooker_cli.scene import Scene
from snooker_cli.validation.study import Cells, Record, Study, header_lines, table

MASS = 1e7  # mass of a free container, kg; balls have 1 kg

TEMPLATE = """
container: {{radius: 10.0, mass: {mass}}}
balls: {{count: {balls}, packing: {packing}, speed: 10.0, speeds: maxwell}}
cor: 1
collisions: 1
seed: 1
"""

SHORT = """
container: {{radius: 10.0}}
balls: {{rings: 3, radius: 0.1, speed: 10.0}}
cor: 0.9
collisions: 500
repeats: {repeats}
seed: 1
record: {record}
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
    """What to time, and how long.

    short : short repeats in a run; ``rounds`` runs are timed
    earlier : a record to compare with, see ``earlier_record``
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
    short: int = 6000
    rounds: int = 3
    quick: bool = False
    earlier: Record | None = None

    def results(self, report: Callable[[str], None]) -> Record:
        """Measure memory, speeds and recording."""
        report(f"memory of {self.resident.balls:,} balls")
        used = {"balls": self.resident.balls, "bytes_a_ball": memory(self.resident)}
        short = []
        for kept in ("events", "summary"):
            report(f"{self.short:,} short repeats, record: {kept}")
            short.append(short_repeats(kept, self.short, self.rounds))
        timings = []
        for number, case in enumerate(self.cases, start=1):
            gas = f"{case.balls:,} balls at packing {case.packing:g}"
            report(f"gas {number} of {len(self.cases)}: {gas}")
            timings.append(self.timing(case))
        report("recording")
        stored = recording(SpeedCase(37, 0.37, free=True), self.recorded, self.repeats)
        found: Record = {"short_repeats": short, "cases": timings}
        found |= {"recording": stored, "memory": used}
        if self.earlier is not None:
            found["comparison"] = compared(self.earlier, found)
        return found

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
        """Speeds and costs, and the comparison with an earlier record if there is one."""
        yield from header_lines(record)
        yield ""
        yield from table(record["short_repeats"], SHORT_CELLS, left=("record",))
        yield SHARE
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
        if "comparison" in record:
            earlier = record["comparison"]
            yield from ("", "then:", *header_lines(earlier["then"]), "")
            yield from table(earlier["rates"], COMPARISON_CELLS, left=("rate",))


FULL_STUDY = SpeedStudy()
ALL_STUDY = replace(FULL_STUDY, cases=(*FULL_STUDY.cases, MOST), resident=MOST)
QUICK_STUDY = SpeedStudy(
    cases=(*LIKE_THE_SOURCE_REPORT[1:], *BOTH_ENGINES[:6], SpeedCase(100, 0.4)),
    resident=SpeedCase(5000, 0.4),
    recorded=5000,
    events=20_000,
    repeats=2,
    stirring=2,
    short=100,
    rounds=2,
    quick=True,
)


# What is measured


def short_repeats(kept: str, repeats: int, rounds: int) -> Record:
    """Repeats per second of whole runs with the default number of threads.

    kept : what is recorded, "events" or "summary"

    Median, lowest and highest are of ``rounds`` runs after a small one, which compiles.
    ``kernel_share`` is a median too. Raises ``UserError`` if a repeat fails.
    """
    _short_run(kept, 2)
    rates, shares = zip(*(_short_run(kept, repeats) for _ in range(rounds)), strict=True)
    experiment = parse(SHORT.format(record=kept, repeats=repeats)).experiment
    return {
        "balls": starting_scene(experiment, 0).number,
        "collisions": experiment.collisions,
        "record": kept,
        "median": statistics.median(rates),
        "lowest": min(rates),
        "highest": max(rates),
        "kernel_share": statistics.median(shares),
        "repeats": repeats,
        "files": math.ceil(repeats / batch_size(experiment, None)),
        "threads": processors(),
        "rounds": rounds,
    }


def _short_run(kept: str, repeats: int) -> tuple[float, float]:
    """Repeats per second of a run as `snooker run` does it, and the kernel's share.

    The run places balls, simulates and writes files. The share is the processor time of simulating
    the same batches again, without placing and storing, divided by the processor time of the run.
    """
    loaded = parse(SHORT.format(record=kept, repeats=repeats))
    with tempfile.TemporaryDirectory() as folder:
        run = Run(Path(folder, "short"), loaded.experiment, loaded.points())
        began, clock = time.perf_counter(), time.process_time()
        create(run)
        results = execute(run, workers=processors(), watcher=Watcher(), cancelled=threading.Event())
        seconds, of_run = time.perf_counter() - began, time.process_time() - clock
        if failed := [each.error for each in results if each.error]:
            raise UserError(
                f"a repeat in the temporary folder failed: {failed[0]}",
                "make room there, or set TMPDIR to another folder",
            )
        limits = Job(run, "").limits(0)
    (point,) = run.points
    size, of_kernel = batch_size(point.experiment, None), 0.0
    for first in range(0, repeats, size):
        scenes = starting_scenes(point.experiment, range(first, min(first + size, repeats)))
        clock = time.process_time()
        simulate_batch(scenes, **limits)
        of_kernel += time.process_time() - clock
    return repeats / seconds, of_kernel / of_run


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


# Two records side by side


def earlier_record(path: Path) -> Record:
    """The record in a JSON file that ``bench speed`` wrote.

    Raises ``UserError`` if the file cannot be read or is not such a record.
    """
    try:
        record: Record = json.loads(path.read_text(encoding="utf-8"))
        if (study := record["measurement"]) != SpeedStudy.name:
            raise ValueError(f"it has a measurement of `snooker bench {study}`")
        record.pop("comparison", None)
        list(SpeedStudy.tables(record))
        if not all(0 < rate < math.inf for rate in _rates(record).values()):
            raise ValueError("it has a rate that is not positive")
    except (*UNREADABLE, AttributeError) as error:
        raise UserError(
            f"{path}: cannot be compared ({error_text(error)})",
            "give a speed.json that `snooker bench speed --out DIR` wrote",
        ) from None
    return record


def compared(then: Record, now: Record) -> Record:
    """The header of an earlier record, and the rates of both with their ratio now/then.

    A rate is ``None`` where only the other record has its row.
    """
    before, after = _rates(then), _rates(now)
    rates = []
    for name in after | before:
        old, new = before.get(name), after.get(name)
        ratio = None if old is None or new is None else new / old
        rates.append({"rate": name, "then": old, "now": new, "ratio": ratio})
    return {"then": {key: value for key, value in then.items() if key not in now}, "rates": rates}


def _rates(record: Record) -> dict[str, float]:
    """The median rate of each row of the tables, 1/s, by what the row measures."""
    short = {
        f"repeats/s: {one['repeats']:,} of {one['balls']:,} balls, "
        f"{one['collisions']:,} collisions, {one['record']}": one["median"]
        for one in record["short_repeats"]
    }
    gases = {
        f"collisions/s: {one['balls']:,} balls, packing {one['packing']:g}, "
        f"{CELLS['container'](one)}, {one['engine']}": one["median"]
        for one in record["cases"]
    }
    return short | gases


# The record as tables


def _rate(value: float | None) -> str:
    """A rate of repeats or collisions; a dash for none."""
    if value is None:
        return "–"
    return f"{value / 1e6:.2f} M" if value >= 1e5 else f"{value:,.0f}"


SHARE = (
    "kernel: processor time of simulating the same scenes again, without placing and storing, "
    "divided by that of the run"
)

SHORT_CELLS: Cells = {
    "balls": lambda one: f"{one['balls']:,}",
    "collisions": lambda one: f"≤ {one['collisions']:,}",
    "record": lambda one: str(one["record"]),
    "repeats/s": lambda one: _rate(one["median"]),
    "lowest to highest": lambda one: f"{_rate(one['lowest'])} to {_rate(one['highest'])}",
    "kernel": lambda one: f"{100 * one['kernel_share']:.0f} %",
    "repeats": lambda one: f"{one['repeats']:,}",
    "files": lambda one: f"{one['files']:,}",
    "threads": lambda one: f"{one['threads']:,}",
    "runs": lambda one: f"{one['rounds']:,}",
}
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

COMPARISON_CELLS: Cells = {
    "rate": lambda one: str(one["rate"]),
    "then": lambda one: _rate(one["then"]),
    "now": lambda one: _rate(one["now"]),
    "now/then": lambda one: "–" if one["ratio"] is None else f"{one['ratio']:.2f}",
}
