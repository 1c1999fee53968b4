"""The gas beside known values: all that is compared, as one record, and in one sentence."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from snooker_cli.analysis.predictions import DENSEST_FLUID
from snooker_cli.figures import NEUTRAL, FigureData, Layer, Line, Points, Reference, plain
from snooker_cli.formatting import Column, listed, short, table_lines, with_error
from snooker_cli.theory.equation_of_state import PUBLISHED_RATIOS
from snooker_cli.validation import physics_measurements
from snooker_cli.validation.physics_measurements import HAFF, KURTOSES, STATE, GasSample
from snooker_cli.validation.study import ALLOWED, EXACT, OWN, PUBLISHED, KnownValue, origin

Record = dict[str, Any]

SIMULATED = tuple(one.packing for one in PUBLISHED_RATIOS if one.packing <= DENSEST_FLUID)
"""Packings at which others have simulated a fluid, the thinnest first."""

NOTES = (
    "± and errors are standard errors of means over seeds, with the expected value's own error "
    "where it is known.",
    "Expected values are published, by simulation or theory, or exact, or own: simulated by "
    "independent code of this project, which is a check and no authority. Own are one a2 of each "
    "CoR, as the values that others have simulated are not at hand, and the kurtoses from equal "
    "speeds, of which we know no table.",
    "known: what N balls in a periodic box add to the expected value of infinitely many, by "
    "theory: N − 1 free velocities, and a number that does not fluctuate (Lebowitz & Percus "
    "1961); left is the difference without it, and open what the expected value leaves out.",
    "Temperatures in a periodic box are E/(N − 1). Z and the collision rate of a gas are of the "
    "same repeats and not independent, nor are the kurtoses after 1 to 6 collisions.",
    "Haff's law is for a gas that stays even, and cooling is compared in dilute gases. In a trial "
    "of 1,024 balls at packing 0.1 the rate was 1 % below theory at CoR 0.95, 3 % at 0.9, 14 % at "
    "0.8 and 34 % at 0.7. That what is open is of the order of the packing is an estimate, not a "
    "bound.",
    f"Simulated Z are Erpenbeck & Luban's, taken to be right to "
    f"{physics_measurements.PUBLISHED_PRECISION:g}; "
    "those of Engel et al. 2013 above a packing of 0.69, "
    "where disks order, are of 1,048,576 disks, which no short run can repeat.",
)
"""What a reader of the rows has to know."""


@dataclass(frozen=True)
class Plan:
    """The gases to measure, by what they are measured for."""

    quick: bool
    fluids: tuple[GasSample, ...]
    cooling: tuple[GasSample, ...]
    cooling_denser: tuple[GasSample, ...]
    relaxing: GasSample
    speeds: tuple[GasSample, ...]


def full_plan() -> Plan:
    """The plan of ``snooker bench physics``: two to four minutes on two processors."""
    packings = (0.1, 0.2, 0.3, 0.4, *SIMULATED)
    return Plan(
        quick=False,
        fluids=(
            GasSample(1024, 0.01, 100, 500, 24),
            *(GasSample(1024, packing, 100, 2000, 24) for packing in packings),
        ),
        cooling=tuple(GasSample(1024, 0.002, 10, 20, 300, cor) for cor in (0.95, 0.9, 0.8, 0.7)),
        cooling_denser=tuple(
            GasSample(1024, packing, 10, 20, 150, 0.9) for packing in (0.01, 0.05)
        ),
        relaxing=_relaxing(2048, 200),
        speeds=(
            GasSample(7, 0.2, 20, 8000, 64, shape="box"),
            GasSample(37, 0.2, 20, 8000, 64, shape="box"),
            GasSample(37, 0.2, 20, 5000, 64),
        ),
    )


def quick_plan() -> Plan:
    """The same with few balls, in seconds: to see that it works, not to be quoted."""
    return Plan(
        quick=True,
        fluids=tuple(GasSample(100, packing, 50, 200, 12) for packing in (0.3, SIMULATED[0])),
        cooling=(GasSample(256, 0.01, 10, 20, 20, 0.9),),
        cooling_denser=(GasSample(256, 0.05, 10, 20, 20, 0.9),),
        relaxing=_relaxing(200, 20),
        speeds=(GasSample(7, 0.2, 20, 1000, 12, shape="box"), GasSample(37, 0.2, 20, 300, 12)),
    )


def _relaxing(balls: int, seeds: int) -> GasSample:
    """Balls of equal speed, for one collision more than the table has."""
    return GasSample(balls, 0.01, 0, len(KURTOSES), seeds, speeds="equal")


def measured(plan: Plan, tell: Callable[[str], None] = lambda _: None) -> Record:
    """Carry out a plan; the record, with where and when it was made, as JSON has it.

    tell : is given a word on what is measured, from time to time
    """
    began, clock = datetime.now(UTC), time.perf_counter()
    found: list[KnownValue] = []
    for gas in plan.fluids:
        tell(f"pressure and collision rate at packing {gas.packing:.4g}")
        found += physics_measurements.fluid_rows(gas)
    for gas in (*plan.cooling, *plan.cooling_denser):
        tell(f"cooling at CoR {gas.cor:g} and packing {gas.packing:g}")
        found += physics_measurements.haff_rows(gas, dilute=gas in plan.cooling)
    tell("kurtosis from equal speeds")
    found += physics_measurements.relaxation_rows(plan.relaxing)
    for gas in plan.speeds:
        tell(f"speeds of {gas.balls} balls, {gas.shape}")
        found += physics_measurements.speed_rows(gas)
    order = list(dict.fromkeys(row.group for row in found))
    record: Record = plain(
        origin("physics", began, "numpy", "numba")
        | {
            "quick": plan.quick,
            "seconds": time.perf_counter() - clock,
            "allowed_errors": ALLOWED,
            "notes": NOTES,
            "rows": [
                row.as_json() for row in sorted(found, key=lambda row: order.index(row.group))
            ],
        }
    )
    return record


def verdict(record: Record) -> str:
    """How many rows agree, and which do not."""
    rows = record["rows"]
    out = [row for row in rows if not row["agrees"]]
    allowed = f"{record['allowed_errors']:g} standard errors and what is open"
    if not out:
        return f"all {len(rows)} rows agree: what is left is within {allowed}"
    names = listed([f"{row['quantity']} at packing {row['setting']['packing']:.4g}" for row in out])
    return f"{len(rows) - len(out)} of {len(rows)} rows agree; not within {allowed}: {names}"


def sentence(record: Record) -> str:
    """A measurement in the report's words, from its saved record."""
    rows = record["rows"]
    states = [row for row in rows if row["group"] == STATE]
    simulated = [row for row in states if "Luban" in row["source"]]
    haff = [row for row in rows if row["group"] == HAFF]
    packings = {row["setting"]["packing"] for row in states}
    cors = {row["setting"]["cor"] for row in haff}
    off = max(abs(row["difference"] - row["known"]) / row["expected"] for row in simulated)
    agreeing = sum(row["agrees"] for row in rows)
    beyond = sum(abs(row["left_in_errors"]) > 2 for row in rows if row["systematic"] == 0)
    plain_rows = sum(row["systematic"] == 0 for row in rows)
    balls = max(row["setting"]["balls"] for row in states)
    return (
        "The simulator itself was held to known values: pressures and collision rates of "
        f"{balls:,} disks in a periodic box at {len(packings)} packings, Haff's rate and a2 at "
        f"{len(cors)} coefficients, how equal speeds relax, and the law of speeds at fixed energy. "
        f"{_whose(rows)}. "
        f"{agreeing} of {len(rows)} agree within {record['allowed_errors']:g} standard errors and "
        f"what theory itself leaves open; more than two off are {beyond} of the {plain_rows} where "
        f"it leaves nothing open. PV/NT is within {_percent(off)} of what Erpenbeck & "
        "Luban simulated, once what a finite number lacks is counted "
        f"(snooker {record['snooker']}, {record['date'][:10]})."
    )


