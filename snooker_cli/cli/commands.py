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

COMPILING = "compiling for this kind of scene, once on this machine; it takes up to 15 s"


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


def _patient(command: Callable[..., None]) -> Callable[..., None]:
    """A command that says so on stderr when it compiles for more than a second."""

    @wraps(command)
    def called(*arguments: Any, **options: Any) -> None:
        with at_once():
            from snooker_cli.cli.progress import say
            from snooker_cli.engine import when_compiling

        with when_compiling(lambda: say(COMPILING), after=1.0):
            command(*arguments, **options)

    return called


app.command("init")(beginning.init)
app.command("run")(_patient(running.run))
app.command("ls")(listing.ls)
app.command("show")(listing.show)
app.command("verify")(_patient(verifying.verify))
app.command("fit")(_patient(analysing.fit))
app.command("compare")(_patient(analysing.compare))
app.command("plot")(_patient(plotting.plot))
app.command("animate")(_patient(animating.animate))
app.command("report")(_patient(analysing.report))
app.command("export")(_patient(exporting.export))
app.command("validate")(inspecting.validate)
app.command("schema")(inspecting.schema)
app.add_typer(benching.bench, name="bench")
