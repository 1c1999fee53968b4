"""``snooker plot`` and ``animate``: figures and films of runs."""

import re
import webbrowser
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from snooker_cli.analysis.run_analysis import shorter_note
from snooker_cli.animation import MOST_COLLISIONS, MOST_FILMS, Film, film, page, with_events
from snooker_cli.cli.options import RUN, RunName, Where, conditions, flag, option
from snooker_cli.cli.output import first, print_line, print_table, print_wrapped
from snooker_cli.config import Point
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import FigureError, UserError, check_name
from snooker_cli.figures import FIGURES, FigureData, Selection, selected
from snooker_cli.figures.captions import unfinished
from snooker_cli.figures.registry import FigureSpec
from snooker_cli.figures.selection import matching
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, point_label, text_table, with_error
from snooker_cli.runs import Run, open_run
from snooker_cli.runs.folder import writing
from snooker_cli.runs.progress import notice

MOST_TO_LIST = 1_000_000  # collisions that --list may read; of more it reads each first repeat
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
    drawn; RUN --list prints why others are not. Figures of single points are drawn for each point.
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
    specs = [FIGURES[name] for name in dict.fromkeys(figures or FIGURES)]
    selection = Selection(conditions(where, opened), repeat)
    points = selected(opened, selection)
    _warn_of_missing(opened, points, selection)
    if list_figures and repeat is None and _is_large(opened, points):
        opened = replace(opened, experiment=opened.experiment.model_copy(update={"repeats": 1}))
    drawn: set[str] = set()
    impossible: Counter[tuple[str, str]] = Counter()
    for spec, chosen, figure in _made(opened, specs, points, selection):
        if isinstance(figure, FigureError):
            impossible[spec.name, str(figure)] += 1
            continue
        drawn.add(spec.name)
        if list_figures:
            continue
        from snooker_cli.figures.drawing import save  # loads matplotlib

        folder = out or opened.figures_folder
        with writing(folder):
            files = save(figure, folder / _stem(spec.name, chosen), image_formats, inches, dpi)
        print_line("\n".join(map(str, files)))
        if figures:
            print_wrapped([figure.caption], indent=0)
            for line in _table(figure):
                print_line(line)
    left_out = []
    for (name, reason), times in impossible.items():
        at = f" at {times} of {len(opened.points)} points" if name in drawn else ""
        left_out.append(f"{name} left out{at}: {reason}")
    if list_figures:
        print_wrapped(f"{spec.name}: {spec.title}" for spec in specs if spec.name in drawn)
        print_wrapped(left_out)
    elif figures or not drawn:
        for line in left_out:
            notice(line)
    missing = [spec.name for spec in specs if spec.name not in drawn]
    if missing and (figures or not drawn):
        raise UserError(f"{opened.name} cannot give {', '.join(missing)}; see the reasons above")


def _made(
    run: Run, specs: Sequence[FigureSpec], points: Sequence[Point], selection: Selection
) -> Iterator[tuple[FigureSpec, Selection, FigureData | FigureError]]:
    """Each figure, of each point if it shows one point; an error if the run cannot give it."""
    single = [Selection(dict(point.parameters), selection.repeat) for point in points]
    for spec in specs:
        for chosen in single if spec.each_point else [selection]:
            try:
                yield spec, chosen, spec.make(run, chosen)
            except FigureError as error:
                yield spec, chosen, error


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


def _warn_of_missing(run: Run, points: Sequence[Point], selection: Selection) -> None:
    """Print how many repeats are missing, and how many are shorter than the extended run."""
    if missing := unfinished(run, selection):
        notice(f"{missing}; run the config again for the rest")
    present = sum(len(run.present(point)) for point in points)
    if note := shorter_note(sum(map(run.shorter, points)), present):
        notice(note)


