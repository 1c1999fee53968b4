"""``snooker plot`` and ``animate``: figures and films of runs."""

import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.api.runs import runs_and_figures
from snooker_cli.cli.output import print_line, print_table, print_wrapped
from snooker_cli.cli.parameters import RUN, RunNames, split, takes
from snooker_cli.errors import UserError, notice
from snooker_cli.formatting import listed

LISTED = "The list follows from the config. A figure may still need more collisions than there are."


@takes(
    *(options.LIST_FIGURES, options.WHERE, options.REPEAT, options.TIMES, options.COLOUR),
    *(options.FIGURES_OUT, options.FORMATS, options.SIZE, options.DPI, options.LOG_X),
    options.LOG_Y,
)
def plot(
    run: Annotated[str | None, RUN] = None,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[RUN…] FIGURE", help="More runs, and names of figures [all possible]."
        ),
    ] = None,
    *,
    list_figures: bool,
    where: list[str],
    repeat: int | None,
    formats: str,
    **how: Any,
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
    others, figures = runs_and_figures(names or ())
    opened = snooker.open(run, *others)
    chosen = opened.where(*where)
    if list_figures:
        _print_possible(opened.possible_figures(*figures, repeat=repeat, **chosen))
        return

    def print_saved(figure: snooker.SavedFigure) -> None:
        """Print the files of a figure, and of one that was named what it shows."""
        print_line("\n".join(map(str, figure.files)))
        if figures:
            print_wrapped([figure.caption], indent=0)
            for line in figure.table:
                print_line(line)

    opened.save_figures(
        *figures,
        formats=list(dict.fromkeys(split(formats.lower()))),
        repeat=repeat,
        saved=print_saved,
        **how,
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
        for row in snooker.figure_list()
        if not row["reproduce_only"]
    ]
    print_table(["figure", "source report's", "what it shows, and for which runs"], rows)
    others = [row["figure"] for row in snooker.figure_list() if row["reproduce_only"]]
    print_wrapped([f"The source report also has {listed(others)}. They are drawn by name."])


@takes(
    *(options.FILM_OUT, options.FILM_POINT, options.WHERE, options.REPEATS, options.SINCE),
    *(options.UNTIL, options.COLLISIONS, options.PACE, options.SECONDS, options.FPS),
    *(options.REPLACE, options.OPEN),
)
def animate(
    runs: RunNames,
    *,
    out: Path | None,
    point: int | None,
    where: list[str],
    repeats: list[int],
    open_page: bool,
    **how: Any,
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
    opened = snooker.open(*runs)
    chosen = opened.where(*where)
    if not where and (point is not None or len(runs) == 1):
        chosen = dict(opened.chosen(point, max(repeats or [0])).parameters)
    path = opened.animate(out, repeats, **how, **chosen)
    print_line(str(path))
    if open_page and not webbrowser.open(path.resolve().as_uri()):
        notice(f"no browser could be started; open {path} yourself")
