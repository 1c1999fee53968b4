"""Runs: open them, see what is there, check it, analyse it, draw it and export it."""

import html
import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, overload

from numpy.typing import ArrayLike

from snooker_cli import options, runs
from snooker_cli.api.analyses import AnalysedRun, several
from snooker_cli.api.arguments import with_options
from snooker_cli.api.results import CommandResult, CommandResults, Outcome, Verdicts
from snooker_cli.errors import check_name
from snooker_cli.formatting import point_label

if TYPE_CHECKING:
    from snooker_cli.api.exports import Target
    from snooker_cli.api.side_by_side_analyses import SideBySide

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class Run(AnalysedRun):
    """A run's folder: its ``points``, and the repeats that are there.

    outcome : what ``snooker.run`` has just done; ``None`` for a run that was opened
    """

    outcome: Outcome | None = None

    def __dir__(self) -> list[str]:
        """What scripts use, for completion."""
        own = (name for name in (vars(AnalysedRun) | vars(Run)) if name[0] != "_")
        return ["directory", "name", "config", "points", *own]

    def _repr_html_(self) -> str:
        """A table of the points, in a notebook."""
        from snooker_cli.runs.status import ended, run_status

        rows = [["point", "repeats", "ended", "collisions"]]
        for row in run_status(self)["ledger"]:
            cells = point_label(row["parameters"]), row["done"], ended(row), row["collisions"]
            rows.append([html.escape(str(cell)) for cell in cells])
        table = "".join(f"<tr><td>{'<td>'.join(cells)}" for cells in rows)
        return f"<p>{html.escape(self.config.title or self.name)}</p><table>{table}</table>"

    # What is there, and whether it is sound.

    def status(self) -> CommandResult:
        """The state of the run: points, ends of repeats and files, as ``show --json`` prints it.

        ``ledger`` has the numbers of each point. Raises ``RunError`` or ``StoreError``.
        """
        from snooker_cli.api.checks import status_of

        return status_of(self)

    @with_options(options.HASHES_POINT, options.HASHES_REPEAT)
    def hashes(self, point: int | None = None, repeat: int | None = None) -> CommandResults:
        """Hashes of the first 1,000, 10,000 … and of all collisions of repeats.

        The records have ``point``, ``parameters``, ``repeat`` and ``hashes``, as ``Repeat.hashes``
        gives them. Raises ``UserError`` for summaries.
        """
        from snooker_cli.api.checks import hashes_of

        return hashes_of(self, point, repeat)

    @with_options(options.REPLAY, options.JOBS)
    def verify(self, *, replay: bool = False, jobs: int | None = None) -> Verdicts:
        """Read and check every file: its hash, the range of each value, its config, its start.

        ``verdicts.sound`` is whether no file is bad. The keys are those of ``verify --json``.
        Raises ``RunError`` for a replay of another engine version's results.
        """
        from snooker_cli.api.checks import verified

        return verified(self, replay=replay, jobs=jobs)

    @with_options(
        *(options.EXACT_POINT, options.EXACT_REPEAT, options.EXACT_COLLISIONS, options.CERTIFICATE),
        options.REPLACE,
    )
    def prove(
        self,
        point: int | None = None,
        repeat: int = 0,
        *,
        collisions: int = 10_000,
        out: str | PathLike[str] | None = None,
        replace: bool = True,
    ) -> Verdicts:
        """Prove which collisions of a repeat are certain, as ``verify --exact``.

        The ending and a summary are compared with a new simulation.

        Raises ``UserError`` without python-flint, or if the scene has no exact twin.
        """
        from snooker_cli.api.checks import proofs

        path = None if out is None else Path(out)
        return proofs(self, point, repeat, collisions, path, replace)

    # A report.

    def report(
        self,
        out: str | PathLike[str] | None = None,
        figures: str | Sequence[str] = "",
        *,
        markdown: bool = False,
    ) -> list[Path]:
        """Write the report on this run; the arguments are those of ``snooker.write_report``."""
        return write_report([self], out, figures, markdown=markdown)

    # Files for other programs.

    @overload
    def export(self, out: str | PathLike[str], *, replace: bool = ..., **where: Any) -> Path: ...

    @overload
    def export(self, out: TextIO, *, replace: bool = ..., **where: Any) -> None: ...

    @with_options()
    def export(self, out: "Target", *, replace: bool = True, **where: Any) -> Path | None:
        """Write ``table`` to a file, which is returned, or to a stream. Raises as ``table``.

        out : a file in .csv or .parquet, or a stream that gets CSV
        replace : whether the file may exist already
        """
        from snooker_cli.api import exports

        exports.export_table(self, out, self.matching(**where), replace)
        return Path(out) if isinstance(out, str | PathLike) else None

    @with_options(options.POINT, options.EXPORT_REPEAT)
    def export_events(
        self, out: "Target", point: int = 0, repeat: int = 0, *, replace: bool = True
    ) -> None:
        """Write the collisions of a repeat: time (s), i, j and impulse (kg m/s).

        Of rough balls the tangential impulse too.

        out : a file in .csv or .parquet, or a stream that gets CSV
        replace : whether the file may exist already

        Memory stays bounded. Raises ``UserError`` for a summary.
        """
        from snooker_cli.api import exports

        exports.export_events(self, out, point, repeat, replace)

    @with_options(options.STATE_TIMES, options.FRAMES, options.POINT, options.EXPORT_REPEAT)
    def export_states(
        self,
        out: "Target",
        times: ArrayLike | str | None = None,
        *,
        frames: int | None = None,
        point: int = 0,
        repeat: int = 0,
        replace: bool = True,
    ) -> None:
        """Write positions (m) and velocities (m/s) of all balls of a repeat at some times.

        Of rough balls the spins too, rad/s.

        out : a file in .csv, .parquet, .h5md, .h5 or .xyz, or a stream that gets CSV
        replace : whether the file may exist already

        Raises ``UserError`` for a summary.
        """
        from snooker_cli.api import exports

        exports.export_states(self, out, times, frames, point, repeat, replace)


