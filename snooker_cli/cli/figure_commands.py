"""``snooker plot`` and ``animate``: figures and films of runs."""

import re
import webbrowser
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from snooker_cli import api
from snooker_cli.analysis.run_analysis import shorter_note
from snooker_cli.animation import MOST_COLLISIONS, check_film_file, save_films
from snooker_cli.cli.options import RUN, Replace, RunName, Where, conditions, flag, option
from snooker_cli.cli.output import (
    check_free,
    first,
    make_own_folder,
    print_line,
    print_table,
    print_wrapped,
)
from snooker_cli.config import Point
from snooker_cli.errors import FigureError, UserError, check_name, notice
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import unfinished
from snooker_cli.figures.registry import figures_of, possible
from snooker_cli.figures.selection import MOST_SERIES, begun, file_stem, matching
from snooker_cli.formatting import listed, point_label, text_table, with_error
from snooker_cli.runs import Run, open_run
from snooker_cli.runs.folder import writing
from snooker_cli.runs.progress import reporting
from snooker_cli.runs.status import early_warning

LISTED = "The list follows from the config. A figure may still need more collisions than there are."
GIVEN = "temperature", "area", "packing"  # in tables only where they differ between points
MOST_PIXELS = 10_000  # of a side of a PNG, which then takes 400 MB of memory


def plot(
    run: Annotated[str | None, RUN] = None,
    figures: Annotated[
        list[str] | None, typer.Argument(metavar="FIGURE", help="Names of figures [all possible].")
    ] = None,
    list_figures: Annotated[bool, flag("--list", "List figures; with RUN those that fit.")] = False,
    where: Where = None,
    repeat: Annotated[int | None, option("K", "Only this one [the first, or all].", min=0)] = None,
    out: Annotated[Path | None, option("DIR", "Folder [RUN/figures].")] = None,
    formats: Annotated[str, option("F,F,…", "Formats: svg, png, pdf.", "--format")] = "svg,png",
    size: Annotated[str | None, option("WxH", "Inches, as 6x4 [a column of a page].")] = None,
    dpi: Annotated[int | None, option("N", "PNG: pixels per inch [200].", min=20, max=2000)] = None,
) -> None:
    """Draw figures of RUN as SVG, PNG and JSON.

    The JSON file has the numbers that a figure shows. Without names, all possible figures are
    drawn; RUN --list prints why others are not. Figures of single points are drawn for each point;
    without names and --where for 16 points at most.
    The command prints the names of the written files, and the captions of figures that you name.
    """
    image_formats = list(dict.fromkeys(formats.lower().split(",")))
    if not set(image_formats) <= {"svg", "png", "pdf"}:
        raise UserError(f"--format {formats}: give svg, png or pdf, or several with commas")
    inches = _inches(size, dpi)
    if run is None:
        if not list_figures:
            raise UserError("give the RUN to plot, or --list for the names of the figures")
        _print_registry()
        return
    opened = open_run(run)  # first, because a user may swap RUN and FIGURE
    for name in figures or ():
        check_name(name, FIGURES, "figure", "snooker plot --list")
    names = list(dict.fromkeys(figures or FIGURES))
    selection = Selection(conditions(where, opened), repeat)
    if list_figures:
        _print_possible(names, begun(opened, selection))
        return
    _warn_of_missing(opened, selection)
    most = None if figures or where else MOST_SERIES
    drawn: dict[str, None] = {}
    impossible: Counter[tuple[str, str]] = Counter()
    for name, stem, figure in _with_progress(opened, names, selection, most):
        if isinstance(figure, FigureError):
            impossible[name, str(figure)] += 1
            continue
        drawn[name] = None
        if out is None:
            make_own_folder(opened.figures_folder)
        _save(figure, (out or opened.figures_folder) / stem, image_formats, inches, dpi)
        if figures:
            print_wrapped([figure.caption], indent=0)
            for line in _table(figure):
                print_line(line)
    single = [name for name in drawn if FIGURES[name].each_point]
    if most and single and len(opened.points) > most:
        notice(
            f"{listed(single)}: drawn for {most} of {len(opened.points):,} points, evenly chosen; "
            "--where or names of figures draw the others"
        )
    if figures or not drawn:
        for (name, reason), times in impossible.items():
            notice(_left_out(name, reason, times, len(opened.points), name in drawn))
    missing = [name for name in names if name not in drawn]
    if missing and (figures or not drawn):
        raise UserError(f"{opened.name} cannot give {', '.join(missing)}; see the reasons above")


