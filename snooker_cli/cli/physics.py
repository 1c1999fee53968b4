"""A measurement of physics -> its table for people."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from snooker_cli.bench.physics import verdict
from snooker_cli.cli.tables import Column, table_lines
from snooker_cli.words import short, with_error

Record = dict[str, Any]


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
