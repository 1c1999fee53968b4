"""``snooker plot`` and ``animate``: figures and films of runs."""

import webbrowser
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from snooker_cli import api
from snooker_cli.cli.options import RUN, Replace, RunNames, Where, conditions, flag, option, split
from snooker_cli.cli.output import print_line, print_table, print_wrapped
from snooker_cli.errors import UserError, notice
from snooker_cli.formatting import listed

LISTED = "The list follows from the config. A figure may still need more collisions than there are."


def plot(
    run: Annotated[str | None, RUN] = None,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[RUN…] FIGURE", help="More runs, and names of figures [all possible]."
        ),
    ] = None,
    list_figures: Annotated[bool, flag("--list", "List figures; with RUN those that fit.")] = False,
    where: Where = None,
    repeat: Annotated[int | None, option("K", "Only this one [the first, or all].", min=0)] = None,
    times: Annotated[
        str | None,
        option("T,T,…", "Times of snapshot, s [start, middle, end].", "--time"),
    ] = None,
    colour: Annotated[
        Literal["speed", "species", "density"] | None,
        option("WORD", "Of snapshot: speed, species, density.", "--colour"),
    ] = None,
    out: Annotated[Path | None, option("DIR", "Folder [RUN/figures].")] = None,
    formats: Annotated[str, option("F,F,…", "Formats: svg, png, pdf.", "--format")] = "svg,png",
    size: Annotated[str | None, option("WxH", "Inches, as 6x4 [a column of a page].")] = None,
    dpi: Annotated[int | None, option("N", "PNG: pixels per inch [200].", min=20, max=2000)] = None,
    log_x: Annotated[bool, flag("--log-x", "Logarithmic x axis.")] = False,
    log_y: Annotated[bool, flag("--log-y", "Logarithmic y axis.")] = False,
) -> None:
    """Draw figures of RUN as SVG, PNG and JSON.

    The JSON file has the numbers that a figure shows. Without names, all possible figures are
    drawn; RUN --list prints why others are not. Figures of single points are drawn for each point;
    without names and --where for 16 points at most. Of several runs, a figure shows the points of
    all of them. snapshot shows the balls at several times; `--time 0,10` chooses them. The
    command prints the names of the written files, and captions and results of figures that you
    name.
    """
    if run is None:
        if not list_figures:
            raise UserError("give the RUN to plot, or --list for the names of the figures")
        _print_registry()
        return
    others, figures = api.runs_and_figures(names or ())
    opened = api.open(run, *others)
    chosen = conditions(where, opened)
    if list_figures:
        _print_possible(opened.possible_figures(*figures, repeat=repeat, **chosen))
        return

    def print_saved(figure: api.SavedFigure) -> None:
        """Print the files of a figure, and of one that was named what it shows."""
        print_line("\n".join(map(str, figure.files)))
        if figures:
            print_wrapped([figure.caption], indent=0)
            for line in figure.table:
                print_line(line)

    opened.save_figures(
        *figures,
        out=out,
        formats=list(dict.fromkeys(split(formats.lower()))),
        size=size,
        dpi=dpi,
        log_x=log_x,
        log_y=log_y,
        repeat=repeat,
        times=times or (),
        colour=colour,
        saved=print_saved,
        **chosen,
    )


def _print_possible(figures: list[dict[str, Any]]) -> None:
    """Print which figures a run can give by its config, and why not the others."""
    fitting = [f"{row['figure']}: {row['title']}" for row in figures if row["possible"]]
    print_wrapped([*fitting, *(reason for row in figures for reason in row["left_out"])])
    if fitting:
        print_wrapped([LISTED])


def _print_registry() -> None:
    """Print a table of all figures."""
    rows = [
        [
            row["figure"],
            ", ".join(map(str, row["report_figures"])) or "–",
            f"{row['title']}; for {row['needs'][0].lower()}{row['needs'][1:]}",
        ]
        for row in api.figure_list()
        if not row["reproduce_only"]
    ]
    print_table(["figure", "source report's", "what it shows, and for which runs"], rows)
    others = [row["figure"] for row in api.figure_list() if row["reproduce_only"]]
    print_wrapped([f"The source report also has {listed(others)}. They are drawn by name."])


def animate(
    runs: RunNames,
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
    the collisions are those that are stored. A page shows up to 4 repeats side by side: of several
    runs, as `--repeat 0 --repeat 1` or as `--where cor=0.8,1`. The link film.html#t=3&ball=5 begins
    at 3 s with the path of ball 5. A page of snooker under the same name is replaced, another file
    is not. The name of the written file is printed.
    """
    if where and point is not None:
        raise UserError("--point and --where both choose points; give one of them")
    opened = api.open(*runs)
    chosen = conditions(where, opened)
    if not where and (point is not None or len(runs) == 1):
        chosen = dict(opened.chosen(point, max(repeats or [0])).parameters)
    path = opened.animate(
        out,
        repeats,
        since=since,
        until=until,
        most=collisions,
        pace=pace,
        seconds=seconds,
        fps=fps,
        replace=replace,
        **chosen,
    )
    print_line(str(path))
    if open_film and not webbrowser.open(path.resolve().as_uri()):
        notice(f"no browser could be started; open {path} yourself")