def _whose(rows: list[Record]) -> str:
    """How many expected values are somebody else's, exact, or our own."""
    words = {
        PUBLISHED: "{} of these values are published",
        EXACT: "{} are exact",
        OWN: "{} are of simulations by independent code of this project",
    }
    count = Counter(row["whose"] for row in rows)
    return listed([text.format(count[whose]) for whose, text in words.items()])


def _percent(share: float) -> str:
    """A share rounded up to its first digit, as 0.05 %."""
    if share <= 0:
        return "0 %"
    unit = 10.0 ** math.floor(math.log10(100 * share))
    return f"{math.ceil(round(100 * share / unit, 9)) * unit:.1g} %"


# A saved measurement of physics -> a picture: Z measured less published, over the packing.


def pictures(measurement: Record) -> list[tuple[str, FigureData]]:
    """The measurement's picture, with a name for its files."""
    return [("physics-state", state(measurement))]


def state(measurement: Record) -> FigureData:
    """Z less what is published, each source a series, beside what N balls are known to lack."""
    rows = [row for row in measurement["rows"] if row["group"] == STATE]
    layers: list[Layer] = [Reference("y", 0.0)]
    for series, source in enumerate(dict.fromkeys(row["source"] for row in rows)):
        x, y, error = _columns([row for row in rows if row["source"] == source])
        layers.append(
            Points(x, y, None, error, label=f"less {source}", series=series, filled=series > 0)
        )
    by_packing = sorted({(row["setting"]["packing"], row["known"]) for row in rows})
    packings, lacking = np.array(by_packing, dtype=np.float64).T
    balls = max(row["setting"]["balls"] for row in rows)
    layers.append(
        Line(packings, lacking, f"what {balls:,} balls are known to lack", NEUTRAL, "dashed")
    )
    worst = max(rows, key=lambda row: abs(row["left_in_errors"]))
    return FigureData(
        kind="physics-state",
        title="Equation of state, measured less published",
        x_label="packing fraction",
        y_label="difference of Z = PV/NT",
        layers=tuple(layers),
        caption=f"Elastic disks, {balls:,} in a periodic box, {rows[-1]['setting']['seeds']} seeds "
        "at each packing; bars are standard errors, that of the published value included. Off the "
        "dashed line, which is what a finite number lacks by theory, the farthest is by "
        f"{short(abs(worst['left_in_errors']), 2)} of them, at packing "
        f"{short(worst['setting']['packing'])}. snooker {measurement['snooker']}, "
        f"{measurement['date'][:10]}.",
        numbers={
            "rows": [
                {
                    "packing": row["setting"]["packing"],
                    **{
                        name: row[name] for name in ("source", "difference", "both_errors", "known")
                    },
                }
                for row in rows
            ]
        },
    )


