"""``snooker plot`` and ``animate``: figures and films of runs."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from snooker_cli.analysis.run_analysis import shorter_note
from snooker_cli.animation import Film, film, page
from snooker_cli.cli.options import (
    RUN,
    AsJson,
    PointNumber,
    RepeatNumber,
    RunName,
    check_name,
    chosen_point,
    explanation,
)
from snooker_cli.cli.output import notice, print_json, print_line, print_table
from snooker_cli.errors import FigureError, UserError
from snooker_cli.figures import FIGURES, FigureSpec, Selection, selected, unfinished
from snooker_cli.formatting import Column, counted
from snooker_cli.runs import Run, open_run
from snooker_cli.trace import Trace

ENDINGS = (".html", ".gif", ".mp4")
SECONDS = 12.0
FRAMES_PER_SECOND = 20
MOST_MAGNIFIED = 1e12


def complete_figures(context: typer.Context) -> list[tuple[str, str]]:
    """Figures that are not on the command line yet."""
    given = context.params.get("figures") or ()
    return [(name, explanation(one.title)) for name, one in FIGURES.items() if name not in given]


def plot(
    run: Annotated[str | None, RUN] = None,
    figures: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FIGURE]...",
            help="Names of figures [all that are possible for RUN].",
            autocompletion=complete_figures,
        ),
    ] = None,
    list_figures: Annotated[
        bool, typer.Option("--list", help="List the figures and what each needs.")
    ] = False,
    where: Annotated[
        list[str] | None,
        typer.Option(
            "--where",
            metavar="KEY=VALUE",
            help="Only points with this value, as `cor=0.8` or `cor=0.8,0.9`. Can be repeated.",
        ),
    ] = None,
    repeat: Annotated[
        int | None,
        typer.Option("--repeat", metavar="K", min=0, help="Only this repeat [the first, or all]."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder [RUN/figures]."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Draw figures of RUN as SVG, PNG and JSON.

    The JSON file has the numbers that a figure shows. Without names, all possible figures are
    drawn. For other figures, the reason is printed. Figures of single points are drawn for each
    point. The names of the written files are printed.
    """
    if list_figures:
        _print_figures(as_json)
        return
    if run is None:
        raise UserError("give the RUN to plot, or --list for the names of the figures")
    for name in figures or ():
        check_name(name, FIGURES, "figure", "snooker plot --list")
    specs = [FIGURES[name] for name in dict.fromkeys(figures or FIGURES)]
    opened = open_run(run)
    selection = Selection(_conditions(where or ()), repeat)
    try:
        points = selected(opened, selection)
    except FigureError as error:
        raise UserError(f"{opened.name}: {error}") from None
    present = sum(len(opened.present(point)) for point in points)
    shorter = sum(map(opened.shorter, points))
    for note in (unfinished(opened, selection), shorter_note(shorter, present)):
        if note:
            notice(note)
    drawn: list[dict[str, Any]] = []
    impossible: dict[tuple[str, str], int] = {}
    for spec, one, stem in _figures_to_draw(opened, specs, selection):
        try:
            drawn.append(_draw(opened, spec, one, out or opened.figures_folder, stem))
        except FigureError as error:
            reason = spec.name, str(error)
            impossible[reason] = impossible.get(reason, 0) + 1
            continue
        if not as_json:
            print_line("\n".join(drawn[-1]["files"]))
    names = {each["kind"] for each in drawn}
    for (name, why), times in impossible.items():
        where_not = f" at {times} of {len(opened.points)} points" if name in names else ""
        notice(f"{name} left out{where_not}: {why}")
    if as_json:
        skipped = [{"kind": name, "why": why, "times": n} for (name, why), n in impossible.items()]
        print_json({"figures": drawn, "skipped": skipped})
    missing = [spec.name for spec in specs if spec.name not in names]
    if missing and (figures or not drawn):
        raise UserError(f"{opened.name} cannot give {', '.join(missing)}; see the reasons above")


def _draw(run: Run, spec: FigureSpec, selection: Selection, folder: Path, stem: str) -> Any:
    """Draw a figure; its record for ``--json``. Raises ``FigureError`` if it is not possible."""
    from snooker_cli.figures.drawing import save  # loads matplotlib

    figure = spec.make(run, selection)
    try:
        paths = save(figure, folder / stem)
    except OSError as error:
        raise UserError(
            f"{folder}: cannot be written ({error.strerror or error})",
            "give --out for another folder",
        ) from None
    record = {name: getattr(figure, name) for name in ("kind", "title", "caption", "numbers")}
    return record | {"files": [str(path) for path in paths]}


def _print_figures(as_json: bool) -> None:
    """Print all figures."""
    if as_json:
        names = ("name", "title", "needs", "report_figures")
        print_json([{name: getattr(one, name) for name in names} for one in FIGURES.values()])
        return
    print_table(
        [Column("figure"), Column("source report's"), Column("shows"), Column("needs")],
        [
            [one.name, ", ".join(map(str, one.report_figures)) or "–", one.title, one.needs]
            for one in FIGURES.values()
        ],
    )


def _conditions(texts: Sequence[str]) -> dict[str, Any]:
    """The conditions of ``--where``: a value of each key, or a tuple of several."""
    found: dict[str, Any] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator or not key or not value:
            raise UserError(f"--where {text}: give KEY=VALUE, as in cor=0.8")
        values = tuple(_value(each.strip()) for each in value.split(","))
        found[key.strip()] = values if len(values) > 1 else values[0]
    return found


def _value(text: str) -> Any:
    """A value as a config writes it: a number, null, or text."""
    try:
        return float("inf") if text == ".inf" else json.loads(text)
    except ValueError:
        return text


