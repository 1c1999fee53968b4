"""How a command ends: exit codes, and one sentence for each error a person can meet."""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

from snooker_cli.errors import ExitCode, SnookerError

# Ctrl-C and SIGTERM: answered from the first moment on, with a sentence, and never lost.

STOPPING = (signal.SIGINT, signal.SIGTERM)
"""What asks a command to end: Ctrl-C, and what `kill` and batch systems send."""

AGAIN = 0.02
"""Seconds until an interrupt that was lost is raised again."""


@contextmanager
def answered(handler: Callable[[int, object], None], numbers: Iterable[int]) -> Iterator[None]:
    """Inside, a function answers these signals."""
    previous = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


def not_ignored(*more: int) -> list[int]:
    """Ctrl-C, SIGTERM and more signals; not those that our starter has us ignore."""
    numbers = (*STOPPING, *more)
    return [each for each in numbers if signal.getsignal(each) is not signal.SIG_IGN]


@contextmanager
def at_once() -> Iterator[None]:
    """Inside, where modules are loaded and nothing is under way, an interrupt ends the process.

    To raise an exception there is no way: modules in C print it and go on, or make it another one.
    """

    def end(_number: int, _frame: object) -> None:
        os.write(2, b"snooker: interrupted\n")
        os._exit(130)

    with answered(end, not_ignored()):
        yield


@contextmanager
def raising() -> Iterator[list[int]]:
    """Inside, an interrupt raises ``KeyboardInterrupt``; gives the numbers of those that came.

    Python drops an exception that is raised where nobody can catch it, as in the callbacks with
    which HDF5's objects are deleted after a long read: it is then raised again.
    """
    came: list[int] = []
    before = sys.unraisablehook

    def interrupt(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    def lost(unraisable: sys.UnraisableHookArgs) -> None:
        if sys.platform != "win32" and unraisable.exc_type is KeyboardInterrupt:
            signal.setitimer(signal.ITIMER_REAL, AGAIN)
        else:
            before(unraisable)

    alarm = () if sys.platform == "win32" else (signal.SIGALRM,)
    sys.unraisablehook = lost
    try:
        with answered(interrupt, not_ignored(*alarm)):
            yield came
    finally:
        sys.unraisablehook = before


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


def fail(message: str, code: ExitCode) -> NoReturn:
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
    leave(ExitCode.INTERRUPTED)


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
    if isinstance(error, SnookerError):
        fail(str(error), error.exit_code)
    if isinstance(error, OSError):
        what = f"{error.filename}: " if error.filename else ""
        fail(f"{what}{error.strerror or error}; check the disk and its permissions", ExitCode.USAGE)
    if wants_traceback():
        traceback.print_exception(error)
    fail(fault(f"{type(error).__name__}: {error}"), ExitCode.UNEXPECTED)
