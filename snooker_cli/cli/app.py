"""All commands by name; the module of a command is loaded when the command runs."""

import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from snooker_cli.errors import UserError, check_name
from snooker_cli.formatting import listed
from snooker_cli.options import ENDINGS
from snooker_cli.signals import end_interrupted, handling

COMMANDS = {
    "init": ("config_commands", "Write a commented config; without TEMPLATE, list all templates."),
    "run": ("run_command", "Simulate all points and repeats of CONFIG and store them."),
    "ls": ("status_commands", "List the runs in DIR and the state of their repeats."),
    "show": ("status_commands", "Show the state of RUN: points, ends of repeats, files."),
    "verify": ("status_commands", "Read and check every file of RUN."),
    "fit": ("analysis_commands", "Fit decay constants of energy, temperature and pressure."),
    "compare": ("analysis_commands", "Compare the results of RUN with theory."),
    "plot": ("figure_commands", "Draw figures of RUN as SVG, PNG and JSON."),
    "animate": ("figure_commands", "Make a film of a repeat: HTML page, GIF or MP4."),
    "live": (
        "live_command",
        "Make an HTML page in which a gas runs, with sliders.",
    ),
    "report": ("analysis_commands", "Write a report on runs as HTML and PDF, or as Markdown."),
    "reproduce": ("analysis_commands", "Write the reproduction of the source report."),
    "export": ("export_command", "Export collisions or states of a repeat, or the table of a run."),
    "plugins": (
        "plugins_command",
        "List what snooker has, and what installed packages add.",
    ),
    "validate": ("config_commands", "Check CONFIG without running it."),
    "warm-up": ("config_commands", "Compile what CONFIG and its analyses need, for later."),
    "schema": ("config_commands", "Print the JSON schema of configs, for editors."),
    "bench": ("bench_command", "Measure the engine: speed, errors, physics, hard cases."),
}
"""The module and the first sentence of the help of each command."""

HIDDEN = ("reproduce", "schema")  # commands that ``snooker --help`` does not list


@contextmanager
def _sentences(ctx: Any) -> Iterator[None]:
    """Inside, a wrong use of a command is a ``UserError``."""
    try:
        yield
    except typer.TyperException as error:
        text = error.format_message().rstrip(".")
        text = f"{text[0].lower()}{text[1:]}; see `{ctx.command_path} --help`"
        faults: Any = getattr(error.__cause__, "errors", list)()  # pydantic's, about a value
        if faults:
            text = _about_value(vars(error)["param"], faults[0])
        raise UserError(text) from None


def _about_value(option: Any, fault: dict[str, Any]) -> str:
    """The sentence about a value that an option cannot have, from pydantic's error."""
    whole = "whole " if fault["type"].startswith("int") else ""
    limits = ""
    if option.min is not None:
        high = option.max
        limits = f" from {option.min} to {high}" if high else f" of {option.min} or more"
    needs = fault.get("ctx", {}).get("error", f"give a {whole}number{limits}")
    return f"{option.opts[-1]} {fault['input']}: {needs}".rstrip(".")


def _endings() -> str:
    """The endings of all formats of exports, those of installed packages too."""
    from snooker_cli.export import export_endings

    return listed(export_endings(), "or")


HELP = {"help_option_names": ["-h", "--help"]}


class Command(TyperCommand):
    """A command with plain help."""

    def __init__(self, *name: Any, context_settings: Any = None, **settings: Any) -> None:
        super().__init__(*name, context_settings=HELP | (context_settings or {}), **settings)

    def get_help(self, ctx: Any) -> str:
        """The help without braces around arguments, types of Python, and ``x`` in limits."""
        option: Any
        for option in self.params:
            words = getattr(option, "help", None) or ""
            if ENDINGS in words:
                option.help = words.replace(ENDINGS, _endings())
        text = re.sub(r"\{(\w+)\}", r"\1", super().get_help(ctx))
        text = re.sub(r" <(str|path|list\[(?:str|Path)\])>", lambda kind: " " * len(kind[0]), text)
        return re.sub(r"x>=(?=\d)", "≥ ", re.sub(r"(\d)<=x<=(\d)", r"\1 to \2", text))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments. Raises ``UserError``."""
        with _sentences(ctx):
            return super().parse_args(ctx, args)


class Group(TyperGroup):
    """A group of commands; without arguments it shows its help."""

    def __init__(self, *, context_settings: Any = None, **settings: Any) -> None:
        super().__init__(context_settings=HELP | (context_settings or {}), **settings)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments. Raises ``UserError``."""
        with _sentences(ctx) if args else nullcontext():
            return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments name, and its arguments. Raises ``UserError``."""
        if not ctx.resilient_parsing:  # as it is while the shell completes a word
            check_name(args[0], self.commands, "command", f"`{ctx.command_path} --help`")
        return super().resolve_command(ctx, args)


def loaded(name: str) -> Any:
    """A command with its parameters; loads its module."""
    with handling(end_interrupted):
        module = import_module(f"snooker_cli.cli.{COMMANDS[name][0]}")
    command = getattr(module, name.replace("-", "_"))
    if isinstance(command, typer.Typer):
        return typer.main.get_command(command)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    alone.command(name, cls=Command)(command)
    return typer.main.get_command(alone)


class Commands(Group):
    """The group of all commands, which knows only their names and first sentences."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        for name, (_, sentence) in COMMANDS.items():
            self.add_command(Command(name, help=sentence, hidden=name in HIDDEN))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments name, loaded, and its arguments."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, name and loaded(name), rest


app = typer.Typer(
    cls=Commands,
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
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_version)
    ] = False,
) -> None:
    from snooker_cli.runs.progress import showing_notices

    context.with_resource(showing_notices())
