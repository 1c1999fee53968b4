"""The record of any study of ``snooker bench``, also a saved one, as lines of text and as files."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from snooker_cli.errors import UserError, error_text
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, listed, short, text_table, with_error
from snooker_cli.validation.gas_samples import ONLY_OPEN
from snooker_cli.validation.hard_cases import INVARIANTS
from snooker_cli.validation.physics_study import walls
from snooker_cli.validation.study import PLANS, Record, Study, machine, text_of

Columns = Mapping[str, str | Callable[[Record], str]]
"""The columns of a table: headings, and a format or a function of a row of the record.

Headings of numbers begin with ``>``, which aligns them on the right.
"""


def lines(record: Record) -> Iterator[str]:
    """The lines that the command prints."""
    blocks = {"error": _error, "hard": _hard, "physics": _physics, "speed": _speed}
    for number, block in enumerate(blocks[record["measurement"]](record)):
        yield from ("", *block) if number else block


def write(study: Study, record: Record, folder: Path) -> Iterator[Path]:
    """Write the tables, the record and the figures into a folder; the paths."""
    from snooker_cli.figures.drawing import save

    contents = {"txt": "\n".join(lines(record)), "json": text_of(record)}
    for ending, content in contents.items():
        path = folder / f"{study.name}.{ending}"
        write_text(path, content + "\n")
        yield path
    for name, figure in study.figures(record).items():
        yield from save(figure, folder / name)


def _table(rows: Sequence[Record], columns: Columns) -> list[str]:
    cells = [
        [how.format_map(row) if isinstance(how, str) else how(row) for how in columns.values()]
        for row in rows
    ]
    return text_table([*columns], cells)


def _header(record: Record) -> list[str]:
    """Machine, date and versions of a measurement."""
    where = f"{machine(record)}, {counted(record['machine']['processors'], 'processor')}"
    versions = {"snooker": record["snooker"], "engine": record["engine_version"]}
    quick = ", quick: do not quote" * record["quick"]
    return [
        where,
        ", ".join(f"{name} {it}" for name, it in (versions | record["versions"]).items()),
        f"{record['date'][:10]}, {record['seconds']:.0f} s{quick}",
    ]


def _small(value: float | None) -> str:
    """An error to two digits, as 1.2e−15; a dash for none."""
    return "–" if value is None else f"{value:.1e}".replace("-", "−")


# Errors


def _error(record: Record) -> Iterator[list[str]]:
    yield _header(record)
    yield PLANS["legends"]["error"]
    for scene in record["scenes"]:
        collisions = scene["collisions"]
        places: Columns = {
            f">m at {events}": lambda row, k=k: _small(row["place_errors"][k])  # type: ignore[misc]
            for k, events in enumerate(scene["checkpoints"])
            if events in (10, 100, collisions)
        }
        title = f"{scene['name']}: {scene['what']}; {counted(collisions, 'event')}"
        columns = {**METHOD, **COST, **places, **ERRORS}
        yield [f"{title}, all of them certain", *_table(scene["results"], columns)]
    for ensemble in record["ensembles"]:
        rows = [method | bias for method in ensemble["methods"] for bias in method["biases"]]
        yield [
            f"averages of {ensemble['what']}: {ensemble['repeats']} repeats of "
            f"{ensemble['time']:g} s, and differences from snooker's, ± standard error",
            *_table(rows, {**METHOD, **AVERAGES}),
        ]


METHOD: Columns = {"method": "{method}"}
COST: Columns = {">events/s": "{events_per_second:,.0f}"}
ERRORS: Columns = {
    ">true": "{first_different}",
    ">events": "{collisions}",
    ">overlap, m": lambda row: _small(row["overlap"]),
    ">energy": lambda row: _small(row["energy"]),
}
AVERAGES: Columns = {
    "quantity": "{quantity}",
    ">mean": lambda row: with_error(row["mean"], row["error"]),
    ">difference": lambda row: with_error(row["difference"], row["difference_error"]),
    ">overlap, m": lambda row: _small(row["overlap"]),
    ">in repeats": "{overlapping}",
}


# Hard cases


def _hard(record: Record) -> Iterator[list[str]]:
    cases = record["cases"]
    yield _table(
        cases,
        {"case": "{name}", "why it is hard": "{why}"},
    )
    yield PLANS["legends"]["hard"]
    yield _table(cases, VERDICTS)
    failed = sum(not case["holds"] for case in cases)
    runs = counted(sum(case["runs"] for case in cases), "run")
    verdict = f"{counted(failed, 'case')} failed" if failed else "all hold"
    faults = [f"{case['name']}, {fault}" for case in cases for fault in case["faults"]]
    yield [*faults, f"{counted(len(cases), 'case')}, {runs}: {verdict}"]


def _endings(case: Record) -> str:
    endings = case["endings"]
    return ", ".join(f"{one['runs']} {one['reason'].replace('_', ' ')}" for one in endings)


def _worst(name: str, case: Record) -> str:
    if name not in case["worst"]:
        return "–"
    error = case["worst"][name]["error"]
    return "infinite" if error is None else _small(error) if error else "0"


def _facts(case: Record) -> str:
    """How many of the checks hold that not every case has."""
    others = case["worst"].keys() - {"numbers", *INVARIANTS}
    return f"{sum(case['worst'][name]['holds'] for name in others)} of {len(others)}"


VERDICTS: Columns = {
    "case": "{name}",
    ">events": "{events:,}",
    "ended": _endings,
    **{f">{name}": partial(_worst, name) for name in INVARIANTS},
    ">facts": _facts,
    "verdict": lambda case: "holds" if case["holds"] else "fails",
}


# Known physics


def _physics(record: Record) -> Iterator[list[str]]:
    yield _header(record)
    for group in dict.fromkeys(row["group"] for row in record["rows"]):
        shown = [row | row["setting"] for row in record["rows"] if row["group"] == group]
        yield [group, *_table(shown, VALUES)]
    yield [*record["notes"], _agreement(record)]


def _agreement(record: Record) -> str:
    """The number of rows that agree, and the names and deviations of the others."""
    rows = record["rows"]
    agreeing = sum(row["agreement"] == "yes" for row in rows)
    closed = sum(not row["systematic"] for row in rows)
    sentence = (
        f"{agreeing} of {len(rows)} rows agree within {record['allowed_errors']:g} standard "
        f"errors; by chance alone {record['by_chance']:.2g} of the {closed} without an open part "
        "would not"
    )
    for answer, words in ((ONLY_OPEN, "only with what is open"), ("no", "not")):
        names = [
            f"{row['quantity']} at packing {row['setting']['packing']:.4g} and "
            f"CoR {row['setting']['cor']:g} ({_left(row)})"
            for row in rows
            if row["agreement"] == answer
        ]
        if names:
            sentence += f"; {words}: {listed(names)}"
    return sentence


def _left(row: Record) -> str:
    return f"{row['left_in_errors']:+.1f}".replace("-", "−")


VALUES: Columns = {
    "quantity": "{quantity}",
    "walls": walls,
    ">start, m/s": "{speed:g}",
    ">N": "{balls:,}",
    ">packing": "{packing:.4g}",
    ">CoR": "{cor:g}",
    ">seeds × collisions": "{seeds} × {collisions:,}",
    ">measured": lambda row: with_error(row["measured"], row["error"]),
    ">expected": lambda row: short(row["expected"], 6),
    ">known": lambda row: short(row["known"] or None, 2),
    ">left, in errors": _left,
    ">open": lambda row: short(row["systematic"] or None, 2),
    "agrees": "{agreement}",
    "source": "{source}",
}


# Speed


def _speed(record: Record) -> Iterator[list[str]]:
    yield _header(record)
    if "earlier" not in record:
        yield _table(record["rates"], RATES)
        return
    yield ["then:", *_header(record["earlier"])]
    then = {rate["rate"]: rate["median"] for rate in record["earlier"]["rates"]}
    change: Columns = {
        ">then": lambda rate: _rate(then[rate["rate"]]),
        ">now/then": lambda rate: f"{rate['median'] / then[rate['rate']]:.2f}",
    }
    yield _table([rate for rate in record["rates"] if rate["rate"] in then], {**RATES, **change})


def _rate(value: float) -> str:
    return f"{value / 1e6:.2f} M" if value >= 1e5 else f"{value:,.0f}"


RATES: Columns = {
    "rate": "{rate}",
    ">median": lambda rate: _rate(rate["median"]),
    ">lowest to highest": lambda rate: f"{_rate(rate['lowest'])} to {_rate(rate['highest'])}",
}


def earlier_record(path: Path) -> Record:
    """The record in a JSON file that ``bench speed`` wrote.

    Raises ``UserError`` if the file cannot be read or is not such a record.
    """
    try:
        record: Record = json.loads(path.read_text(encoding="utf-8"))
        if (study := record["measurement"]) != "speed":
            raise ValueError(f"it has a measurement of `snooker bench {study}`")
        record.pop("earlier", None)
        list(lines(record))
        if not all(0 < rate["median"] < math.inf for rate in record["rates"]):
            raise ValueError("it has a rate that is not positive")
    except Exception as error:
        raise UserError(
            f"{path}: cannot be compared ({error_text(error)})",
            "give a speed.json that `snooker bench speed --out DIR` wrote",
        ) from None
    return record
