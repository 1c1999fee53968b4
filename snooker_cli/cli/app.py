"""All commands by name: parse, call one function a stage, print; heavy imports are in them."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from snooker_cli.cli import (
    analysis_commands,
    bench_command,
    config_commands,
    export_command,
    figure_commands,
    run_command,
    status_commands,
)
from snooker_cli.cli.exit_codes import at_once

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
            from snooker_cli.cli.progress_bar import showing_notices

        with showing_notices():
            command(*arguments, **options)

    return called


app.command("init")(config_commands.init)
app.command("run")(_with_notices(run_command.run))
app.command("ls")(status_commands.ls)
app.command("show")(status_commands.show)
app.command("verify")(_with_notices(status_commands.verify))
app.command("fit")(_with_notices(analysis_commands.fit))
app.command("compare")(_with_notices(analysis_commands.compare))
app.command("plot")(_with_notices(figure_commands.plot))
app.command("animate")(_with_notices(figure_commands.animate))
app.command("report")(_with_notices(analysis_commands.report))
app.command("export")(_with_notices(export_command.export))
app.command("validate")(config_commands.validate)
app.command("schema")(config_commands.schema)
app.add_typer(bench_command.bench, name="bench")
