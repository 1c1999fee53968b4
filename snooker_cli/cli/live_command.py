"""``snooker live``: the page that simulates a gas in the browser."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.options import Overrides, Replace, flag, option
from snooker_cli.cli.output import check_free, print_line
from snooker_cli.errors import UserError, notice
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, point_label
from snooker_cli.live_page import live_page, report_scene
from snooker_cli.runs.starting_state import load


def live(
    config: Annotated[
        Path | None,
        typer.Argument(
            metavar="CONFIG",
            readable=False,
            help="A YAML experiment [the source report's scene].",
        ),
    ] = None,
    out: Annotated[Path | None, option("FILE", "The page [gas.html].")] = None,
    overrides: Overrides = None,
    replace: Replace = False,
    controls: Annotated[
        str | None, option("NAME,…", "Show only these sliders and menus, as in cor,radius [all].")
    ] = None,
    beginner: Annotated[
        bool, flag("--beginner", "Leave out virial, momentum, config and hashes.")
    ] = False,
    language: Annotated[str, option("NAME", "Language of the page: en or de.")] = "en",
    open_page: Annotated[bool, flag("--open", "Show it in the browser.")] = False,
) -> None:
    """Make an HTML page in which a gas runs, with sliders.

    The page simulates up to 2,000 balls in the browser, with the same bits as `snooker run`. It has
    more scenes, charts, and measurements with errors. It works from a file and without a network,
    so you can mail it. Its address after # is a link to the scene as it is set. Of a sweep it shows
    the first point. A page of snooker under the same name
    is replaced, another file is not. The name of the written file is printed.
    """
    path = out or Path("gas.html")
    if path.suffix.lower() != ".html":
        raise UserError(f"--out {path}: give a name that ends in .html")
    check_free(path, replace)
    given = load(report_scene() if config is None else config, overrides or ())
    chosen = None if controls is None else [name.strip() for name in controls.split(",")]
    page = live_page(given, controls=chosen, beginner=beginner, language=language)
    points = given.points()
    if len(points) > 1:
        first = point_label(points[0].as_json())
        notice(
            f"the page shows the first of {counted(len(points), 'point')}, {first}; -o sets others"
        )
    write_text(path, page, given=out is not None)
    print_line(str(path))
    if open_page and not webbrowser.open(path.resolve().as_uri()):
        notice(f"no browser could be started; open {path} yourself")
