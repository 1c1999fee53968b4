"""Collisions per second of one thread, for gases that ask for different things of the engine."""

from __future__ import annotations

import gc
import math
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from snooker_cli import store
from snooker_cli.config import parse
from snooker_cli.engine import ENGINE_VERSION, kernel_state, sampling, simulate, simulation
from snooker_cli.engine.clock import FULL
from snooker_cli.engine.simulation import CHUNK, REORDERED
from snooker_cli.figures import FigureData, Layer, Line, Points, plain
from snooker_cli.formatting import Column, counted, short, table_lines
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.validation.study import machine, origin

MASS = 1e7
"""Of a free container, kg; balls have 1 kg."""

TEMPLATE = """
container: {{radius: 10.0, mass: {mass}}}
balls: {{count: {balls}, packing: {packing}, speed: 10.0, speeds: maxwell}}
cor: 1
collisions: 1
seed: {seed}
"""

SPAN = 50
"""Collisions a ball for which a gas with losses goes on; then it starts anew."""


@dataclass(frozen=True)
class SpeedCase:
    """A gas in a circle to time: a lattice with Maxwell's speeds, stirred without losses first.

    free : whether the container moves
    engine : "allpairs" or "cells" instead of what suits it
    """

    balls: int
    packing: float
    free: bool = False
    cor: float = 1.0
    engine: str | None = None

    def scene(self, seed: int = 1) -> Scene:
        """Its start, without losses."""
        mass = MASS if self.free else ".inf"
        text = TEMPLATE.format(balls=self.balls, packing=self.packing, mass=mass, seed=seed)
        return starting_scene(parse(text).experiment, 0)


