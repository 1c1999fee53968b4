"""Numba, which compiles this engine where no file has its machine code: nobody else imports it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import Any

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba import njit, types
from numba.core.registry import cpu_target
from numba.extending import intrinsic, overload, register_jitable

from snooker_cli.engine.instructions import fetch, fused, lowest_bit
from snooker_cli.engine.machine_code import MachineCode

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "no_cpython_wrapper": True,
    "_nrt": False,
}
"""No fast-math, no global lock; no ways in from outside but our own, and no counted references."""

INLINED: Any = OPTIONS | {"forceinline": True}

_typeof: Any = numba.typeof

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


load_without_blas("numba.np.arraymath")


def inline(functions: list[Callable[..., Any]]) -> None:
    """Compile functions into whoever calls them, from now on; none is left in the list."""
    while functions:
        register_jitable(**INLINED)(functions.pop())


def machine_code_of(function: Callable[..., Any], arguments: tuple[Any, ...]) -> MachineCode:
    """Compile a function for the kinds of these arguments.

    Raises ``NotImplementedError`` if it cannot be taken out of Numba, as what returns a tuple.
    """
    dispatcher = _dispatcher(function)
    signature = tuple(map(_typeof, arguments))
    dispatcher.compile(signature)
    compiled = dispatcher.overloads[signature]
    returned = str(compiled.signature.return_type)
    if returned not in MachineCode.RESULTS:
        raise NotImplementedError(f"{function.__name__} returns {returned}")
    module = llvm.parse_assembly(dispatcher.inspect_llvm(signature))
    name = compiled.fndesc.mangled_name
    parameters = [str(each.type) for each in module.get_function(name).arguments]
    needed = [
        each.name
        for each in module.functions
        if each.is_declaration and not each.name.startswith("llvm.")
    ]
    # As Numba itself does, with what it knows of the processor and was told of it.
    target_machine = getattr(cpu_target.target_context.codegen(), "_tm", None)
    if target_machine is None:
        raise NotImplementedError("this Numba does not tell what machine it compiles for")
    return MachineCode(name, returned, parameters, needed, target_machine.emit_object(module))


@cache
def callable_from_python(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that Numba compiles when it is called."""
    options = OPTIONS | {"no_cpython_wrapper": False}
    compiled: Callable[..., Any] = njit(**options)(function)
    return compiled


def type_of(function: Callable[..., Any]) -> Any:
    """What a kernel is to another that calls it."""
    return types.Dispatcher(_dispatcher(function))


@cache
def _dispatcher(function: Callable[..., Any]) -> Any:
    """Numba's side of a kernel."""
    return njit(**OPTIONS)(function)


@intrinsic
def _fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """One instruction, or the C library's function with its bits."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def _lowest_bit(typing_context: Any, mask: Any) -> Any:
    """One instruction, which Python has not."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], context.get_constant(types.boolean, 1))

    return types.int64(types.int64), generate


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


@overload(fused, jit_options=INLINED)
def _fused_when_compiled(a: float, b: float, c: float) -> Callable[..., float]:
    def instruction(a: float, b: float, c: float) -> float:
        return _fused(a, b, c)  # type: ignore[call-arg]

    return instruction


@overload(lowest_bit, jit_options=INLINED)
def _lowest_bit_when_compiled(mask: int) -> Callable[..., int]:
    def instruction(mask: int) -> int:
        return _lowest_bit(mask)  # type: ignore[call-arg]

    return instruction


@overload(fetch, jit_options=INLINED)
def _fetch_when_compiled(array: Any, place: int) -> Callable[..., None]:
    def instruction(array: Any, place: int) -> None:
        _fetch(array, place)  # type: ignore[call-arg]

    return instruction
