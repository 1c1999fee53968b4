"""The one way this project compiles: no fast-math, no global lock, cached on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])

try:
    from numba import njit
except ImportError:  # no wheel for this machine: the same source runs as plain Python, slowly
    COMPILED = False

    def compiled(function: Function) -> Function:
        """Leave the function as it is: there is no compiler on this machine."""
        return function
else:
    COMPILED = True

    def compiled(function: Function) -> Function:
        """Compile with exactly rounded arithmetic.

        + - * / and sqrt are exactly rounded by IEEE 754 and, without fast-math, neither
        re-ordered nor fused: the same source gives the same bits on every CPU.
        """
        return cast("Function", njit(cache=True, nogil=True, error_model="numpy")(function))
