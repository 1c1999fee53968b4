"""A measurement of speed -> its tables for people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from snooker_cli.cli.tables import Column, table_lines
from snooker_cli.words import counted, short

Record = dict[str, Any]


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
