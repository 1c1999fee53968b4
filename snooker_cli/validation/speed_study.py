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

from snooker_cli.analysis import run_analysis
from snooker_cli.config import load
from snooker_cli.engine import simulate, simulation
from snooker_cli.errors import UserError, error_text
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import Run, create
from snooker_cli.runs.execution import Watcher, execute, processors
from snooker_cli.scene import Scene
from snooker_cli.validation.study import (
    PLANS,
    Cells,
    Record,
    Study,
    header_lines,
    lattice_gas,
    table,
)

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
        report(f"{self.short:,} short repeats")
        rates = short_repeats(self.short, self.rounds)
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
        # The time at which each part ended is interpolated between two looks.
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
        yield from header_lines(record)
        cells = dict(CELLS)
        if "earlier" in record:
            then = {rate["rate"]: rate["median"] for rate in record["earlier"]["rates"]}
            rows = [rate for rate in record["rates"] if rate["rate"] in then]
            cells["then"] = lambda rate: _rate(then[rate["rate"]])
            cells["now/then"] = lambda rate: f"{rate['median'] / then[rate['rate']]:.2f}"
            yield from ("", "then:", *header_lines(record["earlier"]))
        yield ""
        yield from table(rows if "earlier" in record else record["rates"], cells, left=("rate",))


def short_repeats(repeats: int, rounds: int) -> list[Record]:
    """Repeats per second of ``rounds`` whole runs, and of the analysis that `snooker fit` makes.

    A small run before them compiles. Raises ``UserError`` if a repeat fails.
    """
    _short_run(2)
    rates = zip(*(_short_run(repeats) for _ in range(rounds)), strict=True)
    return [
        {
            "rate": f"repeats/s: {repeats:,} of 37 balls, 500 collisions, {what}",
            **_spread(of_rounds),
            "threads": processors(),
            "rounds": rounds,
        }
        for what, of_rounds in zip(("simulated", "analysed"), rates, strict=True)
    ]


def _short_run(repeats: int) -> tuple[float, float]:
    """Repeats per second of a run as `snooker run` does it, and of `snooker fit` with its file."""
    loaded = load(PLANS["short_repeats"] | {"repeats": repeats})
    with tempfile.TemporaryDirectory() as folder:
        run = Run(Path(folder, "short"), loaded.experiment, loaded.points())
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
        if not all(0 < rate["median"] < math.inf for rate in record["rates"]):
            raise ValueError("it has a rate that is not positive")
    except Exception as error:
        raise UserError(
            f"{path}: cannot be compared ({error_text(error)})",
            "give a speed.json that `snooker bench speed --out DIR` wrote",
        ) from None
    return record


def _spread(rates: Sequence[float]) -> dict[str, float]:
    return {"median": statistics.median(rates), "lowest": min(rates), "highest": max(rates)}


def _rate(value: float) -> str:
    return f"{value / 1e6:.2f} M" if value >= 1e5 else f"{value:,.0f}"


CELLS: Cells = {
    "rate": lambda rate: str(rate["rate"]),
    "median": lambda rate: _rate(rate["median"]),
    "lowest to highest": lambda rate: f"{_rate(rate['lowest'])} to {_rate(rate['highest'])}",
}
