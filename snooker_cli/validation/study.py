"""The structure of every study of ``snooker bench``: plan, measure, tables, figures, files."""

import json
import platform
import re
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any, ClassVar, Self

import yaml
from pydantic import ConfigDict, TypeAdapter

from snooker_cli import __version__
from snooker_cli.config import Experiment, load
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import UserError, install_advice
from snooker_cli.figures import FigureData
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, plain, text_table
from snooker_cli.runs.execution import processors

Record = dict[str, Any]  # a measurement, or a part of it, as JSON stores it

Cells = Mapping[str, Callable[[Record], str]]
"""The columns of a table: headings, and how a row of the record gives their text."""

PLANS: Record = yaml.safe_load(
    files("snooker_cli.validation").joinpath("plans.yaml").read_text("utf-8")
)
"""The content of plans.yaml."""

STRICT = ConfigDict(extra="forbid")  # a plan has no other keys than its class

LEGENDS: Mapping[str, Sequence[str]] = PLANS["legends"]


@dataclass(frozen=True)
class Study(ABC):
    """A measurement of the program itself. An instance is the plan of one measurement.

    name : of the command and of the files
    libraries : their versions are in the record
    quick : whether the plan is too small to be quoted
    """

    name: ClassVar[str]
    libraries: ClassVar[tuple[str, ...]]
    __pydantic_config__: ClassVar = STRICT
    quick: bool = field(default=False, kw_only=True)

    @classmethod
    def planned(cls, name: str) -> Self:
        """The plan "full" or "quick" of plans.yaml."""
        plan = PLANS[cls.name][name] | {"quick": name == "quick"}
        return TypeAdapter(cls).validate_python(plan)

    @abstractmethod
    def results(self, report: Callable[[str], None]) -> Record:
        """Measure; ``report`` receives a line before each step."""

    @staticmethod
    @abstractmethod
    def tables(record: Record) -> Iterator[str]:
        """The lines that the command prints."""

    @staticmethod
    def figures(record: Record) -> dict[str, FigureData]:
        """The figures by the names of their files."""
        return {}

    @staticmethod
    def passed(record: Record) -> bool:
        """Whether all results are as they must be."""
        return True

    def measure(self, report: Callable[[str], None] = lambda _: None) -> Record:
        """The results of the plan with machine, date and versions.

        Raises ``UserError`` if a library is not installed.
        """
        versions = {"python": platform.python_version()}
        try:
            versions |= {name: import_module(name).__version__ for name in self.libraries}
        except ModuleNotFoundError as error:
            advice = install_advice("reference")
            raise UserError(f"{error.name} is not installed", advice) from None
        began, clock = datetime.now(UTC), time.perf_counter()
        results = self.results(report)
        record: Record = plain(
            {
                "measurement": self.name,
                "snooker": __version__,
                "engine_version": ENGINE_VERSION,
                "date": began.isoformat(timespec="seconds"),
                "seconds": time.perf_counter() - clock,
                "quick": self.quick,
                "machine": {
                    "platform": platform.platform(),
                    "processor": _processor(),
                    "processors": processors(),
                },
                "versions": versions,
            }
            | results
        )
        return record

    def write(self, record: Record, folder: Path) -> list[Path]:
        """Write the tables, the record and the figures into a folder; the paths."""
        from snooker_cli.figures.drawing import save

        contents = {"txt": "\n".join(self.tables(record)), "json": text_of(record)}
        written = []
        for ending, content in contents.items():
            written.append(folder / f"{self.name}.{ending}")
            write_text(written[-1], content + "\n")
        for name, figure in self.figures(record).items():
            written += save(figure, folder / name)
        return written


def lattice_gas(
    container: Mapping[str, Any],
    cor: float = 1.0,
    keys: Mapping[str, Any] | None = None,
    **balls: Any,
) -> Experiment:
    """Equal balls on a lattice with Maxwell's speeds, 10 m/s (root mean square) by default.

    keys : further keys of the config
    """
    balls = {"speed": 10.0, "speeds": "maxwell"} | balls
    known = {"container": dict(container), "balls": balls, "cor": cor, "collisions": 1, "seed": 1}
    return load(known | dict(keys or {})).experiment


def text_of(record: Record) -> str:
    """A record as one line of JSON."""
    return json.dumps(record, ensure_ascii=False, allow_nan=False)


def machine(record: Mapping[str, Any]) -> str:
    """Processor and system of a measurement."""
    return f"{record['machine']['processor']}, {record['machine']['platform']}"


def header_lines(record: Record) -> Iterator[str]:
    """Machine, date and versions of a measurement."""
    yield f"{machine(record)}, {counted(record['machine']['processors'], 'processor')}"
    versions = {"snooker": record["snooker"], "engine": record["engine_version"]}
    yield ", ".join(f"{name} {number}" for name, number in (versions | record["versions"]).items())
    quick = ", quick: do not quote" * record["quick"]
    yield f"{record['date'][:10]}, {record['seconds']:.0f} s{quick}"


def table(rows: Sequence[Record], cells: Cells, left: Container[str]) -> list[str]:
    """Rows under headings; ``left`` has the headings of columns of text."""
    headings = [heading if heading in left else f">{heading}" for heading in cells]
    return text_table(headings, [[cell(row) for cell in cells.values()] for row in rows])


def small(value: float | None) -> str:
    """An error to two digits, as 1.2e−15; a dash for none."""
    return "–" if value is None else f"{value:.1e}".replace("-", "−")


def _processor() -> str:
    """The name of the processor, or at least its type."""
    listed = Path("/proc/cpuinfo")
    text = listed.read_text(encoding="utf-8") if listed.exists() else ""
    model = re.search(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return model[1] if model else platform.processor() or platform.machine()