def _figures_to_draw(
    run: Run, specs: Sequence[FigureSpec], selection: Selection
) -> Iterator[tuple[FigureSpec, Selection, str]]:
    """Each figure, what it shows, and the name of its files."""
    for spec in specs:
        if not spec.each_point:
            yield spec, selection, spec.name + _stem(selection.where.items(), selection.repeat)
            continue
        for point in selected(run, selection):
            one = Selection(dict(point.parameters), selection.repeat)
            yield spec, one, spec.name + _stem(point.parameters, selection.repeat)


def _stem(conditions: Iterable[tuple[str, Any]], repeat: int | None) -> str:
    """The part of a file's name that names the selection."""
    parts = []
    for key, value in conditions:
        values = value if isinstance(value, tuple) else (value,)
        parts += [key, *("null" if each is None else str(each) for each in values)]
    if repeat is not None:
        parts += ["repeat", str(repeat)]
    return "".join("-" + re.sub(r"[^A-Za-z0-9._-]", "_", part) for part in parts)


class Pace(StrEnum):
    """What passes evenly in a film."""

    TIME = "time"
    EVENTS = "events"


def animate(
    run: RunName,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FILE", help="The film: a name in .html, .gif or .mp4."),
    ],
    point: PointNumber = 0,
    repeat: RepeatNumber = 0,
    since: Annotated[
        float | None, typer.Option("--from", metavar="T", help="Start time, s [0].")
    ] = None,
    until: Annotated[
        float | None, typer.Option("--to", metavar="T", help="End time, s [the end].")
    ] = None,
    collisions: Annotated[
        int | None,
        typer.Option("--collisions", min=1, help="Largest number of collisions [10,000]."),
    ] = None,
    pace: Annotated[
        Pace, typer.Option("--pace", help="Time passes evenly, or each collision takes as long.")
    ] = Pace.TIME,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", help="Length of the film [12; for a page, by its content]."),
    ] = None,
    fps: Annotated[
        int | None, typer.Option("--fps", min=1, max=60, help="GIF, MP4: frames per second [20].")
    ] = None,
    magnify: Annotated[
        float, typer.Option("--magnify", help="Enlarge the container's motion by this factor.")
    ] = 1.0,
    as_json: AsJson = False,
) -> None:
    """Make a film of a repeat: HTML page, GIF or MP4.

    It shows the balls coloured by speed, their contacts, energy and pressure. An HTML page works
    in any browser without a network. It plays, pauses, and jumps to any time or collision. The
    balls are exactly where the stored collisions put them. The name of the written file is printed.
    """
    _check_film(out, seconds, fps, magnify)
    opened = open_run(run)
    trace = opened.read(chosen_point(opened, point, repeat), repeat)
    if magnify > 1 and not trace.start.free:
        raise UserError(f"--magnify {magnify:g}: the container of {opened.name} does not move")
    try:
        made = film(
            trace,
            opened.experiment.title or opened.name,
            _subtitle(opened, trace, point, repeat),
            since=since or 0.0,
            until=until,
            most=collisions,
        )
    except FigureError as error:
        raise UserError(f"repeat {repeat} of {opened.name} {error}") from None
    if made.left_out and collisions is None:
        notice(
            f"the film ends after {len(made):,} collisions, at {made.end:.6g} s; --from, --to and "
            "--collisions choose others"
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    frames = _write_film(made, out, pace, seconds, fps, magnify)
    if not as_json:
        print_line(str(out))
        return
    print_json(
        {
            "file": str(out),
            "bytes": out.stat().st_size,
            "point": point,
            "repeat": repeat,
            "from": made.start,
            "to": made.end,
            "collisions": len(made),
            "frames": frames,
        }
    )


def _check_film(out: Path, seconds: float | None, fps: int | None, magnify: float) -> None:
    """Raise ``UserError`` for options that do not fit together."""
    if out.suffix.lower() not in ENDINGS:
        raise UserError(f"--out {out}: give a name that ends in .html, .gif or .mp4")
    if fps is not None and out.suffix.lower() == ".html":
        raise UserError("--fps is for a GIF or an MP4; the browser chooses it for a page")
    if seconds is not None and not 0.1 <= seconds <= 3600:
        raise UserError(f"--seconds {seconds}: give a number from 0.1 to 3600")
    if not 1 <= magnify <= MOST_MAGNIFIED:
        raise UserError(f"--magnify {magnify}: give a number from 1 to {MOST_MAGNIFIED:g}")


def _subtitle(run: Run, trace: Trace, point: int, repeat: int) -> str:
    """The parameters and the repeat that a film shows."""
    parameters = dict(run.points[point].parameters)
    if "cor" not in parameters:
        parameters["cor"] = f"{trace.start.restitution:g}"
    texts = [f"{key}={value}" for key, value in parameters.items()]
    return ", ".join([*texts, counted(trace.start.number, "ball"), f"repeat {repeat}"])


def _write_film(
    made: Film, out: Path, pace: Pace, seconds: float | None, fps: int | None, magnify: float
) -> int | None:
    """Write the film; the number of its frames, none for a page."""
    if out.suffix.lower() == ".html":
        text = page(made, pace=pace.value, seconds=seconds, magnify=magnify)
        out.write_text(text, encoding="utf-8")
        return None
    from snooker_cli.animation.movie import save_movie  # loads matplotlib

    return save_movie(
        made,
        out,
        pace=pace.value,
        seconds=seconds or SECONDS,
        rate=fps or FRAMES_PER_SECOND,
        magnify=magnify,
    )
