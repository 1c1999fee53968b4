"""``snooker live``: the page that simulates a gas in the browser."""

import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.cli.output import print_line
from snooker_cli.cli.parameters import split, takes
from snooker_cli.errors import UserError, notice


@takes(
    *(options.PAGE_OUT, options.OVERRIDES, options.REPLACE, options.CONTROLS, options.BEGINNER),
    *(options.LANGUAGE, options.OPEN),
)
def live(
    config: Annotated[
        Path | None,
        typer.Argument(
            metavar="CONFIG",
            readable=False,
            help="A YAML experiment [the source report's scene].",
        ),
    ] = None,
    *,
    out: Path | None,
    replace: bool,
    controls: str | None,
    open_page: bool,
    **how: Any,
) -> None:
    """Make an HTML page in which a gas runs, with sliders.

    The page simulates up to 2,000 balls in the browser, with the same bits as `snooker run`. It has
    more scenes, charts, and measurements with errors. It works from a file and without a network,
    so you can mail it. Its address after # is a link to the scene as it is set. Of a sweep it shows
    the first point. A page of snooker under the same name
    is replaced, another file is not. The name of the written file is printed.
    """
    if out is not None and out.suffix.lower() != ".html":
        raise UserError(f"--out {out}: give a name that ends in .html")
    chosen = None if controls is None else split(controls)
    page = snooker.live(config, controls=chosen, **how)
    path = page.save(out, replace=replace)
    print_line(str(path))
    if open_page and not webbrowser.open(path.resolve().as_uri()):
        notice(f"no browser could be started; open {path} yourself")
