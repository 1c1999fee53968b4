"""A kernel's machine code: kept in a file, loaded, and called with arrays and numbers.

A compiled function takes what Numba makes of its arguments: an array is nine numbers or more (two
that no kernel here uses, its size, an element's, its address, its shape and its strides), a tuple
its elements one after the other. It writes what it returns where it is told, and its own value is
zero unless an exception was raised.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import llvmlite.binding as llvm
import numpy as np

Values: TypeAlias = list[Any]
Kinds: TypeAlias = tuple[Any, ...]
Code: TypeAlias = Callable[[tuple[Any, ...], Values], Any]
"""A function of arguments, and of the values that machine code is given for them."""

RETURNED, RETURNED_NONE = 0, -2
"""What a compiled function's own value is if it raised no exception."""

SCALARS: dict[type, Any] = {
    type(None): ctypes.c_void_p,
    bool: ctypes.c_bool,
    np.bool_: ctypes.c_bool,
    int: ctypes.c_int64,
    np.int64: ctypes.c_int64,
    float: ctypes.c_double,
    np.float64: ctypes.c_double,
    np.float32: ctypes.c_float,
}

IRRELEVANT = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"}
"""Settings of Numba that leave machine code as it is."""

LLVM_NAMES: dict[Any, str] = {
    ctypes.c_void_p: "ptr",
    ctypes.c_bool: "i8",
    ctypes.c_int64: "i64",
    ctypes.c_double: "double",
    ctypes.c_float: "float",
}

KINDS = {kind: LLVM_NAMES[native] for kind, native in SCALARS.items()}

BY_ROWS, BY_COLUMNS = 0x1, 0x2
LAYOUT = BY_ROWS | BY_COLUMNS | 0x100 | 0x400
"""What machine code depends on of an array's flags: in rows or columns, aligned, writeable."""


def flattened(arguments: tuple[Any, ...]) -> tuple[Kinds, Values]:
    """Of what kinds arguments are, and what machine code is given for them.

    Raises ``TypeError`` for what is no number, array of numbers, ``None`` or tuple of these.
    """
    kinds: list[Any] = []
    values: Values = []
    for argument in arguments:
        _flatten(argument, kinds, values)
    return tuple(kinds), values


def _flatten(argument: Any, kinds: list[Any], values: Values) -> None:
    if isinstance(argument, np.ndarray):
        ndim, shape = argument.ndim, argument.shape
        layout = argument.flags.num & LAYOUT
        # What is in rows is not in columns, too, though an array of one row or none is both.
        kinds += argument.dtype, ndim, layout & ~BY_COLUMNS if layout & BY_ROWS else layout
        address = argument.ctypes.data
        values += None, None, argument.size, argument.itemsize, address, *shape, *argument.strides
    elif isinstance(argument, tuple):
        kinds += type(argument).__name__, "("
        for each in argument:
            _flatten(each, kinds, values)
        kinds.append(")")
    else:
        kind = KINDS.get(type(argument))
        if kind is None:
            raise TypeError(f"a kernel takes no {type(argument).__name__}: {argument!r}")
        kinds.append(kind)
        values.append(argument)


def _native(argument: Any) -> Iterator[Any]:
    """The types, in C, of an argument's values."""
    if isinstance(argument, np.ndarray):
        pointer, number = ctypes.c_void_p, ctypes.c_int64
        yield from (pointer, pointer, number, number, pointer)
        yield from [number] * (2 * argument.ndim)
    elif isinstance(argument, tuple):
        for each in argument:
            yield from _native(each)
    else:
        yield SCALARS[type(argument)]