def _columns(rows: list[Record]) -> np.ndarray:
    """Packing, difference and its error, a row each."""
    return np.array(
        [(row["setting"]["packing"], row["difference"], row["both_errors"]) for row in rows]
    ).T


# A measurement of physics -> its table for people.


def lines_of_physics(measurement: Record) -> Iterator[str]:
    """What was measured beside what is expected, group by group, and how to read it."""
    machine, versions = measurement["machine"], measurement["versions"]
    software = [f"snooker {measurement['snooker']}", f"engine {measurement['engine_version']}"]
    yield ", ".join([*software, *(f"{name} {number}" for name, number in versions.items())])
    yield (
        f"{measurement['date'][:10]}, {measurement['seconds']:.0f} s on {machine['processors']} "
        f"processors, {machine['platform']}" + (", quick: not to be quoted" * measurement["quick"])
    )
    rows = measurement["rows"]
    for group in dict.fromkeys(row["group"] for row in rows):
        yield ""
        yield group
        yield from table_lines(COLUMNS, [_cells(row) for row in rows if row["group"] == group])
    yield ""
    for row in _first_of_each(rows, "reason"):
        yield f"open, {row['group']}: {row['reason']}"
    yield from measurement["notes"]
    yield verdict(measurement)


COLUMNS = (
    Column("quantity"),
    Column("N", True),
    Column("packing", True),
    Column("CoR", True),
    Column("seeds × collisions", True),
    Column("measured", True),
    Column("expected", True),
    Column("whose"),
    Column("difference", True),
    Column("in errors", True),
    Column("known", True),
    Column("left, in errors", True),
    Column("open", True),
    Column("agrees"),
    Column("source, note"),
)


def _cells(row: Record) -> list[str]:
    """A row of the table."""
    setting = row["setting"]
    container = "" if setting["shape"] == "periodic" else f", {setting['shape']}"
    return [
        row["quantity"] + container,
        f"{setting['balls']:,}",
        f"{setting['packing']:.4g}",
        f"{setting['cor']:g}",
        f"{setting['seeds']} × {setting['collisions']:,}",
        with_error(row["measured"], row["error"]),
        short(row["expected"], 6),
        row["whose"],
        _signed(row["difference"]),
        f"{row['in_errors']:+.1f}".replace("-", "−"),
        _signed(row["known"]) if row["known"] else "–",
        f"{row['left_in_errors']:+.1f}".replace("-", "−"),
        short(row["systematic"], 2) if row["systematic"] else "–",
        "yes" if row["agrees"] else "no",
        "; ".join(filter(None, [row["source"], row["note"]])),
    ]


def _signed(value: float) -> str:
    """Two digits with their sign."""
    return f"{'+' if value >= 0 else ''}{short(value, 2)}"


def _first_of_each(rows: list[Record], key: str) -> list[Record]:
    """The first row of each text that is not empty."""
    found: dict[str, Record] = {}
    for row in rows:
        if row[key]:
            found.setdefault(row[key], row)
    return list(found.values())
