"""``snooker bench physics``: gases beside known values of their pressure, rates and speeds."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from snooker_cli.analysis.predictions import DENSEST_FLUID
from snooker_cli.containers import SHAPES
from snooker_cli.formatting import listed, short, with_error
from snooker_cli.theory.equation_of_state import PUBLISHED_RATIOS
from snooker_cli.validation.physics_measurements import (
    ALLOWED,
    HAFF,
    PUBLISHED_PRECISION,
    STATE,
    VIRIALS,
    GasSample,
    fluid_rows,
    haff_rows,
    speed_rows,
)
from snooker_cli.validation.study import Cells, Record, Study, header_lines, table

SIMULATED = tuple(one.packing for one in PUBLISHED_RATIOS if one.packing <= DENSEST_FLUID)
"""Packings with a published simulation of a fluid, the thinnest first."""

NOTES = (
    "± and errors are standard errors of means over seeds, with the expected value's own error "
    "where it is known.",
    "“Known” is the effect of N balls in a periodic box instead of infinitely many, by theory: "
    "N − 1 free velocities, and a number that does not fluctuate (Lebowitz & Percus 1961). “Left” "
    "is the difference without the known effect, in standard errors. “Open” is the uncertainty of "
    "the expected value itself: correlated collisions and a3 in Haff's law, a3 and squares of a2 "
    "in a2.",
    "Temperatures in a periodic box are E/(N − 1). Z and the collision rate of a gas come from the "
    "same repeats and are not independent.",
    "Haff's law is for a gas that stays homogeneous, so cooling is compared in dilute gases. "
    "An estimate, not a bound: the open part is of the order of the packing.",
    "Simulated Z are Erpenbeck & Luban's; we assume that they are right to "
    f"{PUBLISHED_PRECISION:g}. Those of Engel et al. 2013 above a packing of 0.69, where disks "
    "order, are for 1,048,576 disks, too many for a short run.",
)
"""What a reader of the rows has to know."""

ONLY_OPEN = "only with open"
"""The agreement of a row that deviates by more than ``ALLOWED``, but within what is open."""


@dataclass(frozen=True)
class PhysicsStudy(Study):
    """The gases to measure, by what they are measured for."""

    name = "physics"
    libraries = ("numpy", "numba")

    fluids: tuple[GasSample, ...]
    cooling: tuple[GasSample, ...]
    cooling_denser: tuple[GasSample, ...]
    speeds: tuple[GasSample, ...]
    quick: bool = False

    def results(self, report: Callable[[str], None]) -> Record:
        """The rows, in order, and notes on them."""
        found: list[Record] = []
        for gas in self.fluids:
            report(f"pressure and collision rate at packing {gas.packing:.4g}")
            found += fluid_rows(gas)
        for gas in (*self.cooling, *self.cooling_denser):
            report(f"cooling at CoR {gas.cor:g} and packing {gas.packing:g}")
            found += haff_rows(gas, dilute=gas in self.cooling)
        for gas in self.speeds:
            report(f"speeds of {gas.balls} balls, {gas.shape}")
            found += speed_rows(gas)
        groups = list(dict.fromkeys(row["group"] for row in found))
        found.sort(key=lambda row: groups.index(row["group"]))
        return {"allowed_errors": ALLOWED, "notes": NOTES, "rows": in_order(found)}

    @staticmethod
    def passed(record: Record) -> bool:
        """Whether all rows agree, some perhaps only with what is open."""
        return all(row["agrees"] for row in record["rows"])

    @staticmethod
    def tables(record: Record) -> Iterator[str]:
        """Measured beside expected values, a table for each group, and how to read them."""
        yield from header_lines(record)
        rows = in_order(record["rows"])
        for group in dict.fromkeys(row["group"] for row in rows):
            yield ""
            yield group
            shown = [row | row["setting"] for row in rows if row["group"] == group]
            yield from table(shown, CELLS, left=TEXTS)
        yield ""
        yield from record["notes"]
        yield verdict(record)


def full_study() -> PhysicsStudy:
    """Two to four minutes of measuring on two processors."""
    return PhysicsStudy(
        fluids=(
            GasSample(1024, 0.01, 100, 500, 24),
            *(
                GasSample(1024, packing, 100, 2000, 24)
                for packing in (0.1, 0.2, 0.3, 0.4, *SIMULATED)
            ),
        ),
        cooling=tuple(GasSample(1024, 0.002, 10, 20, 300, cor) for cor in (0.95, 0.9, 0.8, 0.7)),
        cooling_denser=tuple(GasSample(1024, each, 10, 20, 150, 0.9) for each in (0.01, 0.05)),
        speeds=(
            GasSample(7, 0.2, 20, 8000, 64, shape="box"),
            GasSample(37, 0.2, 20, 8000, 64, shape="box"),
            GasSample(37, 0.2, 20, 5000, 64),
        ),
    )


def quick_study() -> PhysicsStudy:
    """The same with few balls, in seconds."""
    return PhysicsStudy(
        fluids=tuple(GasSample(100, packing, 50, 200, 12) for packing in (0.3, SIMULATED[0])),
        cooling=(GasSample(256, 0.01, 10, 20, 20, 0.9),),
        cooling_denser=(GasSample(256, 0.05, 10, 20, 20, 0.9),),
        speeds=(GasSample(7, 0.2, 20, 1000, 12, shape="box"), GasSample(37, 0.2, 20, 300, 12)),
        quick=True,
    )


# The record in sentences and tables


def in_order(rows: Sequence[Record]) -> list[Record]:
    """Rows whose expected value leaves nothing open come first; groups stay together."""
    return sorted(rows, key=lambda row: row["systematic"] > 0)


def agreement(row: Record) -> str:
    """Whether a row agrees; what is open never hides a deviation of more than ``ALLOWED``."""
    if not row["agrees"]:
        return "no"
    return "yes" if abs(row["left_in_errors"]) <= ALLOWED else ONLY_OPEN


def verdict(record: Record) -> str:
    """The number of rows that agree, and the names and deviations of the others."""
    rows = record["rows"]
    found = f"{_agreeing(rows)} of {len(rows)} rows agree within {ALLOWED:g} standard errors"
    for answer, words in ((ONLY_OPEN, "only with what is open"), ("no", "not")):
        names = [
            f"{row['quantity']} at packing {row['setting']['packing']:.4g} ({_left(row)})"
            for row in rows
            if agreement(row) == answer
        ]
        if names:
            found += f"; {words}: {listed(names)}"
    return found


def _agreeing(rows: Sequence[Record]) -> int:
    return sum(agreement(row) == "yes" for row in rows)


def values(record: Record) -> Record:
    """The numbers of a saved measurement that our report states.

    off : the largest relative difference of Z from simulated values, in percent, rounded up
    rows : with their agreement, those with no systematic error first
    closed, agreeing_closed, beyond : these; of them, within ``ALLOWED`` standard errors, and more
        than two off
    only_open : rows that agree only with what is open
    """
    rows = [row | {"agreement": agreement(row)} for row in in_order(record["rows"])]
    states = [row for row in rows if row["group"] == STATE]
    simulated = [row for row in states if row["source"] != VIRIALS]
    closed = [row for row in rows if row["systematic"] == 0]
    off = max(abs(row["difference"] - row["known"]) / row["expected"] for row in simulated)
    return {
        "balls": max(row["setting"]["balls"] for row in states),
        "packings": len({row["setting"]["packing"] for row in states}),
        "coefficients": len({row["setting"]["cor"] for row in rows if row["group"] == HAFF}),
        "rows": rows,
        "agreeing": _agreeing(rows),
        "closed": len(closed),
        "agreeing_closed": _agreeing(closed),
        "only_open": [row for row in rows if row["agreement"] == ONLY_OPEN],
        "beyond": sum(abs(row["left_in_errors"]) > 2 for row in closed),
        "off": f"{math.ceil(1e4 * off) / 100:g}",
    }


CELLS: Cells = {
    "quantity": lambda row: row["quantity"] + _walls(row["shape"]),
    "N": lambda row: f"{row['balls']:,}",
    "packing": lambda row: f"{row['packing']:.4g}",
    "CoR": lambda row: f"{row['cor']:g}",
    "seeds × collisions": lambda row: f"{row['seeds']} × {row['collisions']:,}",
    "measured": lambda row: with_error(row["measured"], row["error"]),
    "expected": lambda row: short(row["expected"], 6),
    "difference": lambda row: _signed(row["difference"]),
    "known": lambda row: _signed(row["known"]) if row["known"] else "–",
    "left, in errors": lambda row: _left(row),
    "open": lambda row: short(row["systematic"], 2) if row["systematic"] else "–",
    "agrees": agreement,
    "source": lambda row: str(row["source"]),
}
"""The table of rows with their gases."""

TEXTS = ("quantity", "agrees", "source")


def _left(row: Record) -> str:
    """What is left, in standard errors."""
    return f"{row['left_in_errors']:+.1f}".replace("-", "−")


def _walls(shape: str) -> str:
    """The shape of a container with walls."""
    return f", {SHAPES[shape].title}" if SHAPES[shape].has_wall else ""


def _signed(value: float) -> str:
    """Two digits with their sign."""
    return f"{'+' if value >= 0 else ''}{short(value, 2)}"
