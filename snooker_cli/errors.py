"""Errors that a user can cause and fix, their exit codes, and how a command ends."""

import difflib
import errno
import mmap
import os
import shlex
import sys
import traceback
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from enum import IntEnum
from pathlib import Path
from typing import Any, ClassVar, TextIO

from snooker_cli.formatting import printable
from snooker_cli.options import Wording, in_command
from snooker_cli.signals import INTERRUPTED, end_interrupted, raising

ROOM = 1 << 28  # bytes without which a command can hardly do anything

LOADING = ", in <module>\n"  # of a traceback: a module was being loaded

TRACEBACK = "SNOOKER_TRACEBACK"  # in the environment: show tracebacks of unexpected errors


class ExitCode(IntEnum):
    """Exit codes of ``snooker``."""

    DONE = 0
    UNEXPECTED = 1
    UNSOUND = 1  # a result file cannot be trusted
    USAGE = 2
    CONFIG = 3
    SOME_FAILED = 4
    INTERRUPTED = INTERRUPTED


def error_text(error: Exception) -> str:
    """The first line of an error of HDF5, of JSON or of the system."""
    if isinstance(error, OSError) and error.errno:
        return os.strerror(error.errno)
    if isinstance(error, KeyError):
        return f"no {error}"
    return (str(error).splitlines() or [type(error).__name__])[0]


