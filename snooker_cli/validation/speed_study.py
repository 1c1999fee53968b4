"""``snooker bench speed``: collisions per second of one thread, for several gases.

Also measured are the cost of storing every collision, the speed in a cold gas, and memory.
"""

from __future__ import annotations

import gc
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from snooker_cli import store
from snooker_cli.analysis.observables import total_angular_momentum
from snooker_cli.config import parse
from snooker_cli.engine import ENGINE_VERSION, kernel_state, sampling, simulate, simulation
from snooker_cli.engine.clock import FULL
from snooker_cli.figures import FigureData, Layer, Line, Points
from snooker_cli.formatting import counted, short
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.validation.study import Record, Study, header_lines, machine, table

MASS = 1e7
"""Mass of a free container, kg; balls have 1 kg."""

TEMPLATE = """
container: {{radius: 10.0, mass: {mass}}}
balls: {{count: {balls}, packing: {packing}, speed: 10.0, speeds: maxwell}}
cor: 1
collisions: 1
seed: 1
"""

SPAN = 50
"""Collisions a ball after which a gas with losses starts again with new velocities."""

COLD = 1e-6
"""Energy of a cold gas, relative to its start."""

PIECE, PIECES = 2, 10
"""Collisions a ball between two looks at the energy; pieces in a measurement of speed."""

LONGEST = 2000
"""Collisions a ball after which a gas that is not cold yet is given up."""

FEWEST = 3
"""Points of a curve in a figure, at least."""

PAGE_COUNTS = Path("/proc/self/statm")


@dataclass(frozen=True)
class SpeedCase:
    """A gas in a circle: a lattice with Maxwell's speeds, stirred without losses before timing.

    free : whether the container moves
    engine : "allpairs" or "cells" instead of the automatic choice
    """

    balls: int
    packing: float
    free: bool = False
    cor: float = 1.0
    engine: str | None = None

    def scene(self) -> Scene:
        """Its start, without losses."""
        mass = MASS if self.free else ".inf"
        text = TEMPLATE.format(balls=self.balls, packing=self.packing, mass=mass)
        return starting_scene(parse(text).experiment, 0)


LIKE_THE_REPORT = [
    SpeedCase(37, packing, free, cor)
    for cor in (1.0, 0.9)
    for packing in (0.37, 0.0037)
    for free in (True, False)
]
MANY = [
    *(SpeedCase(1000, packing) for packing in (0.004, 0.04, 0.2, 0.4, 0.55, 0.7)),
    *(SpeedCase(37, packing) for packing in (0.04, 0.2)),
    SpeedCase(1000, 0.4, free=True),
    SpeedCase(1000, 0.4, cor=0.9),
    SpeedCase(100_000, 0.4),
]
MOST = SpeedCase(1_000_000, 0.4)
BOTH = [
    SpeedCase(balls, packing, free, engine=engine)
    for packing in (0.4, 0.004)
    for free in (False, True)
    for balls in (19, 37, 61, 127, 217, 397)
    for engine in ("allpairs", "cells")
]


