"""How every study of ``snooker bench`` runs: the steps of a plan, and their record.

A study is a module with one `Study`: its plan is in plans.yaml, its tables are in study_tables.py.
"""

import json
import platform
import re
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from snooker_cli import __version__
from snooker_cli.config import Config, load
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import UserError, install_advice
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.formatting import plain
from snooker_cli.runs.processes import processors

Record = dict[str, Any]
"""A measurement, or a part of it, as JSON stores it."""

PLANS: Record = yaml.safe_load(
    files("snooker_cli.validation").joinpath("plans.yaml").read_text("utf-8")
)
"""The content of plans.yaml."""


class Step(NamedTuple):
    """A part of a study, such as one scene.

    label : printed before it is measured
    part : the list of the record that gets the rows
    """

    label: str
    part: str
    rows: Callable[[], Iterable[Record]]


@dataclass(frozen=True)
class Study:
    """A measurement of the program itself.

    name : of the command, of the plan, and of the files
    libraries : their versions are in the record
    steps : what to measure for a plan, in this order
    conclude : further entries of the record, which follow from its rows
    figures : figures of a record by the names of their files
    passed : whether all results are as they must be
    """

    name: str
    libraries: tuple[str, ...]
    steps: Callable[[Record], Iterable[Step]]
    conclude: Callable[[Record], Record] = lambda _: {}
    figures: Callable[[Record], dict[str, FigureData]] = lambda _: {}
    passed: Callable[[Record], bool] = lambda _: True

    def plan(self, quick: bool = False) -> Record:
        """The whole plan of plans.yaml, or the one that is too small to be quoted."""
        return dict(PLANS[self.name]["quick" if quick else "full"], quick=quick)

    def measure(self, plan: Record, report: Callable[[str], None] = lambda _: None) -> Record:
        """The results of a plan with machine, date and versions.

        Raises ``UserError`` if a library is not installed.
        """
        versions = {"python": platform.python_version()}
        try:
            versions |= {name: import_module(name).__version__ for name in self.libraries}
        except ModuleNotFoundError as error:
            advice = install_advice("reference")
            raise UserError(f"{error.name} is not installed", advice) from None
        began, clock = datetime.now(UTC), time.perf_counter()
        results: Record = {}
        for step in self.steps(plan):
            report(step.label)
            results.setdefault(step.part, []).extend(step.rows())
        results |= self.conclude(results)
        record: Record = plain(
            {
                "measurement": self.name,
                "snooker": __version__,
                "engine_version": ENGINE_VERSION,
                "date": began.isoformat(timespec="seconds"),
                "seconds": time.perf_counter() - clock,
                "quick": plan["quick"],
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


def lattice_gas(
    container: Mapping[str, Any],
    cor: float = 1.0,
    keys: Mapping[str, Any] | None = None,
    **balls: Any,
) -> Config:
    """Equal balls on a lattice with Maxwell's speeds, 10 m/s (root mean square) by default.

    keys : further keys of the config
    """
    balls = {"speed": 10.0, "speeds": "maxwell"} | balls
    known = {"container": dict(container), "balls": balls, "cor": cor, "collisions": 1, "seed": 1}
    return load(known | dict(keys or {})).config


def text_of(record: Record) -> str:
    """A record as one line of JSON."""
    return json.dumps(record, ensure_ascii=False, allow_nan=False)


def machine(record: Mapping[str, Any]) -> str:
    """Processor and system of a measurement."""
    return f"{record['machine']['processor']}, {record['machine']['platform']}"


def _processor() -> str:
    """The name of the processor, or at least its type."""
    listed = Path("/proc/cpuinfo")
    text = listed.read_text(encoding="utf-8") if listed.exists() else ""
    model = re.search(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return model[1] if model else platform.processor() or platform.machine()