def _is_large(run: Run, points: Sequence[Point]) -> bool:
    """Whether figures of the first repeats alone show which figures are possible.

    Making all of them takes minutes if there are many collisions. A first repeat without
    collisions is no good sample.
    """
    statuses = [status for point in points for status in run.statuses(point.index)]
    total = sum(status.collisions for status in statuses)
    return total > MOST_TO_LIST and all(s.collisions > 0 for s in statuses if s.repeat == 0)


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


def _stem(name: str, selection: Selection) -> str:
    parts = []
    for key, value in selection.where.items():
        values = value if isinstance(value, tuple) else (value,)
        parts += [key, *("null" if item is None else str(item) for item in values)]
    if selection.repeat is not None:
        parts += ["repeat", str(selection.repeat)]
    return name + "".join("-" + re.sub(r"[^A-Za-z0-9._-]", "_", part) for part in parts)


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
    open_film: Annotated[bool, flag("--open", "Show it in the browser.")] = False,
) -> None:
    """Make a film of a repeat: HTML page, GIF or MP4.

    It shows the balls coloured by speed, their contacts, energy and pressure. An HTML page works
    in any browser without a network. The balls are exactly where the stored collisions put them;
    those of a summary are simulated again. A page shows up to 4 repeats side by side, as with
    `--where cor=0.8,1` or `--repeat 0 --repeat 1`. The link film.html#t=3&ball=5 begins at 3 s
    with the path of ball 5. The name of the written file is printed.
    """
    opened = open_run(run)
    if where and point is not None:
        raise UserError("--point and --where both choose points; give one of them")
    numbers = sorted(set(repeats or [0]))
    first, chosen = opened.chosen(point or 0, numbers[-1]), conditions(where, opened)
    points = matching(opened, Selection(chosen, numbers[-1])) if where else (first,)
    if out is None:
        parts = chosen or dict(first.parameters)
        parts |= {"repeat": tuple(numbers)} if repeats else {}
        out = opened.directory / f"{_stem('film', Selection(parts))}.html"
    ending = out.suffix.lower()
    if ending not in (".html", ".gif", ".mp4"):
        raise UserError(f"--out {out}: give a name that ends in .html, .gif or .mp4")
    if fps is not None and ending == ".html":
        raise UserError("--fps is for a GIF or an MP4; the browser chooses it for a page")
    number, most = len(points) * len(numbers), MOST_FILMS if ending == ".html" else 1
    if number > most:
        few = f"shows at most {counted(most, 'repeat')}, not {number}"
        raise UserError(f"{out}: {few}", "give fewer points or repeats")
    span = since, until, collisions or MOST_COLLISIONS
    films = [_film(opened, place, repeat, span) for place in points for repeat in numbers]
    for shown in films if collisions is None else ():
        if shown.left_out:
            notice(
                f"the film of {shown.subtitle} ends after {len(shown):,} collisions, at "
                f"{shown.end:.6g} s; --from, --until and --collisions choose others"
            )
    if ending == ".html":
        write_text(out, page(*films, pace=pace, seconds=seconds))
    else:
        from snooker_cli.animation.movie import save_movie  # loads matplotlib

        save_movie(films[0], out, pace=pace, seconds=seconds or 12.0, rate=fps or 20)
    print_line(str(out))
    if open_film and not webbrowser.open(out.resolve().as_uri()):
        notice(f"no browser could be started; open {out} yourself")


def _film(run: Run, point: Point, repeat: int, span: tuple[float, float | None, int]) -> Film:
    """The film of a repeat. Raises ``UserError``."""
    trace = run.read(point, repeat)
    shown = {"cor": f"{trace.start.restitution:g}"} | dict(point.parameters)
    where = f"{point_label(shown)}, {counted(trace.start.number, 'ball')}, repeat {repeat}"
    try:
        if trace.summary is not None and run.engine_version != ENGINE_VERSION:
            raise FigureError("is a summary of another engine version, which cannot be replayed")
        trace = with_events(trace, span[0], span[2], run.engine)
        return film(trace, run.experiment.title or run.name, where, *span)
    except FigureError as error:
        raise UserError(f"repeat {repeat} of {run.name} {error}") from None