def _with_progress(
    run: Run, names: list[str], selection: Selection, most: int | None
) -> Iterator[tuple[str, str, FigureData | FigureError]]:
    """``figures_of``, while a terminal shows which repeat is read."""
    figures = figures_of(run, names, selection, lambda text: show(text), most)
    while True:
        with reporting() as show:  # not while lines are printed
            figure = next(figures, None)
        if figure is None:
            return
        yield figure


def _left_out(name: str, reason: str, times: int, total: int, others: bool) -> str:
    """Why a figure is missing; ``others`` if it is there for other points."""
    return f"{name} left out{f' at {times:,} of {total:,} points' if others else ''}: {reason}"


def _print_possible(names: Sequence[str], points: Sequence[Point]) -> None:
    """Print which figures points can give by their config, and why not the others."""
    fitting, reasons = [], []
    for name, fits, why in possible(names, points):
        fitting += [f"{name}: {FIGURES[name].title}"] * fits
        reasons += [_left_out(name, *reason, len(points), fits) for reason in why.items()]
    print_wrapped([*fitting, *reasons])
    if fitting:
        print_wrapped([LISTED])


def _save(figure: FigureData, stem: Path, *how: Any) -> None:
    """Save a figure and print the names of its files."""
    from snooker_cli.figures.drawing import save  # loads matplotlib

    with writing(stem.parent):
        files = save(figure, stem, *how)
    print_line("\n".join(map(str, files)))


def _print_registry() -> None:
    """Print a table of all figures."""
    rows = [
        [
            spec.name,
            ", ".join(map(str, spec.report_figures)) or "–",
            f"{spec.title}; for {spec.needs[0].lower()}{spec.needs[1:]}",
        ]
        for spec in FIGURES.values()
    ]
    print_table(["figure", "source report's", "what it shows, and for which runs"], rows)


def _warn_of_missing(run: Run, selection: Selection) -> None:
    """Print how many repeats are missing, and how many are shorter than the extended run."""
    wanted = matching(run, selection)
    with reporting() as show:
        for number, point in enumerate(wanted, 1):
            show(f"reading the files of point {number:,} of {len(wanted):,}")
            run.statuses(point.index)  # which stay in memory
    points = selected(run, selection)
    if missing := unfinished(run, selection):
        notice(f"{missing}; run the config again for the rest")
    present = sum(len(run.present(point)) for point in points)
    if note := shorter_note(sum(map(run.shorter, points)), present):
        notice(note)
    if warning := early_warning(run, points):
        notice(warning)


def _table(figure: FigureData) -> list[str]:
    """The numbers of several points, as a table; empty if there are none."""
    rows = figure.numbers.get("points", [])
    if len(rows) < 2:
        return []
    parameters = [row["parameters"] for row in rows]
    varying = [
        key for key, value in parameters[0].items() if any(p[key] != value for p in parameters)
    ]
    headings = ["point"]
    columns = [[point_label({key: values[key] for key in varying}) for values in parameters]]
    for name in [name for name in rows[0] if isinstance(rows[0][name], float)]:
        cells = [with_error(row.get(name), row.get(f"{name}_error")) for row in rows]
        if not name.endswith("_error") and (name not in GIVEN or len(set(cells)) > 1):
            headings.append(f">{name.replace('_', ' ')}")
            columns.append(cells)
    lines = text_table(headings, [*zip(*columns, strict=True)])
    return first(lines, rest=" points in the JSON file")


