"""How a command ends: it prints errors and handles signals. The codes are in errors.py."""

import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

from snooker_cli.errors import ExitCode, SnookerError
from snooker_cli.formatting import printable

STOPPING = (signal.SIGINT, signal.SIGTERM)  # Ctrl-C, and what `kill` and batch systems send

TRACEBACK = "SNOOKER_TRACEBACK"  # in the environment: show tracebacks of unexpected errors


@contextmanager
def handling(
    handler: Callable[[int, object], None], numbers: Iterable[int] | None = None
) -> Iterator[None]:
    """Inside, a function handles these signals.

    numbers : by default ``STOPPING``, without those that the parent process ignores
    """
    if numbers is None:
        numbers = [each for each in STOPPING if signal.getsignal(each) is not signal.SIG_IGN]
    previous = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


def end_interrupted(*_signal: object) -> NoReturn:
    """End the process now, after an interrupt.

    While modules load, an exception would not do: those in C print it and continue, or raise
    another one.
    """
    os.write(2, b"snooker: interrupted\n")
    os._exit(ExitCode.INTERRUPTED)


@contextmanager
def raising() -> Iterator[list[int]]:
    """Inside, an interrupt raises ``KeyboardInterrupt``; gives the signals that came.

    Python drops an exception that is raised in a callback, for example when HDF5 deletes objects.
    The process then ends there.
    """
    came: list[int] = []
    before = sys.unraisablehook

    def interrupt(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    def dropped(unraisable: Any) -> None:
        if unraisable.exc_type is KeyboardInterrupt:
            end_interrupted()
        before(unraisable)

    sys.unraisablehook = dropped
    try:
        with handling(interrupt):
            yield came
    finally:
        sys.unraisablehook = before


def bug_message(error: str, trace: str) -> str:
    """The sentence for an internal error; its traceback is printed if the environment asks."""
    where = f"; set {TRACEBACK}=1 to see where it happened"
    if os.environ.get(TRACEBACK, "") not in ("", "0"):
        print(trace, file=sys.stderr)
        where = ""
    if "MemoryError" in error.partition(":")[0]:
        return f"there is too little memory ({error}); use fewer balls, or a smaller --jobs{where}"
    return (
        f"unexpected {error}; this is a bug in snooker, please report it with the command and the "
        f"config{where}"
    )


def guarded(app: Callable[..., Any]) -> None:
    """Run the application; print its errors as sentences and end with their exit codes."""
    try:
        with raising() as interrupts:
            app()
    except (KeyboardInterrupt, SystemExit, Exception) as end:
        # Typer makes a SystemExit of a KeyboardInterrupt, and libraries make other errors of it.
        failed = not isinstance(end, SystemExit) or end.code
        if isinstance(end, KeyboardInterrupt) or (interrupts and failed):
            end_interrupted()
        if isinstance(end, SystemExit):
            raise
        code = ExitCode.UNEXPECTED
        if isinstance(end, SnookerError):
            code, message = end.exit_code, str(end)
        elif isinstance(end, OSError):
            file, reason = f"{end.filename}: " if end.filename else "", end.strerror or end
            message = f"{file}{reason}; check the path, the disk and its permissions"
            code = ExitCode.USAGE
        else:
            trace = "".join(traceback.format_exception(end))
            message = bug_message(f"{type(end).__name__}: {end}", trace)
        print(printable(f"snooker: {message}", "\n"), file=sys.stderr)
        raise SystemExit(int(code)) from None
