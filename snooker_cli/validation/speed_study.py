"""``snooker bench speed``: short repeats per second, and collisions per second of several gases."""

import json
import math
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from snooker_cli.config import load
from snooker_cli.engine import simulate, simulate_batch, simulation
from snooker_cli.errors import UNREADABLE, UserError, error_text
from snooker_cli.placement.starting_scene import starting_scene, starting_scenes
from snooker_cli.runs import Run, create
from snooker_cli.runs.batch import Job
from snooker_cli.runs.execution import Watcher, execute, processors
from snooker_cli.runs.plan import batch_size
from snooker_cli.scene import Scene
from snooker_cli.validation.reference_scenes import lattice_gas
from snooker_cli.validation.study import LEGENDS, Cells, Record, Study, header_lines, table

MASS = 1e7  # mass of a free container, kg; balls have 1 kg

SHORT = {
    "container": {"radius": 10.0},
    "balls": {"rings": 3, "radius": 0.1, "speed": 10.0},
    "cor": 0.9,
    "collisions": 500,
    "seed": 1,
}


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


@dataclass(frozen=True)
class SpeedStudy(Study):
    """What to time, and how long; see plans.yaml.

    short : short repeats in a run; ``rounds`` runs are timed
    earlier : a record to compare with, see ``earlier_record``
    events : collisions in a repeat; more for many balls, so that the engine sorts them once
    stirring : collisions a ball before timing
    """

    name = "speed"
    libraries = ("numpy", "numba", "h5py")

    cases: Sequence[SpeedCase]
    events: int
    repeats: int
    stirring: int
    short: int
    rounds: int
    earlier: Record | None = None

    def results(self, report: Callable[[str], None]) -> Record:
        """The rates: each has a name, its median, lowest and highest value, 1/s."""
        rates = []
        for kept in ("events", "summary"):
            report(f"{self.short:,} short repeats, record: {kept}")
            rates.append(short_repeats(kept, self.short, self.rounds))
        for number, case in enumerate(self.cases, start=1):
            gas = f"{case.balls:,} balls at packing {case.packing:g}"
            report(f"gas {number} of {len(self.cases)}: {gas}")
            rates.append(self.timing(case))
        return {"rates": rates} | ({} if self.earlier is None else {"earlier": self.earlier})

    def timing(self, case: SpeedCase) -> Record:
        """Collisions per second of processor time: the repeats are equal parts of one run.

        The run looks at the clock after each chunk of events. The first chunk includes compiling,
        so it is not timed.
        """
        scene = case.scene()
        sorting = simulation.REORDER_AFTER * case.balls * (case.balls >= simulation.REORDERED)
        events = max(self.events, sorting // self.repeats)
        first = max(self.stirring * case.balls, simulation.CHUNK)
        looks: list[tuple[int, float]] = []

        def look(collisions: int) -> bool:
            looks.append((collisions, time.process_time()))
            return False

        simulate(scene, collisions=first + self.repeats * events, sink=lambda _: None, watch=look)
        collisions, clock = np.array(looks).T
        edges = first + events * np.arange(self.repeats + 1)
        container = "free" if case.free else "fixed"
        name = f"collisions/s: {case.balls:,} balls, packing {case.packing:g}, {container}"
        return {
            "rate": name,
            **_spread(events / np.diff(np.interp(edges, np.cumsum(collisions), clock))),
            **case._asdict(),
            "repeats": self.repeats,
            "events": events,
        }

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """The rates, and those of an earlier record if there is one."""
        yield from header_lines(record)
        cells = dict(CELLS)
        if "earlier" in record:
            then = {rate["rate"]: rate["median"] for rate in record["earlier"]["rates"]}
            cells["then"] = lambda rate: _rate(then.get(rate["rate"]))
            cells["now/then"] = lambda rate: (
                f"{rate['median'] / then[rate['rate']]:.2f}" if rate["rate"] in then else "–"
            )
            yield from ("", "then:", *header_lines(record["earlier"]))
        yield ""
        yield from table(record["rates"], cells, left=("rate",))
        yield from LEGENDS["speed"]


def short_repeats(kept: str, repeats: int, rounds: int) -> Record:
    """Repeats per second of ``rounds`` whole runs with the default number of threads.

    kept : what is recorded, "events" or "summary"

    A small run before them compiles. ``kernel_share`` is a median. Raises ``UserError`` if a repeat
    fails.
    """
    _short_run(kept, 2)
    rates, shares = zip(*(_short_run(kept, repeats) for _ in range(rounds)), strict=True)
    return {
        "rate": f"repeats/s: {repeats:,} of 37 balls, 500 collisions, {kept}",
        **_spread(rates),
        "kernel_share": statistics.median(shares),
        "threads": processors(),
        "rounds": rounds,
    }


def _short_run(kept: str, repeats: int) -> tuple[float, float]:
    """Repeats per second of a run as `snooker run` does it, and the kernel's share.

    The run places balls, simulates and writes files. The share is the processor time of simulating
    the same batches again, without placing and storing, divided by the processor time of the run.
    """
    loaded = load(SHORT | {"record": kept, "repeats": repeats})
    with tempfile.TemporaryDirectory() as folder:
        run = Run(Path(folder, "short"), loaded.experiment, loaded.points())
        began, clock = time.perf_counter(), time.process_time()
        create(run)
        results = execute(run, workers=processors(), watcher=Watcher(), cancelled=threading.Event())
        seconds, of_run = time.perf_counter() - began, time.process_time() - clock
        if failed := [result.error for result in results if result.error]:
            raise UserError(f"a repeat failed: {failed[0]}", "set TMPDIR to another folder")
        limits = Job(run, "").limits(0)
    (point,) = run.points
    size, of_kernel = batch_size(point.experiment, None), 0.0
    for first in range(0, repeats, size):
        scenes = starting_scenes(point.experiment, range(first, min(first + size, repeats)))
        clock = time.process_time()
        simulate_batch(scenes, **limits)
        of_kernel += time.process_time() - clock
    return repeats / seconds, of_kernel / of_run


def earlier_record(path: Path) -> Record:
    """The record in a JSON file that ``bench speed`` wrote.

    Raises ``UserError`` if the file cannot be read or is not such a record.
    """
    try:
        record: Record = json.loads(path.read_text(encoding="utf-8"))
        if (study := record["measurement"]) != SpeedStudy.name:
            raise ValueError(f"it has a measurement of `snooker bench {study}`")
        record.pop("earlier", None)
        list(SpeedStudy.tables(record))
        rates = {row["rate"]: row["median"] for row in record["rates"]}
        if not all(0 < rate < math.inf for rate in rates.values()):
            raise ValueError("it has a rate that is not positive")
    except (*UNREADABLE, AttributeError) as error:
        raise UserError(
            f"{path}: cannot be compared ({error_text(error)})",
            "give a speed.json that `snooker bench speed --out DIR` wrote",
        ) from None
    return record


# The record as a table


def _spread(rates: Sequence[float]) -> dict[str, float]:
    return {"median": statistics.median(rates), "lowest": min(rates), "highest": max(rates)}


def _rate(value: float | None) -> str:
    """A rate of repeats or collisions; a dash for none."""
    if value is None:
        return "–"
    return f"{value / 1e6:.2f} M" if value >= 1e5 else f"{value:,.0f}"


CELLS: Cells = {
    "rate": lambda rate: str(rate["rate"]),
    "median": lambda rate: _rate(rate["median"]),
    "lowest to highest": lambda rate: f"{_rate(rate['lowest'])} to {_rate(rate['highest'])}",
    "kernel": lambda rate: f"{100 * rate['kernel_share']:.0f} %" if "kernel_share" in rate else "–",
}
