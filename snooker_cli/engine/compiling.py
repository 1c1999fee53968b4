"""What compiles this engine, and how its kernels are called: from files, without the compiler."""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable
from functools import update_wrapper
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from snooker_cli.engine.patience import compiling

if TYPE_CHECKING:
    from snooker_cli.engine.machine_code import Code, Kinds

Function = TypeVar("Function", bound=Callable[..., Any])

COMPILED = (
    os.environ.get("NUMBA_DISABLE_JIT", "0") in {"", "0"}
    and find_spec("numba") is not None
    and find_spec("llvmlite") is not None
)
"""If not, as where these have no wheels, the same source runs as plain Python, slowly."""


def _cache() -> Path:
    """Where the machine code of this state of the engine is, or would be.

    Beside the source or, where that cannot be written, among the user's files.
    """
    told = os.environ.get("NUMBA_CACHE_DIR")
    here = Path(__file__).parent
    if told:
        folder = Path(told)
    elif os.access(here, os.W_OK):
        folder = here / "__pycache__"
    else:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "snooker"
    # A kernel holds the code of functions and the constants of other files than its own.
    files = [*sorted(here.glob("*.py")), here.with_name("trace.py")]
    sources = (source.read_bytes() for source in files)
    return folder / f"engine-{hashlib.sha256(b''.join(sources)).hexdigest()[:16]}"


CACHE = _cache() if COMPILED else None

INLINED: list[Callable[..., Any]] = []
"""What the compiler, once it is there, is to compile into whoever calls it."""

_one_at_a_time = threading.RLock()


class Kernel:
    """A function that has machine code for each kind of arguments it has been called with.

    The code is made once on a machine, by Numba, and kept in a file. To load it takes a few
    milliseconds, to import Numba more than half a second.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.function = function
        self._codes: dict[Kinds, Code] = {}

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code.

        Raises ``TypeError`` for what is no number, array of numbers, ``None`` or tuple of these.
        """
        from snooker_cli.engine.machine_code import flattened

        kinds, values = flattened(arguments)
        code = self._codes.get(kinds)
        if code is None:
            with _one_at_a_time:
                code = self._codes.get(kinds) or self._code(kinds, arguments)
                self._codes[kinds] = code
        return code(arguments, values)

    def _code(self, kinds: Kinds, arguments: tuple[Any, ...]) -> Code:
        """The code for such arguments, from its file if there is one."""
        from snooker_cli.engine import machine_code

        assert CACHE is not None
        path = CACHE / machine_code.file_name(self.function, kinds)
        try:
            found = machine_code.load(path)
            if found is not None:
                return found.bound(arguments)
            with compiling():
                from snooker_cli.engine import compiler

                compiler.inline(INLINED)
                found = compiler.machine_code_of(self.function, arguments)
            found.save(path)
            return found.bound(arguments)
        except NotImplementedError:  # then Numba may call what it has compiled, as it can itself
            from snooker_cli.engine import compiler

            compiler.inline(INLINED)
            by_numba = compiler.callable_from_python(self.function)
            return lambda arguments, _values: by_numba(*arguments)
        except ImportError:  # a Numba that is not for this NumPy
            plain = _plain(self.function)
            return lambda arguments, _values: plain(*arguments)

    @property
    def _numba_type_(self) -> Any:
        """What Numba asks for when it compiles a function that calls this one."""
        from snooker_cli.engine import compiler

        return compiler.type_of(self.function)


def kernel(function: Function) -> Function:
    """Compile with exactly rounded arithmetic.

    + - * / and sqrt are exactly rounded by IEEE 754 and, without fast-math, neither re-ordered nor
    fused: the same source gives the same bits on every CPU. Nor does a kernel own arrays: to count
    who refers to which took a fourteenth of the time and, with a free container, a third.
    """
    if COMPILED:
        return cast("Function", Kernel(function))
    return _plain(function)


def _plain(function: Function) -> Function:
    """The function as it is.

    As when compiled, nothing is said of 0 * inf and the like: of these no comparison is true.
    """
    return np.errstate(all="ignore")(function)


def inlined(function: Function) -> Function:
    """Compile into whoever calls it: a call costs as much as looking at ten pairs.

    From Python it stays a Python function.
    """
    INLINED.append(function)
    return function
