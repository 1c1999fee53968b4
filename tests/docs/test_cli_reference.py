"""docs/cli.md is what ``--help`` prints; ``python tests/docs/test_cli_reference.py`` writes it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any
from unittest import mock

from typer.main import get_command

from snooker_cli.cli.app import COMMANDS, app, loaded
from snooker_cli.errors import ExitCode

REFERENCE = Path(__file__).parents[2] / "docs" / "cli.md"

HEAD = """\
# The commands

This page shows the `--help` of each command; `python tests/docs/test_cli_reference.py` writes it.
The [tutorial](tutorial.md) shows the commands at work.

`snooker --install-completion` installs completion of commands and options for the current shell
(bash, zsh, fish or PowerShell).
"""

MEANINGS = {
    "DONE": "done",
    "UNEXPECTED": "a bug in snooker, or a result file that is damaged or of another run",
    "USAGE": "a wrong command, or files that are missing or cannot be read or written",
    "CONFIG": "a config that is missing or cannot be used",
    "SOME_FAILED": "some repeats failed, or a measurement does not agree",
    "INTERRUPTED": "interrupted",
}


def reference() -> str:
    """The whole file."""
    blocks = [f"## {path}\n\n```text\n{text}```\n" for path, text in helps("snooker", command())]
    codes = [f"| {int(code)} | {MEANINGS[code.name]} |" for code in ExitCode]
    table = "\n".join(["## Exit codes", "", "| code | meaning |", "|---|---|", *codes])
    return "\n".join([HEAD, *blocks, table]) + "\n"


def command() -> Any:
    """The application with all its commands."""
    return get_command(app)


def helps(path: str, group: Any) -> Iterator[tuple[str, str]]:
    """The ``--help`` of a command and of those in it."""
    yield path, printed(path, group)
    for name, inner in getattr(group, "commands", {}).items():
        yield from helps(f"{path} {name}", loaded(name) if name in COMMANDS else inner)


def printed(path: str, one: Any) -> str:
    """The ``--help`` of a command on a terminal of 80 columns."""
    with (
        mock.patch.dict(os.environ, COLUMNS="80"),
        redirect_stdout(StringIO()) as out,
    ):
        one.main(["--help"], prog_name=path, standalone_mode=False)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


def test_the_reference_is_what_help_prints() -> None:
    assert REFERENCE.read_text(encoding="utf-8") == reference(), (
        "a command has changed: run python tests/docs/test_cli_reference.py"
    )


if __name__ == "__main__":
    REFERENCE.write_text(reference(), encoding="utf-8")
