"""Runs: open them, see what is there, check it, analyse it, draw it and export it."""

import html
import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any, TextIO, overload

from numpy.typing import ArrayLike

from snooker_cli import runs
from snooker_cli.api import exports
from snooker_cli.api.analyses import Analyses, SideBySide, several
from snooker_cli.api.output_files import made_folder, own_output
from snooker_cli.api.results import Outcome, Result, Results, Verdicts
from snooker_cli.api.wording import LIST_FIGURES, in_python
from snooker_cli.errors import check_name
from snooker_cli.formatting import point_label
from snooker_cli.runs.status import ended, run_status

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class Run(Analyses):
    """A run's folder: its ``points``, and the repeats that are there.

    This is the ``Run`` of the package ``runs`` with what scripts use. ``run[point, repeat]`` is a
    repeat, and ``for repeat in run`` gives all of them. One file is in memory at a time: a long
    repeat, or a batch of short ones.

    outcome : what ``snooker.run`` has just done; ``None`` for a run that was opened
    """

    outcome: Outcome | None = None

    def __dir__(self) -> list[str]:
        """What scripts use, for completion."""
        own = (name for name in (vars(Analyses) | vars(Run)) if name[0] != "_")
        return ["directory", "name", "experiment", "points", *own]

    def _repr_html_(self) -> str:
        """A table of the points, in a notebook."""
        rows = [["point", "repeats", "ended", "collisions"]]
        for row in run_status(self)["ledger"]:
            cells = point_label(row["parameters"]), row["done"], ended(row), row["collisions"]
            rows.append([html.escape(str(cell)) for cell in cells])
        table = "".join(f"<tr><td>{'<td>'.join(cells)}" for cells in rows)
        return f"<p>{html.escape(self.experiment.title or self.name)}</p><table>{table}</table>"

    # What is there, and whether it is sound.

    @in_python()
    def status(self) -> Result:
        """The state of the run: points, ends of repeats and files, as ``show --json`` prints it.

        ``ledger`` has the numbers of each point. Raises ``RunError`` or ``StoreError``.
        """
        from snooker_cli.api.verdicts import status_of

        return status_of(self)

    @in_python()
    def hashes(self, point: int | None = None, repeat: int | None = None) -> Results:
        """Hashes of the first 1,000, 10,000 … and of all collisions of repeats.

        point, repeat : only of this point, and of this repeat of each point

        The records have ``point``, ``parameters``, ``repeat`` and ``hashes``, as ``Repeat.hashes``
        gives them. Raises ``UserError`` for summaries.
        """
        from snooker_cli.api.verdicts import hashes_of

        return hashes_of(self, point, repeat)

    @in_python()
    def verify(self, *, replay: bool = False, jobs: int | None = None) -> Verdicts:
        """Read and check every file: its hash, the range of each value, its config, its start.

        replay : simulate every repeat again, with threads, and compare all bits
        jobs : threads [all cores]

        ``verdicts.sound`` is whether no file is bad. The keys are those of ``verify --json``.
        Raises ``RunError`` for a replay of another engine version's results.
        """
        from snooker_cli.api.verdicts import verified

        return verified(self, replay=replay, jobs=jobs)

    @in_python()
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

        point, repeat : this repeat of a point, or of every point
        collisions : at most these
        out : a file for the certificate of one repeat
        replace : whether it may exist already

        Raises ``UserError`` without python-flint, or if the scene has no exact twin.
        """
        from snooker_cli.api.verdicts import proofs

        path = None if out is None else Path(out)
        return proofs(self, point, repeat, collisions, path, replace)

    # A report.

    @in_python()
    def report(
        self,
        out: str | PathLike[str] | None = None,
        figures: str | Sequence[str] = (),
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

    @in_python()
    def export(self, out: exports.Target, *, replace: bool = True, **where: Any) -> Path | None:
        """Write ``table`` to a file, which is returned, or to a stream. Raises as ``table``.

        out : a file in .csv or .parquet, or a stream that gets CSV
        replace : whether the file may exist already
        """
        exports.export_table(self, out, self.matching(**where), replace)
        return Path(out) if isinstance(out, str | PathLike) else None

    @in_python()
    def export_events(
        self, out: exports.Target, point: int = 0, repeat: int = 0, *, replace: bool = True
    ) -> None:
        """Write the collisions of a repeat: time (s), i, j and impulse (kg m/s).

        Of rough balls the tangential impulse too.

        out : a file in .csv or .parquet, or a stream that gets CSV
        replace : whether the file may exist already

        Memory stays bounded. Raises ``UserError`` for a summary.
        """
        exports.export_events(self, out, point, repeat, replace)

    @in_python()
    def export_states(
        self,
        out: exports.Target,
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
        times : s, ascending; or a text such as ``"0:10:11"`` [0 and the end]
        frames : instead of times, a number of even ones
        replace : whether the file may exist already

        Raises ``UserError`` for a summary.
        """
        exports.export_states(self, out, times, frames, point, repeat, replace)