@dataclass(frozen=True)
class SpeedStudy(Study):
    """Which gases to time, and how long.

    events : collisions in a repeat; more for many balls, so that the engine sorts them once
    stirring : collisions a ball before timing
    cooled : the gas whose cold state is timed
    recorded : collisions of a run that is stored
    resident : the gas whose memory is measured
    """

    name = "speed"
    title = "speed"
    libraries = ("numpy", "numba", "h5py")

    cases: tuple[SpeedCase, ...] = (*LIKE_THE_REPORT, *MANY, *BOTH)
    cooled: SpeedCase = SpeedCase(1000, 0.4, cor=0.9)
    resident: SpeedCase = SpeedCase(100_000, 0.4)
    recorded: int = 1_000_000
    events: int = 200_000
    repeats: int = 5
    stirring: int = 10
    quick: bool = False

    def results(self, report: Callable[[str], None]) -> Record:
        """Measure memory, speeds, recording and cooling."""
        report(f"memory of {self.resident.balls:,} balls")
        bytes_a_ball = memory(self.resident)
        timings = []
        for number, case in enumerate(self.cases, start=1):
            gas = f"{case.balls:,} balls at packing {case.packing:g}"
            report(f"gas {number} of {len(self.cases)}: {gas}")
            timings.append(self.timing(case))
        report("recording")
        stored = recording(SpeedCase(37, 0.37, free=True), self.recorded, self.repeats)
        report("cooling")
        return {
            "cases": timings,
            "crossover": crossover(timings),
            "growth": growth(timings),
            "recording": stored,
            "cooling": self.cooling(),
            "memory": {"balls": self.resident.balls, "bytes_a_ball": bytes_a_ball},
        }

    def events_of(self, case: SpeedCase) -> int:
        """Collisions in a repeat of a case."""
        sorting = simulation.REORDER_AFTER * case.balls * (case.balls >= simulation.REORDERED)
        return max(self.events, sorting // self.repeats)

    def stirred(self, case: SpeedCase) -> Scene:
        """A gas after stirring, without losses."""
        collisions = self.stirring * case.balls
        return simulate(case.scene(), collisions=collisions, sink=lambda _: None).finish

    def timing(self, case: SpeedCase) -> Record:
        """Collisions per second of a case: median, lowest and highest of the repeats."""
        events, scene, generator = (
            self.events_of(case),
            self.stirred(case),
            np.random.default_rng(1),
        )
        timer = KernelTimer(scene, case.engine)
        timer.advance(case.balls)  # compiles the kernel
        rates = []
        for _ in range(self.repeats):
            done, seconds = 0, 0.0
            while done < events:
                wanted = events - done
                if case.cor < 1.0:
                    start = with_losses(scene, case.cor, case.cor, generator)
                    timer = KernelTimer(start, case.engine)
                    wanted = min(wanted, SPAN * case.balls)
                more, took = timer.advance(wanted)
                if more == 0:
                    raise ValueError(f"no collision lies ahead in {case}")
                done, seconds = done + more, seconds + took
            rates.append(done / seconds)
        in_cells = isinstance(timer.engine, simulation.InCells)
        return asdict(case) | {
            "engine": "cells" if in_cells else "allpairs",
            "compared": case.engine is not None,
            "median": statistics.median(rates),
            "lowest": min(rates),
            "highest": max(rates),
            "repeats": self.repeats,
            "events": events,
        }

    def cooling(self) -> Record:
        """The speed in a gas that has lost all but ``COLD`` of its energy, over that at the start.

        Walls are elastic, so that no ball is trapped at one. Ratios and collisions a ball are
        ``None`` if no repeat became cold.
        """
        case, generator = self.cooled, np.random.default_rng(1)
        scene = self.stirred(case)
        ratios, collisions = [], []
        for _ in range(self.repeats):
            start = without_rotation(with_losses(scene, case.cor, 1.0, generator))
            timer, cold = KernelTimer(start), True
            first_rate = timer.rate()
            while cold and timer.energy > COLD:
                done, _ = timer.advance(PIECE * case.balls)
                cold = done == PIECE * case.balls and timer.collisions <= LONGEST * case.balls
            if cold:
                collisions.append(timer.collisions / case.balls)
                ratios.append(timer.rate() / first_rate)
        return {
            "balls": case.balls,
            "packing": case.packing,
            "cor": case.cor,
            "repeats": len(ratios),
            "ratio": statistics.median(ratios) if ratios else None,
            "lowest": min(ratios, default=None),
            "highest": max(ratios, default=None),
            "collisions": statistics.median(collisions) if collisions else None,
        }

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """Speeds, the number of balls where the engines are equally fast, and costs."""
        yield from header_lines(record)
        yield ""
        yield from table(record["cases"], CELLS, left=("container", "engine"))
        yield ""
        yield from _crossover_lines(record["crossover"])
        for one in record["growth"]:
            times = short(one["times"])
            yield f"{one['balls']:,} balls: a collision takes {times} times as long as with 1,000"
        yield from _cost_lines(record)

    @staticmethod
    def figures(record: Record) -> dict[str, FigureData]:
        """Speed over the number of balls and over the packing, as far as there are curves."""
        found = {
            "speed-number": speed_figure(record, "balls", "packing", "number of balls"),
            "speed-packing": speed_figure(record, "packing", "balls", "packing fraction"),
        }
        return {name: figure for name, figure in found.items() if figure.layers}


FULL_STUDY = SpeedStudy()
ALL_STUDY = replace(FULL_STUDY, cases=(*FULL_STUDY.cases, MOST), resident=MOST)
QUICK_STUDY = SpeedStudy(
    cases=(*LIKE_THE_REPORT[2:5], *BOTH[:6], SpeedCase(100, 0.4)),
    cooled=SpeedCase(100, 0.05, cor=0.9),
    resident=SpeedCase(5000, 0.4),
    recorded=5000,
    events=2000,
    repeats=2,
    stirring=2,
    quick=True,
)


# What is measured


class KernelTimer:
    """An engine without the chunks and files around it, which records into the same memory."""

    def __init__(self, scene: Scene, engine: str | None = None) -> None:
        self.scene = scene
        self.engine = simulation.engine_for(scene, engine)(scene, kernel_state.Setup.of(scene))
        self._recorded = kernel_state.new_record(simulation.CHUNK)
        self._grid = sampling.no_grid()

    def advance(self, collisions: int) -> tuple[int, float]:
        """Simulate collisions; their number, lower at an end, and the processor time, s."""
        before, answer = self.collisions, FULL
        wanted = before + collisions
        clock = time.process_time()
        while answer == FULL and self.collisions < wanted:
            limit = min(simulation.CHUNK, wanted - self.collisions)
            answer = self.engine.advance(self._recorded, self._grid, limit)
        return self.collisions - before, time.process_time() - clock

    def rate(self) -> float:
        """Collisions per second over the next ``PIECES`` pieces."""
        done, seconds = self.advance(PIECES * PIECE * self.scene.number)
        return done / seconds

    @property
    def collisions(self) -> int:
        """Collisions so far."""
        return self.engine.state.collisions

    @property
    def energy(self) -> float:
        """Kinetic energy of the balls, relative to the start."""
        now = float(self.engine.state.sums[kernel_state.NOW])
        return self.engine.scene_at(now).kinetic_energy / self.scene.kinetic_energy


def with_losses(scene: Scene, cor: float, wall_cor: float, generator: np.random.Generator) -> Scene:
    """The scene with new velocities from Maxwell's distribution, in a container at rest."""
    velocities = generator.normal(scale=10.0 / math.sqrt(2.0), size=scene.velocities.shape)
    return replace(
        scene,
        velocities=velocities,
        container_velocity=np.zeros(2),
        restitution=cor,
        wall_restitution=wall_cor,
    )


def without_rotation(scene: Scene) -> Scene:
    """The scene, in a fixed circle, without angular momentum, which a smooth wall conserves.

    With it, a cold gas still rotates, with a ten-thousandth of the energy of the start.
    """
    x, y = (scene.positions - scene.container_position).T
    turning = total_angular_momentum(scene) / np.sum(scene.masses * (x * x + y * y))
    return replace(scene, velocities=scene.velocities - turning * np.stack([-y, x], axis=1))


def recording(case: SpeedCase, collisions: int, repeats: int) -> Record:
    """What it costs to store every collision: whole runs with events beside runs with summaries.

    ``seconds`` and ``processor_seconds`` are medians of the ratio less one, in pairs of runs;
    ``spread`` has the lowest and the highest of the first. The file has ``bytes_an_event``.
    """
    scene = case.scene()
    wall, processor = [], []
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "repeat.h5"
        for summary in (True, False):
            _stored(scene, 1, summary, path)  # compiles the kernels
        for _ in range(repeats):
            of_summary = _stored(scene, collisions, True, path)
            of_events = _stored(scene, collisions, False, path)
            wall.append(of_events[0] / of_summary[0] - 1)
            processor.append(of_events[1] / of_summary[1] - 1)
        size = path.stat().st_size
    return {
        "balls": case.balls,
        "packing": case.packing,
        "collisions": collisions,
        "repeats": repeats,
        "seconds": statistics.median(wall),
        "processor_seconds": statistics.median(processor),
        "spread": (min(wall), max(wall)),
        "bytes_an_event": size / collisions,
    }


def _stored(scene: Scene, collisions: int, summary: bool, path: Path) -> tuple[float, float]:
    """Seconds, and processor seconds of all threads, of a run with its file."""
    provenance = store.Provenance("{}", "", "{}", 0, 0, ENGINE_VERSION, "{}", "", "", "", 0.0)
    clock, processor = time.perf_counter(), time.process_time()
    with store.Recorder(path, scene) as recorder:
        trace = simulate(scene, collisions=collisions, summary=summary, sink=recorder.add)
        recorder.finish(trace, provenance)
    return time.perf_counter() - clock, time.process_time() - processor


def memory(case: SpeedCase) -> float | None:
    """Resident bytes a ball of a scene and its engine; ``None`` where the system has no count."""
    if not PAGE_COUNTS.exists():
        return None
    few = replace(case, balls=min(case.balls, 2 * simulation.REORDERED))
    KernelTimer(few.scene()).advance(few.balls)  # compiling takes memory too
    gc.collect()
    before = _resident()
    timer = KernelTimer(case.scene())
    timer.advance(case.balls)
    return (_resident() - before) / case.balls


def _resident() -> int:
    """Resident bytes of this process, on Linux."""
    import resource

    return int(PAGE_COUNTS.read_text(encoding="ascii").split()[1]) * resource.getpagesize()


def crossover(timings: Sequence[Record]) -> list[Record]:
    """The speed of all pairs over that of cells, where both were timed on purpose.

    few : all pairs are used up to this number of balls
    """
    rates: dict[tuple[float, bool, int], dict[str, float]] = {}
    for one in timings:
        if one["compared"]:
            place = one["packing"], one["free"], one["balls"]
            rates.setdefault(place, {})[one["engine"]] = one["median"]
    return [
        {
            "packing": packing,
            "free": free,
            "balls": balls,
            "ratio": found["allpairs"] / found["cells"],
            "few": simulation.few_at(packing, free=free),
        }
        for (packing, free, balls), found in rates.items()
        if len(found) == 2
    ]


def growth(timings: Sequence[Record]) -> list[Record]:
    """The time of a collision with many balls over that with a thousand, at the same packing."""
    rates = {
        one["balls"]: one["median"]
        for one in timings
        if one["packing"] == 0.4 and one["cor"] == 1 and not (one["free"] or one["compared"])
    }
    return [
        {"balls": balls, "times": rates[1000] / rate}
        for balls, rate in rates.items()
        if 1000 in rates and balls > 1000
    ]


# The record as tables


CELLS: dict[str, Callable[[Record], str]] = {
    "balls": lambda case: f"{case['balls']:,}",
    "packing": lambda case: f"{case['packing']:g}",
    "container": lambda case: "free" if case["free"] else "fixed",
    "CoR": lambda case: f"{case['cor']:g}",
    "engine": lambda case: str(case["engine"]),
    "collisions/s": lambda case: f"{case['median'] / 1e6:.2f} M",
    "lowest to highest": lambda c: f"{c['lowest'] / 1e6:.2f} to {c['highest'] / 1e6:.2f} M",
    "repeats": lambda case: str(case["repeats"]),
    "collisions each": lambda case: f"{case['events']:,}",
}
"""The table of gases."""


def _crossover_lines(rows: Sequence[Record]) -> Iterator[str]:
    """Where one engine becomes faster than the other."""
    for packing, free, few in dict.fromkeys(
        (row["packing"], row["free"], row["few"]) for row in rows
    ):
        ratios = [
            f"{short(row['ratio'])} for {row['balls']}"
            for row in rows
            if (row["packing"], row["free"]) == (packing, free)
        ]
        yield (
            f"packing {packing:g}, {'free' if free else 'fixed'} container: speed of all pairs "
            f"over that of cells: {', '.join(ratios)} balls; all pairs are used up to {few}"
        )


def _cost_lines(record: Record) -> Iterator[str]:
    """Recording, cooling and memory."""
    stored = record["recording"]
    low, high = stored["spread"]
    yield (
        (
            f"storing every collision instead of a summary, {stored['balls']} balls, "
            f"{stored['collisions']:,} collisions: {stored['seconds']:+.0%} time "
            f"({low:+.0%} to {high:+.0%}), {stored['processor_seconds']:+.0%} processor time, "
            f"{stored['bytes_an_event']:.1f} bytes a collision"
        )
        .replace("-", "−")
        .replace("%", " %")
    )
    cold = record["cooling"]
    gas = f"{cold['balls']:,} balls at packing {cold['packing']:g} and CoR {cold['cor']:g}"
    if cold["ratio"] is None:
        yield f"{gas}: no repeat cooled to a millionth of its energy"
    else:
        yield (
            f"{gas}, cooled to a millionth of the energy after {cold['collisions']:.0f} collisions "
            f"a ball: {cold['ratio']:.2f} times the speed of the start ({cold['lowest']:.2f} to "
            f"{cold['highest']:.2f}, {counted(cold['repeats'], 'repeat')})"
        )
    used = record["memory"]
    if used["bytes_a_ball"] is not None:
        yield f"memory with {used['balls']:,} balls: {used['bytes_a_ball']:.0f} bytes a ball"


# The record as figures


def speed_figure(record: Record, over: str, each: str, label: str) -> FigureData:
    """Speeds of elastic gases in a fixed circle over one of their numbers.

    There is a curve for each engine and each value of another number, ``each``.
    """
    cases = [one for one in record["cases"] if one["cor"] == 1.0 and not one["free"]]
    curves: dict[tuple[float, str], dict[float, Record]] = {}
    for one in cases:  # the first timing of a place counts
        curves.setdefault((one[each], one["engine"]), {}).setdefault(one[over], one)
    layers: list[Layer] = []
    shown: list[Record] = []
    long_curves = [found for _, found in sorted(curves.items()) if len(found) >= FEWEST]
    for series, found in enumerate(long_curves):
        curve = [found[place] for place in sorted(found)]
        shown += [{key: one[key] for key in (over, each, "engine", "median")} for one in curve]
        x, rate, low, high = np.array(
            [[one[key] for one in curve] for key in (over, "median", "lowest", "highest")]
        )
        error = np.maximum(high - rate, rate - low) / 1e6
        value = curve[0][each]
        name = f"{value:,} balls" if each == "balls" else f"packing {value:g}"
        name = f"{name}, {curve[0]['engine']}"
        layers.append(Line(x, rate / 1e6, None, series))
        layers.append(Points(x, rate / 1e6, None, error, label=name, series=series))
    best = ""
    if cases:
        fastest = max(cases, key=lambda one: float(one["median"]))
        best = (
            f" At most {short(fastest['median'] / 1e6)} million, of {fastest['balls']:,} balls at "
            f"packing {fastest['packing']:g}."
        )
    return FigureData(
        kind=f"speed-{over}",
        title=f"Speed against the {label}",
        x_label=label,
        y_label="collisions per second (million)",
        layers=tuple(layers),
        caption="Elastic disks in a fixed circle: medians of one thread's rates, bars to the "
        f"farthest repeat.{best} {machine(record)}.",
        numbers={"cases": shown},
        x_log=True,
        y_log=True,
    )