@overload
def open(name: str | PathLike[str], /) -> Run: ...


@overload
def open(name: str | PathLike[str], /, *others: str | PathLike[str]) -> "SideBySide": ...


def open(name: str | PathLike[str], /, *others: str | PathLike[str]) -> "Run | SideBySide":
    """A run by its folder or its name under ``runs/``; of several names, the runs side by side.

    Raises ``RunError`` or ``StoreError``, and ``RunError`` for a run that is named twice.
    """
    if others:
        from snooker_cli.api.side_by_side_analyses import SideBySide

        return SideBySide.of([open(name), *map(open, others)])
    run = runs.open_run(Path(name))
    return Run(*(getattr(run, field.name) for field in fields(run)))


def statuses(folder: str | PathLike[str] = "runs") -> CommandResults:
    """The state of each run in a folder, as ``ls --json`` prints it; of a bad one its ``error``.

    Raises ``RunError`` if there is no such folder.
    """
    from snooker_cli.api.checks import statuses_in

    return statuses_in(Path(folder))


def figure_list() -> list[dict[str, Any]]:
    """All figures: ``figure`` (its name), ``title``, ``needs`` and ``report_figures``.

    ``reproduce_only``: it is left out of the figures of a run, unless it is named.
    """
    from snooker_cli.figures.registry import FIGURES

    return [
        {
            "figure": spec.name,
            "title": spec.title,
            "needs": spec.needs,
            "report_figures": list(spec.report_figures),
            "reproduce_only": spec.reproduce_only,
        }
        for spec in FIGURES.values()
    ]


def plugin_list() -> list[dict[str, Any]]:
    """What installed packages can add to: all laws, quantities, theories, figures and formats.

    ``group``, ``name``, ``distribution`` and ``version``; those of snooker come first. What a
    package adds has its ``entry`` point. If it could not be added, it has the ``problem`` and no
    ``name``.
    """
    from snooker_cli.api.plugin_lists import listed_plugins

    return listed_plugins()


def runs_and_figures(names: Iterable[str]) -> tuple[list[str], list[str]]:
    """Names that are given together: those of runs, and of figures; an unknown one is a figure."""
    from snooker_cli.figures.registry import FIGURES

    known: dict[bool, list[str]] = {True: [], False: []}
    for name in names:
        is_run = name not in FIGURES and any(
            (folder / runs.MANIFEST).is_file() for folder in (Path(name), runs.RUNS / name)
        )
        known[is_run].append(name)
    return known[True], known[False]


@with_options(options.REPORT_OUT, options.FIGURES, options.MARKDOWN)
def write_report(
    runs: Iterable[Run | str | PathLike[str]],
    out: str | PathLike[str] | None = None,
    figures: str | Sequence[str] = "",
    *,
    markdown: bool = False,
) -> list[Path]:
    """Write a report on runs as HTML and PDF, a chapter each; the pages' files.

    ``markdown=True`` writes a text for your own use instead, without films. Raises ``FigureError``
    without repeats, and ``UserError`` without the report's libraries.
    """
    from snooker_cli.api.output_files import made_folder, own_output
    from snooker_cli.figures.registry import FIGURES, own_figures
    from snooker_cli.report.run_report import run_report

    asked = list(own_figures()) if figures == "all" else several(figures)
    for name in asked:
        check_name(name, FIGURES, "figure", options.FIGURE_NAMES)
    opened = [run if isinstance(run, Run) else open(run) for run in runs]
    folder = own_output(opened[0].directory / "report") if out is None else Path(out)
    with made_folder(folder):
        return run_report(opened, folder, _log.info, asked, markdown)