@dataclass(frozen=True)
class Effort:
    """How long to measure.

    events : collisions in a repeat; more if many balls would not be sorted by cells in any
    stirring : collisions a ball before anything is measured
    """

    events: int = 200_000
    repeats: int = 5
    stirring: int = 10

    def events_of(self, balls: int) -> int:
        """Collisions in a repeat for so many balls."""
        sorting = simulation.REORDER_AFTER * balls if balls >= simulation.REORDERED else 0
        return max(self.events, sorting // self.repeats)


QUICK = Effort(events=2000, repeats=2, stirring=2)
"""Shows that it works, and nothing else."""

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
MOST = [SpeedCase(1_000_000, 0.4)]
BOTH = [
    SpeedCase(balls, packing, free, engine=engine)
    for packing in (0.4, 0.004)
    for free in (False, True)
    for balls in (19, 37, 61, 127, 217, 397)
    for engine in ("allpairs", "cells")
]
CASES = [*LIKE_THE_REPORT, *MANY, *BOTH]
QUICK_CASES = [*LIKE_THE_REPORT[2:5], *BOTH[:6], SpeedCase(100, 0.4)]


@dataclass(frozen=True)
class Timing:
    """Collisions per second over the repeats of a measurement.

    engine : the one that was used
    events : collisions in a repeat
    """

    case: SpeedCase
    engine: str
    median: float
    lowest: float
    highest: float
    repeats: int
    events: int

    def as_json(self) -> dict[str, Any]:
        """Without the case in it: all its keys beside the others."""
        return vars(self.case) | {key: value for key, value in vars(self).items() if key != "case"}


def measure(case: SpeedCase, effort: Effort) -> Timing:
    """Time a case: processor seconds of the kernel, which records into memory."""
    events = effort.events_of(case.balls)
    stirred = KernelTimer(case.scene(), case.engine)
    stirred.advance(effort.stirring * case.balls)
    again = _anew(stirred, case) if case.cor < 1.0 else _on(stirred)
    rates = [_rate(again, events, case) for _ in range(effort.repeats)]
    return Timing(
        case=case,
        engine="cells" if isinstance(stirred.engine, simulation.InCells) else "allpairs",
        median=statistics.median(rates),
        lowest=min(rates),
        highest=max(rates),
        repeats=effort.repeats,
        events=events,
    )


def _rate(
    again: Iterator[Callable[[int], tuple[int, float]]], events: int, case: SpeedCase
) -> float:
    """Collisions per second over so many, in one piece or several."""
    done, seconds = 0, 0.0
    while done < events:
        more, took = next(again)(events - done)
        if more == 0:
            raise ValueError(f"no collision lies ahead in {case}")
        done, seconds = done + more, seconds + took
    return done / seconds


def _on(stirred: KernelTimer) -> Iterator[Callable[[int], tuple[int, float]]]:
    """The same gas, again and again."""
    while True:
        yield stirred.advance


def _anew(stirred: KernelTimer, case: SpeedCase) -> Iterator[Callable[[int], tuple[int, float]]]:
    """A gas with losses in the same places, each time with new speeds and for a span."""
    generator = np.random.default_rng(1)
    places = stirred.places()
    while True:
        kernel = KernelTimer(with_losses(places, case.cor, case.cor, generator), case.engine)
        yield partial(_for_a_span, kernel, SPAN * case.balls)


def _for_a_span(kernel: KernelTimer, span: int, collisions: int) -> tuple[int, float]:
    """Go on for so many collisions, but for no longer than a span."""
    return kernel.advance(min(collisions, span))


def with_losses(
    places: Scene, cor: float, wall_cor: float, generator: np.random.Generator
) -> Scene:
    """The balls of a scene where they are, with new velocities from Maxwell's distribution."""
    velocities = generator.normal(scale=10.0 / math.sqrt(2.0), size=places.velocities.shape)
    return replace(places, velocities=velocities, restitution=cor, wall_restitution=wall_cor)


class KernelTimer:
    """An engine that goes on and on, without the chunks and files around it."""

    def __init__(self, scene: Scene, kind: str | None = None) -> None:
        self.scene = scene
        self.engine = simulation.engine_for(scene, kind)(scene, kernel_state.Setup.of(scene))
        self._recorded, self._grid = kernel_state.room_for(CHUNK), sampling.no_grid()

    def advance(self, collisions: int) -> tuple[int, float]:
        """Go on for so many collisions, or to an end; how many they were, and the time they took.

        The time is that of the processor, s.
        """
        before, answer = self.collisions, FULL
        wanted = before + collisions
        clock = time.process_time()
        while answer == FULL and self.collisions < wanted:
            room = min(CHUNK, wanted - self.collisions)
            answer = self.engine.advance(self._recorded, self._grid, room)
        return self.collisions - before, time.process_time() - clock

    @property
    def collisions(self) -> int:
        """Collisions so far."""
        return int(
            self.engine.counts[kernel_state.WALL_EVENTS]
            + self.engine.counts[kernel_state.PAIR_EVENTS]
        )

    @property
    def energy(self) -> float:
        """Kinetic energy of the balls over that of the start."""
        speeds = self.engine.balls()[[kernel_state.U, kernel_state.V]].T
        return replace(self.scene, velocities=speeds).kinetic_energy / self.scene.kinetic_energy

    def places(self) -> Scene:
        """The scene with the balls where they are now, in a container at rest."""
        balls, now = self.engine.balls(), float(self.engine.sums[kernel_state.NOW])
        ages = now - balls[kernel_state.CLOCK]
        motions = balls[[kernel_state.U, kernel_state.V]]
        positions = (balls[[kernel_state.X, kernel_state.Y]] + motions * ages).T
        container = self.engine.container
        centre = self.scene.container_position
        if container is not None:
            centre = container[:2] + container[2:4] * (now - container[kernel_state.CLOCK])
        return replace(self.scene, positions=positions.copy(), container_position=np.array(centre))


def crossover(timings: Sequence[Timing]) -> list[dict[str, Any]]:
    """How many times as fast all pairs are as cells where both were timed, all in one container.

    few : balls up to which the engine would be all pairs
    """
    found: dict[tuple[float, bool, int], dict[str, float]] = {}
    for timing in timings:
        case = timing.case
        if case.engine is not None:
            rates = found.setdefault((case.packing, case.free, case.balls), {})
            rates[timing.engine] = timing.median
    return [
        {
            "packing": packing,
            "free": free,
            "balls": balls,
            "ratio": rates["allpairs"] / rates["cells"],
            "few": simulation.few_at(packing, free=free),
        }
        for (packing, free, balls), rates in found.items()
        if len(rates) == 2
    ]


# What beside the number of balls decides how long a run takes: recording, cooling, memory.

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


def recording(case: SpeedCase, collisions: int, repeats: int) -> Recording:
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


def cooling(case: SpeedCase, effort: Effort) -> Cooling:
    """Let a gas cool, several times; walls are elastic, so that none is trapped at one."""
    stirred = KernelTimer(case.scene())
    stirred.advance(effort.stirring * case.balls)
    places, generator = stirred.places(), np.random.default_rng(1)
    found = []
    for _ in range(effort.repeats):
        start = without_rotation(with_losses(places, case.cor, 1.0, generator))
        one = _cooled(KernelTimer(start), case.balls)
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


def _cooled(kernel: KernelTimer, balls: int) -> tuple[float, int] | None:
    """The speed when cold over that at the start, and the collisions until cold; or neither."""
    start = _speed(kernel, balls)
    while kernel.energy > COLD:
        done, _ = kernel.advance(PIECE * balls)
        if done < PIECE * balls or kernel.collisions > LONGEST * balls:
            return None
    collisions = kernel.collisions
    return _speed(kernel, balls) / start, collisions


def _speed(kernel: KernelTimer, balls: int) -> float:
    """Collisions per second over some pieces."""
    done, seconds = kernel.advance(PIECES * PIECE * balls)
    return done / seconds


def memory(case: SpeedCase) -> float | None:
    """Bytes a ball that become resident with a scene and its engine; where the system tells."""
    few = replace(case, balls=min(case.balls, 2 * REORDERED))
    KernelTimer(few.scene()).advance(few.balls)  # compiles, which takes memory too
    gc.collect()
    before = _resident()
    kernel = KernelTimer(case.scene())
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


# The whole measurement of speed as one record, with the machine that it holds for.


@dataclass(frozen=True)
class Plan:
    """What to measure.

    recorded : collisions in a run that is stored
    resident : the case whose memory is measured
    """

    cases: Sequence[SpeedCase]
    effort: Effort
    cooled: SpeedCase
    recorded: int
    resident: SpeedCase


FULL_PLAN = Plan(CASES, Effort(), SpeedCase(1000, 0.4, cor=0.9), 1_000_000, SpeedCase(100_000, 0.4))
ALL_PLAN = replace(FULL_PLAN, cases=[*CASES, *MOST], resident=MOST[0])
SMALL_PLAN = Plan(QUICK_CASES, QUICK, SpeedCase(100, 0.05, cor=0.9), 5000, SpeedCase(5000, 0.4))


def measured(plan: Plan, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure; the record, as JSON has it.

    tell : is given a word on what is measured, from time to time
    """
    began, load = datetime.now(UTC), _load()
    tell(f"memory of {plan.resident.balls:,} balls")
    bytes_a_ball = memory(plan.resident)
    timings = []
    for number, case in enumerate(dict.fromkeys(plan.cases), start=1):
        tell(f"gas {number} of {len(plan.cases)}: {case.balls:,} balls at packing {case.packing:g}")
        timings.append(measure(case, plan.effort))
    tell("recording")
    report = SpeedCase(37, 0.37, free=True)
    stored = recording(report, plan.recorded, plan.effort.repeats)
    tell("cooling")
    cold = cooling(plan.cooled, plan.effort)
    head = origin("speed", began, "numpy", "numba", "h5py")
    record: dict[str, Any] = plain(
        head
        | {
            "machine": head["machine"] | {"load": load},
            "cases": [timing.as_json() for timing in timings],
            "crossover": crossover(timings),
            "growth": growth(timings),
            "recording": vars(stored),
            "cooling": vars(cold),
            "memory": {"balls": plan.resident.balls, "bytes_a_ball": bytes_a_ball},
        }
    )
    return record


def growth(timings: Sequence[Timing]) -> list[dict[str, float]]:
    """The time for a collision over that of a thousand balls, for many more at their packing."""
    plain_ones = [
        timing
        for timing in timings
        if timing.case == SpeedCase(timing.case.balls, 0.4) and timing.case.balls >= 1000
    ]
    if not plain_ones:
        return []
    least = min(plain_ones, key=lambda timing: timing.case.balls)
    return [
        {"balls": timing.case.balls, "times": least.median / timing.median}
        for timing in plain_ones
        if timing is not least
    ]


def _load() -> float | None:
    """Programs that wanted to run in the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


# A measurement of speed -> pictures: rates against the number of balls, and against packing.

Record = dict[str, Any]

FEWEST = 3
"""Points that make a curve."""


def pictures(measurement: Record) -> list[tuple[str, FigureData]]:
    """The pictures that a measurement can give, each with a name for its files."""
    plain = [one for one in measurement["cases"] if one["cor"] == 1.0 and not one["free"]]
    found = [
        ("speed-number", against(measurement, plain, "balls", "packing", "number of balls")),
        ("speed-packing", against(measurement, plain, "packing", "balls", "packing fraction")),
    ]
    return [(name, picture) for name, picture in found if picture.layers]


def against(
    measurement: Record, cases: Sequence[Record], over: str, each: str, label: str
) -> FigureData:
    """Rates over one of a case's numbers, a curve for each value of another and each engine."""
    layers: list[Layer] = []
    records: list[Record] = []
    curves = {(one[each], one["engine"]): None for one in cases}
    series = 0
    for value, engine in sorted(curves):
        curve = _curve(
            [one for one in cases if (one[each], one["engine"]) == (value, engine)], over
        )
        if len(curve) < FEWEST:
            continue
        x, rate, low, high = np.array(
            [[one[name] for one in curve] for name in (over, "median", "lowest", "highest")]
        )
        name = f"{value:,} balls" if each == "balls" else f"packing {value:g}"
        layers.append(Line(x, rate / 1e6, None, series))
        layers.append(
            Points(
                x,
                rate / 1e6,
                None,
                np.maximum(high - rate, rate - low) / 1e6,
                label=f"{name}, {engine}",
                series=series,
            )
        )
        records += [{key: one[key] for key in (over, each, "engine", "median")} for one in curve]
        series += 1
    fastest = max(cases, key=lambda one: float(one["median"]), default=None)
    best = (
        f" At most {short(fastest['median'] / 1e6)} million, of {fastest['balls']:,} balls at "
        f"packing {fastest['packing']:g}."
        if fastest
        else ""
    )
    return FigureData(
        kind=f"speed-{over}",
        title=f"Speed against the {label}",
        x_label=label,
        y_label="collisions per second (million)",
        layers=tuple(layers),
        caption="Elastic disks in a fixed circle: medians of one thread's rates, bars to the "
        f"farthest repeat.{best} {machine(measurement)}.",
        numbers={"cases": records},
        x_log=True,
        y_log=True,
    )


def _curve(cases: Iterable[Record], over: str) -> list[Record]:
    """Cases in order, one for each place: the first that was measured."""
    found: dict[float, Record] = {}
    for one in cases:
        found.setdefault(one[over], one)
    return [found[place] for place in sorted(found)]


# A measurement of speed -> its tables for people.


def lines_of_speed(measurement: Record) -> Iterator[str]:
    """The measurement as tables and sentences."""
    machine, versions = measurement["machine"], measurement["versions"]
    load = "" if machine["load"] is None else f", load {machine['load']:.1f} before"
    yield (
        f"{machine['processor']}, {counted(machine['processors'], 'processor')}{load}; "
        f"{machine['platform']}"
    )
    software = [f"snooker {measurement['snooker']}", f"engine {measurement['engine_version']}"]
    yield ", ".join([*software, *(f"{name} {number}" for name, number in versions.items())])
    yield ""
    yield from table_lines(
        [
            Column("balls", True),
            Column("packing", True),
            Column("container"),
            Column("CoR", True),
            Column("engine"),
            Column("collisions/s", True),
            Column("lowest to highest", True),
            Column("repeats", True),
            Column("collisions each", True),
        ],
        [
            [
                f"{case['balls']:,}",
                f"{case['packing']:g}",
                "free" if case["free"] else "fixed",
                f"{case['cor']:g}",
                case["engine"],
                f"{case['median'] / 1e6:.2f} M",
                f"{case['lowest'] / 1e6:.2f} to {case['highest'] / 1e6:.2f} M",
                str(case["repeats"]),
                f"{case['events']:,}",
            ]
            for case in measurement["cases"]
        ],
    )
    yield ""
    yield from _crossover(measurement["crossover"])
    for growth in measurement["growth"]:
        yield (
            f"{growth['balls']:,} balls: a collision takes {short(growth['times'])} times as long "
            "as with 1,000"
        )
    yield from _costs(measurement)


def _crossover(crossover: Sequence[Record]) -> Iterator[str]:
    """Where one engine becomes faster than the other."""
    cases = dict.fromkeys((one["packing"], one["free"], one["few"]) for one in crossover)
    for packing, free, few in cases:
        ratios = [
            f"{short(one['ratio'])} for {one['balls']}"
            for one in crossover
            if (one["packing"], one["free"]) == (packing, free)
        ]
        yield (
            f"packing {packing:g}, {'free' if free else 'fixed'} container: speed of all pairs "
            f"over that of cells: {', '.join(ratios)} balls; up to {few} all pairs are used"
        )


def _costs(measurement: Record) -> Iterator[str]:
    """Recording, cooling and memory."""
    stored = measurement["recording"]
    low, high = (f"{100 * value:+.0f} %".replace("-", "−") for value in stored["spread"])
    yield (
        f"storing every collision instead of a summary, {stored['balls']} balls, "
        f"{stored['collisions']:,} collisions: {100 * stored['seconds']:+.0f} % time "
        f"({low} to {high}), {100 * stored['processor_seconds']:+.0f} % processor time, "
        f"{stored['bytes_an_event']:.1f} bytes a collision"
    ).replace("-", "−")
    cold = measurement["cooling"]
    gas = f"{cold['balls']:,} balls at packing {cold['packing']:g} and CoR {cold['cor']:g}"
    if cold["ratio"] is None:
        yield f"{gas}: none cooled to a millionth of its energy"
    else:
        yield (
            f"{gas}, cooled to a millionth of the energy after {cold['collisions']:.0f} collisions "
            f"a ball: {cold['ratio']:.2f} times the speed of the start ({cold['lowest']:.2f} to "
            f"{cold['highest']:.2f}, {counted(cold['repeats'], 'repeat')})"
        )
    memory = measurement["memory"]
    if memory["bytes_a_ball"] is not None:
        yield f"memory with {memory['balls']:,} balls: {memory['bytes_a_ball']:.0f} bytes a ball"
