"""The one way this project compiles: no fast-math, no global lock, cached on disk."""

from __future__ import annotations

import hashlib
import importlib
import math
import sys
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

try:
    from llvmlite import ir
    from numba import config, njit, types
    from numba.extending import intrinsic, overload, register_jitable

    COMPILED = not getattr(config, "DISABLE_JIT", 0)
except ImportError:  # no wheel for this machine: the same source runs as plain Python, slowly
    COMPILED = False


def fused(a: float, b: float, c: float) -> float:
    """a b + c, rounded once."""
    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    return float(Fraction(a) * Fraction(b) + Fraction(c))


BLAS = "scipy.linalg.cython_blas"


def load_without_blas(name: str) -> None:
    """Import what asks whether SciPy's BLAS is there, without the quarter of a second it takes.

    It is told yes. Whoever then needs BLAS, as no kernel here does, has it imported.
    """
    there = sys.modules.setdefault(BLAS, ModuleType(BLAS))
    try:
        with suppress(ImportError):
            importlib.import_module(name)
    finally:
        if there.__spec__ is None:
            del sys.modules[BLAS]


if COMPILED:
    load_without_blas("numba.np.arraymath")

    # Numba looks only at a function's own file to see whether its compiled form is out of date, not
    # at those of the functions it calls: so each state of the engine has a cache of its own.
    _SOURCES = sorted(Path(__file__).parent.glob("*.py"))
    _STATE = hashlib.sha256(b"".join(source.read_bytes() for source in _SOURCES)).hexdigest()[:16]
    _settings: Any = config
    _cache = _settings.CACHE_DIR or Path(__file__).with_name("__pycache__")
    CACHE: Path | None = Path(_cache) / f"engine-{_STATE}"
    _settings.CACHE_DIR = str(CACHE)

    OPTIONS: dict[str, Any] = {
        "cache": True,
        "nogil": True,
        "error_model": "numpy",
        "no_cfunc_wrapper": True,
    }

    INLINED = OPTIONS | {"forceinline": True, "no_cpython_wrapper": True, "_nrt": False}

    def compiled(function: Function) -> Function:
        """Compile with exactly rounded arithmetic.

        + - * / and sqrt are exactly rounded by IEEE 754 and, without fast-math, neither
        re-ordered nor fused: the same source gives the same bits on every CPU.
        """
        return cast("Function", njit(**OPTIONS | {"_nrt": True})(function))

    def kernel(function: Function) -> Function:
        """Compile what owns no array, and so need not count who refers to which.

        To count took a fourteenth of the time and, with a free container among cells, a third.
        """
        return cast("Function", njit(**OPTIONS | {"_nrt": False})(function))

    def inlined(function: Function) -> Function:
        """Compile into whoever calls it: a call costs as much as looking at ten pairs.

        From Python it stays a Python function. Without the two ways in from outside, which nothing
        takes, the engine is compiled in half the time.
        """
        return register_jitable(**INLINED)(function)

    @intrinsic
    def _lowest_bit(typing_context: Any, mask: Any) -> Any:
        """Place of the lowest bit that is set, from 0: one instruction, which Python has not."""

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.cttz(arguments[0], context.get_constant(types.boolean, 1))

        return types.int64(types.int64), generate

    lowest_bit = cast("Callable[[int], int]", _lowest_bit)

    @intrinsic
    def _fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
        """One instruction, or the C library's function with its bits."""

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.fma(*arguments)

        return types.float64(types.float64, types.float64, types.float64), generate

    @intrinsic
    def _fetch(typing_context: Any, array: Any, place: Any) -> Any:
        """One instruction, which nothing waits for."""

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            view = context.make_array(signature.args[0])(context, builder, arguments[0])
            word, byte = ir.IntType(32), ir.IntType(8).as_pointer()
            prefetch = builder.module.declare_intrinsic(
                "llvm.prefetch", [byte], ir.FunctionType(ir.VoidType(), [byte, word, word, word])
            )
            address = builder.bitcast(builder.gep(view.data, [arguments[1]]), byte)
            to_read, for_long, data = word(0), word(3), word(1)
            builder.call(prefetch, [address, to_read, for_long, data])
            return context.get_dummy_value()

        return types.void(array, types.int64), generate

    fetch = cast("Callable[[Any, int], None]", _fetch)

    _inlining: Any = INLINED

    @overload(fused, jit_options=_inlining)
    def _fused_when_compiled(a: float, b: float, c: float) -> Callable[..., float]:
        def instruction(a: float, b: float, c: float) -> float:
            return _fused(a, b, c)  # type: ignore[call-arg]

        return instruction

else:
    CACHE = None

    def compiled(function: Function) -> Function:
        """Leave the function as it is: there is no compiler on this machine.

        As when compiled, nothing is said of 0 * inf and the like: of these no comparison is true.
        """
        return np.errstate(all="ignore")(function)

    kernel = compiled

    def inlined(function: Function) -> Function:
        """Leave the function as it is."""
        return function

    def fetch(array: Any, place: int) -> None:
        """Do nothing, as it is only for time's sake."""

    def lowest_bit(mask: int) -> int:
        """Place of the lowest bit that is set, from 0."""
        return (int(mask) & -int(mask)).bit_length() - 1
