"""How a command ends: exit codes, and one sentence for each error a person can meet."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import IntEnum
from typing import Any, NoReturn

from snooker_cli.cli.interrupts import raising


class Exit(IntEnum):
    """Exit codes of ``snooker``."""

    DONE = 0
    UNEXPECTED = 1
    UNSOUND = 1  # a result's file cannot be trusted
    USAGE = 2
    CONFIG = 3
    SOME_FAILED = 4
    COLLAPSED = 5
    INTERRUPTED = 130


OURS = {
    "ConfigError": Exit.CONFIG,
    "StoreError": Exit.UNSOUND,
    "AbsentError": Exit.USAGE,
    "DamagedError": Exit.UNSOUND,
    "RunError": Exit.USAGE,
    "PictureError": Exit.USAGE,
    "RenderingError": Exit.USAGE,
    "UserError": Exit.USAGE,
}
"""Errors that are a sentence for people, by name: whoever raised one has loaded its room."""

TRACEBACK = "SNOOKER_TRACEBACK"
"""The environment variable with which an unexpected error shows its traceback."""


def wants_traceback() -> bool:
    """Whether the environment asks for the tracebacks of unexpected errors."""
    return os.environ.get(TRACEBACK, "") not in ("", "0")


def fault(said: str) -> str:
    """The sentence for an error that no user can have made."""
    where = "" if wants_traceback() else f"; {TRACEBACK}=1 in the environment shows where it arose"
    return (
        f"unexpected {said}; this is a fault of snooker, please report it with the command and "
        f"the config{where}"
    )


def fail(message: str, code: Exit) -> NoReturn:
    """Say what is wrong on stderr and end."""
    print(f"snooker: {message}", file=sys.stderr)
    raise SystemExit(int(code))


def leave(code: int) -> NoReturn:
    """End the process now: Python would wait for threads that have nothing to save."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # nobody reads any more
            continue
    os._exit(code)


def guarded(app: Callable[..., Any]) -> None:
    """Run the application and turn its errors into sentences and exit codes."""
    try:
        with raising() as interrupts:
            app()
    except KeyboardInterrupt:
        _interrupted()
    except SystemExit as end:
        if interrupts and end.code:  # Typer makes one of a KeyboardInterrupt
            _interrupted()
        raise
    except Exception as error:
        if interrupts:
            _interrupted()
        _explain(error)


def _interrupted() -> NoReturn:
    """What was under way is cleared away; threads that still read are not waited for."""
    print("snooker: interrupted", file=sys.stderr)
    leave(Exit.INTERRUPTED)


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
    for kind in type(error).__mro__:
        if kind.__module__.startswith("snooker_cli.") and kind.__name__ in OURS:
            fail(str(error), OURS[kind.__name__])
    if isinstance(error, OSError):
        what = f"{error.filename}: " if error.filename else ""
        fail(f"{what}{error.strerror or error}; check the disk and its permissions", Exit.USAGE)
    if wants_traceback():
        traceback.print_exception(error)
    fail(fault(f"{type(error).__name__}: {error}"), Exit.UNEXPECTED)


class UserError(Exception):
    """A wrong argument that the parser could not see; one sentence."""