def _inches(text: str | None, dpi: int | None) -> tuple[float, float] | None:
    """Width and height of ``--size``. Raises ``UserError``."""
    match = re.fullmatch(r"(\d*\.?\d+)x(\d*\.?\d+)", text or "")
    sides = (float(match[1]), float(match[2])) if match else None
    if text is not None and not (sides and all(1.5 <= side <= 50 for side in sides)):
        raise UserError(f"--size {text}: give width and height from 1.5 to 50 inches, as in 6x4")
    if sides and dpi and max(sides) * dpi > MOST_PIXELS:
        raise UserError(f"--size {text} --dpi {dpi}: give at most {MOST_PIXELS:,} pixels a side")
    return sides


def animate(
    run: RunName,
    out: Annotated[
        Path | None, option("FILE", "A name in .html, .gif or .mp4 [RUN/film….html].")
    ] = None,
    point: Annotated[int | None, option("N", "Point, from 0 [0].", min=0)] = None,
    where: Where = None,
    repeats: Annotated[
        list[int] | None, option("N", "Repeat, from 0 [0]. Can be repeated.", "--repeat", min=0)
    ] = None,
    since: Annotated[float, option("T", "Start time, s.", "--from")] = 0.0,
    until: Annotated[float | None, option("T", "End time, s [the end].", "--until")] = None,
    collisions: Annotated[int | None, option("N", "At most this many [10,000].", min=1)] = None,
    pace: Annotated[
        Literal["time", "events"], option("time|events", "Time or collisions pass evenly.")
    ] = "time",
    seconds: Annotated[
        float | None, option("S", "Length [12; a page: by its content].", min=0.1, max=3600)
    ] = None,
    fps: Annotated[int | None, option("N", "GIF, MP4: frames/s [20].", min=1, max=60)] = None,
    replace: Replace = False,
    open_film: Annotated[bool, flag("--open", "Show it in the browser.")] = False,
) -> None:
    """Make a film of a repeat: HTML page, GIF or MP4.

    It shows the balls coloured by speed, their contacts, energy and pressure. An HTML page works
    in any browser without a network: it simulates the repeat again from its start, and checks that
    the collisions are those that are stored. A page shows up to 4 repeats side by side, as with
    `--where cor=0.8,1` or `--repeat 0 --repeat 1`. The link film.html#t=3&ball=5 begins at 3 s
    with the path of ball 5. A page of snooker under the same name is replaced, another file is
    not. The name of the written file is printed.
    """
    opened = api.open(run)
    if where and point is not None:
        raise UserError("--point and --where both choose points; give one of them")
    numbers = sorted(set(repeats or [0]))
    given = dict(opened.chosen(point or 0, numbers[-1]).parameters)
    chosen = conditions(where, opened) or given
    parts = chosen | ({"repeat": tuple(numbers)} if repeats else {})
    path = out or opened.directory / f"{file_stem('film', Selection(parts))}.html"
    if fps is not None and path.suffix.lower() == ".html":
        raise UserError("--fps is for a GIF or an MP4; the browser chooses it for a page")
    check_film_file(path, len(opened.matching(**chosen)) * len(numbers))
    if path.suffix.lower() == ".html" and not opened.can_be_replayed:
        raise UserError(
            f"{opened.name} holds results of engine version {opened.engine_version}, which a page "
            "of this version cannot simulate again",
            "give a name that ends in .gif or .mp4",
        )
    check_free(path, replace)
    most = collisions or MOST_COLLISIONS
    films = opened.films(numbers, since=since, until=until, most=most, **chosen)
    for shown in films if collisions is None else ():
        if shown.left_out:
            notice(
                f"the film of {shown.subtitle} ends after {len(shown):,} collisions, at "
                f"{shown.end:.6g} s; --from, --until and --collisions choose others"
            )
    save_films(path, films, given=out is not None, pace=pace, seconds=seconds, rate=fps or 20)
    print_line(str(path))
    if open_film and not webbrowser.open(path.resolve().as_uri()):
        notice(f"no browser could be started; open {path} yourself")
