"""Typer's commands, groups and options, with plain help and errors of one sentence."""

import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from snooker_cli.errors import UserError, check_name


def flag(name: str, text: str, **more: Any) -> Any:
    """An option without a value."""
    return typer.Option(name, help=text, **more)


def option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    """An option with a value. By default it has the name of its parameter."""
    return typer.Option(*names, metavar=metavar, help=text, **more)


@contextmanager
def _sentences(ctx: Any) -> Iterator[None]:
    """Inside, a wrong use of a command is a ``UserError``."""
    try:
        yield
    except typer.TyperException as error:
        text = error.format_message().rstrip(".")
        text = f"{text[0].lower()}{text[1:]}; see `{ctx.command_path} --help`"
        found: Any = getattr(error.__cause__, "errors", list)()  # pydantic's, about a value
        if found:
            wrong, one = found[0], vars(error)["param"]
            whole = "whole " * wrong["type"].startswith("int")
            limits = f" from {one.min} to {one.max}" if one.max else f" of {one.min} or more"
            wanted = f"give a {whole}number{'' if one.min is None else limits}"
            text = f"{one.opts[-1]} {wrong['input']}: {wrong.get('ctx', {}).get('error', wanted)}"
        raise UserError(text) from None


class Command(TyperCommand):
    """A command with plain help."""

    def get_help(self, ctx: Any) -> str:
        """The help without braces around arguments, types of Python, and ``x`` in limits."""
        text = re.sub(r"\{(\w+)\}", r"\1", super().get_help(ctx))
        text = re.sub(r" <(str|path|list\[str\])>", lambda found: " " * len(found[0]), text)
        return re.sub(r"x>=(?=\d)", "≥ ", re.sub(r"(\d)<=x<=(\d)", r"\1 to \2", text))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments. Raises ``UserError``."""
        with _sentences(ctx):
            return super().parse_args(ctx, args)


class Group(TyperGroup):
    """A group of commands; without arguments it shows its help."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments. Raises ``UserError``."""
        with _sentences(ctx) if args else nullcontext():
            return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments name, and its arguments. Raises ``UserError``."""
        if not ctx.resilient_parsing:  # as it is while the shell completes a word
            check_name(args[0], self.commands, "command", f"{ctx.command_path} --help")
        return super().resolve_command(ctx, args)
