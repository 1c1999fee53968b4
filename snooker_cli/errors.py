"""Errors that a user can cause and fix, each with an exit code."""

import difflib
import errno
import os
from collections.abc import Iterable
from enum import IntEnum
from pathlib import Path
from typing import Any, ClassVar


class ExitCode(IntEnum):
    """Exit codes of ``snooker``."""

    DONE = 0
    UNEXPECTED = 1
    UNSOUND = 1  # a result file cannot be trusted
    USAGE = 2
    CONFIG = 3
    SOME_FAILED = 4
    COLLAPSED = 5
    INTERRUPTED = 130


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


UNREADABLE = (
    OSError,
    LookupError,
    ValueError,
    TypeError,
    RuntimeError,
    ArithmeticError,
    MemoryError,
    SceneError,
)
"""What reading a damaged file can raise: as HDF5, JSON, or as data of another kind."""


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


class AbsentError(StoreError):
    """A result file that is missing or cannot be written."""

    exit_code = ExitCode.USAGE


class DeniedError(StoreError):
    """A file that this user may not read; no command replaces it."""

    exit_code = ExitCode.USAGE

    def __init__(self, path: Path) -> None:
        super().__init__(path, "cannot be read (permission denied)", "check its permissions")


class RunError(SnookerError):
    """A run's folder, or its workers, that cannot be used."""


class FigureError(SnookerError):
    """A figure or film that a run cannot give."""


def check_name(name: str, names: Iterable[str], noun: str, command: str) -> None:
    """Raise ``UserError``, with a similar name if there is one, if a name is unknown.

    command : lists all names
    """
    names = list(names)
    if name not in names:
        near = difflib.get_close_matches(name, names, n=1)
        nearest = f"the nearest is {near[0]}, and " if near else ""
        raise UserError(f"there is no {noun} {name}; {nearest}`{command}` lists all")
