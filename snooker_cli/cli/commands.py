"""All commands by name: parse, call one function a stage, print; heavy imports are in them."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from snooker_cli.cli import (
    analysing,
    animating,
    beginning,
    benching,
    exporting,
    inspecting,
    listing,
    plotting,
    running,
    verifying,
)
from snooker_cli.cli.interrupts import at_once

app = typer.Typer(
    name="snooker",
    help="Experiments with inelastic hard disks in a container.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        from snooker_cli import __version__

        typer.echo(f"snooker {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


def _with_notices(command: Callable[..., None]) -> Callable[..., None]:
    """A command that shows notices of the engine on stderr, such as that it compiles."""

    @wraps(command)
    def called(*arguments: Any, **options: Any) -> None:
        with at_once():
            from snooker_cli.cli.progress import showing_notices

        with showing_notices():
            command(*arguments, **options)

    return called


app.command("init")(beginning.init)
app.command("run")(_with_notices(running.run))
app.command("ls")(listing.ls)
app.command("show")(listing.show)
app.command("verify")(_with_notices(verifying.verify))
app.command("fit")(_with_notices(analysing.fit))
app.command("compare")(_with_notices(analysing.compare))
app.command("plot")(_with_notices(plotting.plot))
app.command("animate")(_with_notices(animating.animate))
app.command("report")(_with_notices(analysing.report))
app.command("export")(_with_notices(exporting.export))
app.command("validate")(inspecting.validate)
app.command("schema")(inspecting.schema)
app.add_typer(benching.bench, name="bench")