def room_advice(error: Exception) -> str:
    """What a user can do where a file cannot be written."""
    full = getattr(error, "errno", None) in (None, errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return "make room" if full else "check the folder and its permissions"


def install_advice(extra: str) -> str:
    """What a user can do about a library that an extra of the package needs."""
    from importlib.metadata import PackageNotFoundError, requires  # takes a while to load

    with suppress(PackageNotFoundError):
        lines = (line.partition(";") for line in requires("snooker-cli") or ())
        marks = (f"extra == '{extra}'", f'extra == "{extra}"')
        names = [shlex.quote(name.strip()) for name, _, when in lines if when.strip() in marks]
        return f"install it with `pip install {' '.join(names)}`"
    return f"install it with `pip install '.[{extra}]'` in the folder of snooker"


class SnookerError(Exception):
    """Base class of all errors that a user can fix; its text is one sentence.

    problem : what is wrong
    advice : what the user can do; the text is then ``problem; advice``
    code : names the problem for programs and tests, which never depend on the text

    Every subclass has the exit code of a command that it ends.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.USAGE

    def __init__(self, problem: str, advice: str = "", *, code: str = "") -> None:
        super().__init__(f"{problem}; {advice}" if advice else problem)
        self.problem = problem
        self.code = code

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the fields as they are: ``__init__`` of a subclass takes other arguments."""
        return type(self).__new__, (type(self), *self.args), self.__dict__


class UserError(SnookerError):
    """A command or setting that cannot work: a wrong argument, a missing library, a full disk."""


class ArgumentError(UserError, ValueError):
    """An argument with a value that it cannot have."""


class ArgumentTypeError(UserError, TypeError):
    """An argument of a wrong type."""


class PlaceError(UserError, IndexError):
    """A point or a repeat that a run does not have."""


class SceneError(SnookerError):
    """A scene that cannot exist.

    key : the config key to change
    ball : the number of the ball that is wrong, if it is one
    """

    exit_code = ExitCode.CONFIG

    def __init__(self, key: str, problem: str, ball: int | None = None) -> None:
        super().__init__(problem)
        self.key = key
        self.ball = ball


class JammedError(Exception):
    """Random places that could not be found; ``packing`` is the packing fraction reached."""

    def __init__(self, packing: float) -> None:
        super().__init__(packing)
        self.packing = packing


class StoreError(SnookerError):
    """A result or manifest that cannot be read or trusted; ``reason`` does not repeat its path."""

    exit_code = ExitCode.UNSOUND

    def __init__(self, path: Path, reason: str, advice: str) -> None:
        super().__init__(f"{path}: {reason}", advice)
        self.reason = reason
        self.advice = advice


class UnsoundError(SnookerError):
    """A repeat in memory whose events cannot be true."""

    exit_code = ExitCode.UNSOUND


class AbsentError(StoreError):
    """A result file that is missing or cannot be written."""

    exit_code = ExitCode.USAGE


class DeniedError(StoreError):
    """A file that cannot be read now, but may be sound; no command replaces it."""

    exit_code = ExitCode.USAGE

    def __init__(
        self,
        path: Path,
        reason: str = "cannot be read (permission denied)",
        advice: str = "check its permissions",
    ) -> None:
        super().__init__(path, reason, advice)


class RunError(SnookerError):
    """A run's folder, or its workers, that cannot be used."""


class FigureError(SnookerError):
    """A figure or film that a run cannot give."""


class KeyAbsentError(FigureError):
    """A key that an experiment does not have.

    key : the key
    keys : those that it has
    """

    def __init__(self, key: str, keys: Sequence[str], advice: str) -> None:
        super().__init__(f"the experiment has no key {key}", advice)
        self.key = key
        self.keys = keys


class KeywordError(KeyAbsentError, TypeError):
    """A keyword of a function of Python that is neither an argument nor a key."""

    def __init__(self, function: str, arguments: Sequence[str], absent: KeyAbsentError) -> None:
        near = difflib.get_close_matches(absent.key, [*arguments, *absent.keys], n=1)
        advice = f"did you mean {near[0]}?" if near else "give an argument, or a key of the config"
        super().__init__(absent.key, absent.keys, advice)
        self.args = (f"{function}() got an unexpected keyword argument '{self.key}'; {advice}",)


def check_name(name: str, names: Iterable[str], noun: str, where: Wording | str) -> None:
    """Raise ``ArgumentError``, with a similar name if there is one, if a name is unknown.

    where : lists all names
    """
    names = list(names)
    if name not in names:
        near = difflib.get_close_matches(str(name), names, n=1)
        nearest = f"the nearest is {near[0]}, and " if near else ""
        raise ArgumentError(f"there is no {noun} {name}; {nearest}{where} lists all")


# How a command ends.


def notice(message: str) -> None:
    """Print a notice on stderr, if that can be written."""
    try:
        print(printable(f"snooker: {message}", "\n"), file=sys.stderr, flush=True)
    except OSError:
        drop(sys.stderr)


def drop(stream: TextIO) -> None:
    """Let nothing come of what was and will be printed: the reader has left, or a disk is full."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def lacks_memory(error: BaseException) -> bool:
    """Whether an error comes from too little memory, which libraries report in many ways."""
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
        return True
    try:
        mmap.mmap(-1, ROOM).close()
    except (OSError, MemoryError):
        return True
    return False


def described(error: BaseException) -> str:
    """The type and text of an unexpected error, as ``MemoryError`` if it is one."""
    name = "MemoryError" if lacks_memory(error) else type(error).__name__
    return f"{name}: {error}"


PACKAGES: dict[str, str] = {}
"""Installed packages that add to snooker, by the folders or files of their sources."""


def _owner(trace: str) -> str:
    """Whose code failed: the last package that a traceback names, else snooker."""
    places = {trace.rfind(f'File "{path}'): name for path, name in PACKAGES.items()}
    place = max(places, default=-1)
    return "snooker" if place < 0 else places[place]


def bug_message(error: str, trace: str, less: str = "use fewer balls") -> str:
    """The sentence for an internal error; its traceback is printed if the environment asks.

    less : what takes less memory
    """
    where = f"; set {TRACEBACK}=1 to see where it happened"
    if os.environ.get(TRACEBACK, "") not in ("", "0"):
        print(trace, file=sys.stderr)
        where = ""
    if "MemoryError" in error.partition(":")[0]:
        if LOADING in trace:
            less = "close other programs, or let this one use more (`ulimit -v`)"
            return f"there is too little memory to load a library ({error}); {less}{where}"
        return f"there is too little memory ({error}); {less}{where}"
    return (
        f"unexpected {error}; this is a bug in {_owner(trace)}, please report it with the command "
        f"and the config{where}"
    )


def explained(error: BaseException) -> tuple[ExitCode, str]:
    """The exit code and the sentence for any error that ends a command."""
    if isinstance(error, SnookerError):
        return error.exit_code, str(error)
    if isinstance(error, OSError) and not lacks_memory(error):
        file, reason = f"{error.filename}: " if error.filename else "", error.strerror or error
        return ExitCode.USAGE, f"{file}{reason}; check the path, the disk and its permissions"
    trace = "".join(traceback.format_exception(error))
    return ExitCode.UNEXPECTED, bug_message(described(error), trace)


def guarded(app: Callable[..., Any]) -> None:
    """Run the application; print its errors as sentences and end with their exit codes."""
    try:
        with in_command(), raising() as interrupts:
            app()
    except (KeyboardInterrupt, SystemExit, Exception) as end:
        # Typer makes a SystemExit of a KeyboardInterrupt, and libraries make other errors of it.
        failed = not isinstance(end, SystemExit) or end.code
        if isinstance(end, KeyboardInterrupt) or (interrupts and failed):
            end_interrupted()
        if isinstance(end, SystemExit):
            raise
        code, message = explained(end)
        notice(message)
        raise SystemExit(int(code)) from None
