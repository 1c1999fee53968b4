"""How a command ends: exit codes, sentences for errors, Ctrl-C and SIGTERM."""

import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

from snooker_cli.errors import ExitCode, SnookerError
from snooker_cli.formatting import printable

STOPPING = (signal.SIGINT, signal.SIGTERM)
"""Signals that ask a command to end: Ctrl-C, and what `kill` and batch systems send."""

RAISE_AGAIN_AFTER = 0.02  # seconds until an interrupt that Python dropped is raised again

TRACEBACK = "SNOOKER_TRACEBACK"
"""The environment variable that shows the traceback of an unexpected error."""


@contextmanager
def handling(handler: Callable[[int, object], None], numbers: Iterable[int]) -> Iterator[None]:
    """Inside, a function handles these signals."""
    previous = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


def not_ignored(*more: int) -> list[int]:
    """Ctrl-C, SIGTERM and more signals, without those that the parent process ignores."""
    return [
        number for number in (*STOPPING, *more) if signal.getsignal(number) is not signal.SIG_IGN
    ]


@contextmanager
def ending_on_interrupt() -> Iterator[None]:
    """Inside, an interrupt ends the process at once; for the time when modules load.

    An exception would not do: modules in C print it and continue, or raise another one.
    """

    def end(_number: int, _frame: object) -> None:
        os.write(2, b"snooker: interrupted\n")
        os._exit(ExitCode.INTERRUPTED)

    with handling(end, not_ignored()):
        yield


@contextmanager
def raising() -> Iterator[list[int]]:
    """Inside, an interrupt raises ``KeyboardInterrupt``; gives the signals that came.

    Python drops an exception that is raised in a callback, for example when HDF5 deletes objects.
    The interrupt is then raised again.
    """
    came: list[int] = []
    before = sys.unraisablehook

    def interrupt(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    def dropped(unraisable: Any) -> None:
        if sys.platform != "win32" and unraisable.exc_type is KeyboardInterrupt:
            signal.setitimer(signal.ITIMER_REAL, RAISE_AGAIN_AFTER)
        else:
            before(unraisable)

    alarm = () if sys.platform == "win32" else (signal.SIGALRM,)
    sys.unraisablehook = dropped
    try:
        with handling(interrupt, not_ignored(*alarm)):
            yield came
    finally:
        sys.unraisablehook = before


def wants_traceback() -> bool:
    """Whether the environment asks for the tracebacks of unexpected errors."""
    return os.environ.get(TRACEBACK, "") not in ("", "0")


def bug_message(error: str) -> str:
    """The sentence for an internal error."""
    where = "" if wants_traceback() else f"; set {TRACEBACK}=1 to see where it happened"
    return (
        f"unexpected {error}; this is a bug in snooker, please report it with the command and the "
        f"config{where}"
    )


def leave(code: int) -> NoReturn:
    """End the process now: Python would wait for threads that have nothing to save."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # the reader has gone
            continue
    os._exit(code)


def guarded(app: Callable[..., Any]) -> None:
    """Run the application; print its errors as sentences and end with their exit codes."""
    try:
        with raising() as interrupts:
            app()
    except (KeyboardInterrupt, SystemExit, Exception) as end:
        # Typer makes a SystemExit of a KeyboardInterrupt, and libraries make other errors of it.
        failed = not isinstance(end, SystemExit) or end.code
        if isinstance(end, KeyboardInterrupt) or (interrupts and failed):
            print("snooker: interrupted", file=sys.stderr)
            leave(ExitCode.INTERRUPTED)
        if isinstance(end, SystemExit):
            raise
        message, code = _explained(end)
        print(printable(f"snooker: {message}", "\n"), file=sys.stderr)
        raise SystemExit(int(code)) from None


def _explained(error: Exception) -> tuple[str, ExitCode]:
    """The sentence and exit code of an error."""
    if isinstance(error, SnookerError):
        return str(error), error.exit_code
    if isinstance(error, OSError):
        file = f"{error.filename}: " if error.filename else ""
        reason = error.strerror or error
        return f"{file}{reason}; check the path, the disk and its permissions", ExitCode.USAGE
    if wants_traceback():
        traceback.print_exception(error)
    return bug_message(f"{type(error).__name__}: {error}"), ExitCode.UNEXPECTED