@overload
def open(name: str | PathLike[str], /) -> Run: ...


@overload
def open(name: str | PathLike[str], /, *others: str | PathLike[str]) -> SideBySide: ...


@in_python()
def open(name: str | PathLike[str], /, *others: str | PathLike[str]) -> Run | SideBySide:
    """A run by its folder or its name under ``runs/``; of several names, the runs side by side.

    Raises ``RunError`` or ``StoreError``, and ``RunError`` for a run that is named twice.
    """
    if others:
        return SideBySide.of([open(name), *map(open, others)])
    run = runs.open_run(Path(name))
    return Run(*(getattr(run, field.name) for field in fields(run)))


@in_python()
def statuses(folder: str | PathLike[str] = "runs") -> Results:
    """The state of each run in a folder, as ``ls --json`` prints it; of a bad one its ``error``.

    Raises ``RunError`` if there is no such folder.
    """
    from snooker_cli.api.verdicts import statuses_in

    return statuses_in(Path(folder))


def figure_list() -> list[dict[str, Any]]:
    """All figures: ``figure`` (its name), ``title``, ``needs`` and ``report_figures``.

    ``reproduce_only``: it is left out of the figures of a run, unless it is named.
    """
    from snooker_cli.api.drawings import registry

    return registry()


def plugin_list() -> list[dict[str, Any]]:
    """What installed packages can add to: all quantities, theories, figures and formats.

    ``group``, ``name``, ``distribution`` and ``version``; those of snooker come first. What a
    package adds has its ``entry`` point. If it could not be added, it has the ``problem`` and no
    ``name``.
    """
    from snooker_cli.api.plugin_lists import listed_plugins

    return listed_plugins()


def runs_and_figures(names: Iterable[str]) -> tuple[list[str], list[str]]:
    """Names that are given together: those of runs, and of figures; an unknown one is a figure."""
    from snooker_cli.figures import FIGURES

    known: dict[bool, list[str]] = {True: [], False: []}
    for name in names:
        is_run = name not in FIGURES and any(
            (folder / runs.MANIFEST).is_file() for folder in (Path(name), runs.RUNS / name)
        )
        known[is_run].append(name)
    return known[True], known[False]


@in_python()
def write_report(
    runs: Iterable[Run | str | PathLike[str]],
    out: str | PathLike[str] | None = None,
    figures: str | Sequence[str] = (),
    *,
    markdown: bool = False,
) -> list[Path]:
    """Write a report on runs as HTML and PDF, a chapter each; the pages' files.

    out : the report's folder [``report`` in that of the first run]
    figures : names of figures that it shows too, or ``"all"``
    markdown : write a text in Markdown instead, with its figures beside it and without films

    Raises ``FigureError`` without repeats, and ``UserError`` without the report's libraries.
    """
    from snooker_cli.figures import FIGURES, own_figures
    from snooker_cli.report.run_report import run_report

    asked = list(own_figures()) if figures == "all" else several(figures)
    for name in asked:
        check_name(name, FIGURES, "figure", LIST_FIGURES)
    opened = [run if isinstance(run, Run) else open(run) for run in runs]
    folder = own_output(opened[0].directory / "report") if out is None else Path(out)
    with made_folder(folder):
        return run_report(opened, folder, _log.info, asked, markdown)
