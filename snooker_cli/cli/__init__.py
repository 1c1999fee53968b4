"""The command line: parse, call one function a stage, print. Heavy imports are in the commands."""

from __future__ import annotations

from typing import Annotated

import typer

from snooker_cli.cli import analysing, benching, inspecting, plotting, running

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


app.command("run")(running.run)
app.command("fit")(analysing.fit)
app.command("compare")(analysing.compare)
app.command("plot")(plotting.plot)
app.command("report")(analysing.report)
app.command("export")(inspecting.export)
app.command("validate")(inspecting.validate)
app.command("schema")(inspecting.schema)
app.add_typer(benching.bench, name="bench")


def main() -> None:
    """Run the command line; the console script's entry."""
    from snooker_cli.cli.endings import guarded

    guarded(app)