@dataclass(frozen=True)
class MachineCode:
    """A compiled function.

    name : in the code
    returned : what it returns, by Numba's name
    parameters : their types, by LLVM's names, after the one for what is returned and one for
        exceptions
    needed : names of functions it calls that are not its own, as of the C library
    code : an object file's bytes
    """

    RESULTS: ClassVar[dict[str, Any]] = {
        "none": ctypes.c_void_p,
        "bool": ctypes.c_bool,
        "int64": ctypes.c_int64,
        "float64": ctypes.c_double,
        "float32": ctypes.c_float,
    }

    name: str
    returned: str
    parameters: list[str]
    needed: list[str]
    code: bytes

    def fits(self, arguments: tuple[Any, ...]) -> bool:
        """Whether it takes such arguments, as far as their number and types tell."""
        given = [LLVM_NAMES[each] for argument in arguments for each in _native(argument)]
        return self.parameters == ["ptr", "ptr", *given]

    def bound(self, arguments: tuple[Any, ...]) -> Code:
        """The function, for such arguments as these.

        Raises ``NotImplementedError`` if it does not take them, or needs what is not there.
        """
        if not self.fits(arguments):
            raise NotImplementedError(f"{self.name} takes {self.parameters}")
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
        for name in self.needed:
            if llvm.address_of_symbol(name) is None:
                raise NotImplementedError(f"{self.name} needs {name}")
        engine.add_object_file(llvm.ObjectFileRef.from_data(self.code))
        engine.finalize_object()
        native = (each for argument in arguments for each in _native(argument))
        address = engine.get_function_address(self.name)
        pointer = ctypes.c_void_p
        function = ctypes.CFUNCTYPE(ctypes.c_int32, pointer, pointer, *native)(address)
        returned = self.RESULTS[self.returned]

        def call(_arguments: tuple[Any, ...], values: Values) -> Any:
            result, exception = returned(), pointer()
            status = function(ctypes.byref(result), ctypes.byref(exception), *values)
            if status not in (RETURNED, RETURNED_NONE):
                raise RuntimeError(f"{self.name} ended with {status}")
            return result.value

        call.engine = engine  # type: ignore[attr-defined]  # which holds the memory it is in
        return call

    def save(self, path: Path) -> None:
        """Keep it in a file, whole or not at all; where that cannot be, it is compiled again."""
        about = {"name": self.name, "returned": self.returned, "needed": self.needed}
        about |= {"parameters": self.parameters, "sha256": hashlib.sha256(self.code).hexdigest()}
        part = path.with_name(f"{path.name}-{os.getpid()}")
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                part.write_bytes(json.dumps(about).encode() + b"\n" + self.code)
                part.replace(path)
            finally:
                part.unlink(missing_ok=True)


def load(path: Path) -> MachineCode | None:
    """What is in a file; ``None`` if there is none or it is damaged."""
    try:
        head, _, code = path.read_bytes().partition(b"\n")
        about = json.loads(head)
        sound = about.pop("sha256") == hashlib.sha256(code).hexdigest()
        return MachineCode(**about, code=code) if sound else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def file_name(function: Callable[..., Any], kinds: Kinds) -> str:
    """What the file of a function's machine code is called, for this processor and arguments."""
    what = f"{_target()} {_source(function.__code__.co_filename)} {[*map(str, kinds)]}"
    what = hashlib.sha256(what.encode()).hexdigest()[:16]
    room = function.__module__.removeprefix("snooker_cli.")
    return f"{room}.{function.__qualname__}-{what}.code"


@cache
def _source(path: str) -> str:
    """A hash of a file."""
    with suppress(OSError):
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    return ""


@cache
def _target() -> str:
    """What machine code depends on besides the source: processor, compiler and its settings."""
    processor = llvm.get_process_triple(), llvm.get_host_cpu_name()
    features = llvm.get_host_cpu_features().flatten()
    ours = {name for name in os.environ if name.startswith("NUMBA_")} - IRRELEVANT
    settings = [(name, os.environ[name]) for name in sorted(ours)]
    return f"{processor} {features} {version('numba')} {version('llvmlite')} {settings}"


def _target_machine() -> Any:
    """A machine to load code into, which an engine then owns."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple().create_target_machine(jit=True)
