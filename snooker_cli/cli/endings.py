"""How a command ends: exit codes, and one sentence for each error a person can meet."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import Any, NoReturn


class Exit(IntEnum):
    """Exit codes of ``snooker``."""

    DONE = 0
    UNEXPECTED = 1
    USAGE = 2
    CONFIG = 3
    SOME_FAILED = 4
    INTERRUPTED = 130


def fail(message: str, code: Exit) -> NoReturn:
    """Say what is wrong on stderr and end."""
    print(f"snooker: {message}", file=sys.stderr)
    raise SystemExit(int(code))


def guarded(app: Callable[..., Any]) -> None:
    """Run the application and turn its errors into sentences and exit codes."""
    try:
        app()
    except KeyboardInterrupt:
        fail("interrupted", Exit.INTERRUPTED)
    except Exception as error:
        _explain(error)


@contextmanager
def until_nobody_reads() -> Iterator[None]:
    """Inside, a reader that goes away, as `| head` does, ends the command in peace."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _explain(error: Exception) -> NoReturn:
    """The sentence and code for an error; our own kinds speak for themselves."""
    from snooker_cli.config import ConfigError

    if isinstance(error, ConfigError):
        fail(str(error), Exit.CONFIG)
    from snooker_cli.gallery import PictureError
    from snooker_cli.report.rendering import RenderingError
    from snooker_cli.results import RunError
    from snooker_cli.store import StoreError

    if isinstance(error, StoreError):
        fail(str(error), Exit.SOME_FAILED)
    if isinstance(error, RunError | PictureError | RenderingError | UserError):
        fail(str(error), Exit.USAGE)
    fail(
        f"unexpected {type(error).__name__}: {error}; this is a fault of snooker, please report it "
        "with the command and config",
        Exit.UNEXPECTED,
    )


class UserError(Exception):
    """A wrong argument that the parser could not see; one sentence."""
