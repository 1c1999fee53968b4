"""Compilation of the kernels with Numba, which is imported on the first call."""

import hashlib
import logging
import os
import platform
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, cached_property, update_wrapper, wraps
from importlib.metadata import version
from pathlib import Path
from tempfile import gettempdir
from types import CodeType, FunctionType
from typing import IO, Any, TypeVar, cast

import numpy as np

from snooker_cli.engine import linked_helpers
from snooker_cli.engine.compilation import COMPILATION
from snooker_cli.errors import UserError
from snooker_cli.files import cache_within, private_folder

if sys.platform != "win32":
    import fcntl

Function = TypeVar("Function", bound=Callable[..., Any])
Base = TypeVar("Base")

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    # No reference counts: kernels own no arrays, and would take 1.6 to 2 times as long with them.
    # Numba documents no option for this.
    "_nrt": False,
}
"""Options of every compiled function.

Without fast-math, + - * / and sqrt are rounded as IEEE 754 defines, neither re-ordered nor fused.
So the same source gives the same bits on every processor.
"""

HELPER_OPTIONS: dict[str, Any] = OPTIONS | {"no_cpython_wrapper": True}
"""Options of functions that Python does not call."""

UNUSABLE = (
    "the cache folder for compiled code cannot be used (%s), so %s; "
    "set NUMBA_CACHE_DIR to a folder that only you can write to"
)
DAMAGED = "stored compiled code in %s is damaged and is compiled again"

NUMBA_SETTINGS = ".numba_config.yaml"
"""Numba takes settings from this file of the current folder, whoever made it: also the folder of
its cache, and so code that it runs."""

NO_GATHERS = ",+prefer-no-gather,+prefer-no-scatter"
"""Features for LLVM: on several processors, loads one by one are four times as fast as a gather."""

_log = logging.getLogger(__name__)
"""Notices for the user; the command line shows them from level INFO on."""

_unknown: list[Callable[[Any], object]] = []
"""What makes Numba know functions that it does not know yet, called with ``numba.extending``."""


class Kernel:
    """A function that Python calls. Numba compiles it once for each combination of types."""

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.function = function

    def __call__(self, *arguments: Any) -> Any:
        try:
            return self.compiled(*arguments)
        except Exception as error:  # kernels raise nothing, but loading damaged code raises many
            folder = None if "numba" not in sys.modules else cache_folder()
            if folder is None or isinstance(error, sys.modules["numba"].errors.NumbaError):
                raise
            if isinstance(error, OSError):  # such as a full disk
                _warn(UNUSABLE, error.strerror or error, "every process compiles again")
                self.compiled = sys.modules["numba"].njit(**kernel_options())(self.function)
            else:
                _warn(DAMAGED, folder)
                for path in folder.rglob("*.nb[ci]"):
                    path.unlink(missing_ok=True)
                self.__dict__.pop("compiled", None)  # another thread may have been here
        return self.compiled(*arguments)

    @cached_property
    def compiled(self) -> Any:
        """Numba's dispatcher, or the plain function."""
        numba = learn_functions()
        if numba.config.DISABLE_JIT:
            return np.errstate(all="ignore")(self.function)  # without warnings of 0 * inf
        folder, users = cache_folder(), numba.config.CACHE_DIR
        try:
            numba.config.CACHE_DIR = str(folder or users)
            return numba.njit(cache=folder is not None, **kernel_options())(self.function)
        finally:
            numba.config.CACHE_DIR = users


def code_of(kernel: Any, *arguments: Any) -> tuple[str, str]:
    """What Numba makes of a kernel for such arguments: code for LLVM, and its function's name.

    It is compiled anew, because the cache of kernels has none.
    """
    kernel.compiled  # noqa: B018  # makes Numba know all functions
    dispatcher = set_up_numba().njit(**helper_options())(kernel.function)
    signature = tuple(map(set_up_numba().typeof, arguments))
    dispatcher.compile(signature)
    compiled = dispatcher.overloads[signature]
    return compiled.library.get_llvm_str(), compiled.fndesc.llvm_func_name


def kernel_options() -> dict[str, Any]:
    """Options of functions that Python calls."""
    compilers = linked_helpers.compilers()
    return OPTIONS | ({} if compilers is None else {"pipeline_class": compilers.kernel})


def helper_options(*, inline: bool = False) -> dict[str, Any]:
    """Options of functions that are only linked into kernels."""
    compilers = linked_helpers.compilers()
    special = {} if compilers is None else {"pipeline_class": compilers.helper}
    return HELPER_OPTIONS | special | ({"forceinline": True} if inline else {})


def learn_functions() -> Any:
    """Make Numba, which this gives, know all functions that kernels may call."""
    numba = set_up_numba()
    with _setting_up:
        while _unknown:
            _unknown.pop()(numba.extending)
    return numba


def kernel(function: Function) -> Function:
    """Compile a function that Python or another kernel calls."""
    return cast("Function", Kernel(function))


def inlined(function: Function) -> Function:
    """Compile a function into its callers; for Python, it stays a Python function."""
    _unknown.append(lambda numba: numba.register_jitable(**helper_options(inline=True))(function))
    return function


def helper(function: Function) -> Function:
    """Compile a function that kernels call, and not often; for Python, it stays as it is."""
    _unknown.append(lambda numba: numba.register_jitable(**helper_options())(function))
    return function


def called_by_kernels(base: type[Base]) -> type[Base]:
    """Let kernels call the methods of a class of which ``NamedTuple`` classes inherit, as Python.

    The class of the tuple decides, while a kernel is compiled. So it has no code for what its scene
    lacks. A method that the base class lacks is for Python only. Each tuple needs a field, because
    Numba loses an empty one.
    """
    names = [name for name, method in vars(base).items() if isinstance(method, FunctionType)]

    def learn(numba: Any) -> None:
        for name in names:
            _let_call(numba, base, name)

    _unknown.append(learn)
    return base


def _let_call(numba: Any, base: type, name: str) -> None:
    """Compile calls of a method of a base class into that of the tuple's own class."""

    @wraps(getattr(base, name))  # Numba takes the arguments from there
    def compiled(part: Any, *_others: Any) -> Any:
        its_class = part.instance_class
        return getattr(its_class, name) if issubclass(its_class, base) else None

    tuples = set_up_numba().types.BaseNamedTuple
    options = helper_options(inline=True)
    numba.overload_method(tuples, name, jit_options=options, strict=False)(compiled)


def instruction(function: Function) -> Function:
    """Compile calls into an instruction of the processor; for Python, it stays as it is."""
    name = function.__name__

    def learn(numba: Any) -> None:
        compiled = _instructions()[name]
        options = helper_options(inline=True)
        numba.overload(function, jit_options=options, strict=False)(compiled)

    _unknown.append(learn)
    return function


@cache
def cache_folder() -> Path | None:
    """The folder for kernels of these sources; Numba runs any code that it finds there.

    If it cannot be used, it is a private one in the temporary folder, or ``None``, with a warning.
    """
    here = Path(__file__).parent
    digest = hashlib.sha256(version("numba").encode())
    others = (here.with_name(name) for name in ("laws.py", "trace.py"))
    for source in (*sorted(here.glob("*.py")), *others):
        for part in parts_of_code(source.read_text("utf-8")):
            digest.update(part.encode())
    name, chosen = f"engine-{digest.hexdigest()[:16]}", os.environ.get("NUMBA_CACHE_DIR")
    try:
        return cache_within(chosen, name)
    except OSError as error:
        reason = error.strerror or str(error)
    owner = "user" if sys.platform == "win32" else os.geteuid()
    try:
        folder = private_folder(Path(gettempdir(), f"snooker-{owner}"), name, shared=False)
        _log.warning(UNUSABLE, reason, f"{folder} is used instead")
        return folder
    except OSError:
        _log.warning(UNUSABLE, reason, "every process compiles again")
        return None


def parts_of_code(source: str) -> Iterator[str]:
    """What a source does, as texts: without docstrings, comments and places of lines.

    Kernels depend on no more, so a changed sentence compiles nothing anew.
    """
    codes = [compile(source, "", "exec", dont_inherit=True, optimize=2)]
    for code in codes:
        yield repr((code.co_code, code.co_names, code.co_varnames, code.co_freevars))
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                codes.append(constant)
            else:  # sets have no order
                yield repr(
                    sorted(map(repr, constant)) if isinstance(constant, frozenset) else constant
                )


def check_current_folder() -> None:
    """Raise ``UserError`` in a folder with settings for Numba."""
    if Path(NUMBA_SETTINGS).is_file():
        raise UserError(
            f"{Path.cwd()}: contains {NUMBA_SETTINGS}, which can make Numba run any code",
            "use another folder, or delete that file and set Numba's environment variables",
        )


@cache
def _warn(text: str, *values: object) -> None:
    """Warn of something, once in a process."""
    _log.warning(text, *values)


def set_up_numba() -> Any:
    """Import Numba, which takes half a second, and set it up once. Raises ``UserError``."""
    with _setting_up:  # two listeners would wait for each other's lock
        return _set_up_numba()


_setting_up = threading.RLock()


@cache
def _set_up_numba() -> Any:
    """What ``set_up_numba`` does.

    Numba reads settings of the processor when it compiles the first function of a process.
    """
    check_current_folder()
    import numba
    from llvmlite import binding
    from numba import types
    from numba.core import event
    from numba.extending import typeof_impl

    on_x86 = platform.machine() in {"x86_64", "AMD64"} and binding.llvm_version_info >= (17,)
    if on_x86 and not any(name.startswith("NUMBA_CPU_") for name in os.environ):
        numba.config.CPU_FEATURES = binding.get_host_cpu_features().flatten() + NO_GATHERS

    class Listener(event.Listener):  # type: ignore[misc]  # Numba has no types
        """Counts compiled functions, and locks the cache while Numba saves a kernel.

        Numba could otherwise save kernels of two processes under one name, and load the wrong one.
        """

        lock: IO[bytes] | None = None

        def on_start(self, event: Any) -> None:
            """A compilation begins, perhaps inside another one."""
            if event.kind == "numba:compile":
                COMPILATION.begin_function(
                    event.data["dispatcher"].py_func.__name__, cache_folder()
                )

        def on_end(self, event: Any) -> None:
            """A compilation ends, and Numba saves the result; or Numba has saved it."""
            if event.kind != "numba:compile":
                if self.lock is not None:
                    self.lock.close()
                    self.lock = None
                return
            COMPILATION.end_function()
            folder = cache_folder()
            if folder is not None and self.lock is None and sys.platform != "win32":
                with suppress(OSError):  # some file systems have no locks
                    self.lock = (folder / "lock").open("wb")
                    fcntl.flock(self.lock, fcntl.LOCK_EX)

    listener = Listener()
    event.register("numba:compile", listener)
    event.register("numba:compiler_lock", listener)

    @typeof_impl.register(Kernel)
    def type_of(kernel: Kernel, _context: Any) -> Any:
        return types.Dispatcher(kernel.compiled)

    return numba


@cache
def _instructions() -> dict[str, Callable[..., Any]]:
    """What Numba compiles calls of each ``instruction`` into."""
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def fused_instruction(_typing: Any, a: Any, b: Any, c: Any) -> Any:
        number = types.float64
        return number(number, number, number), lambda _, builder, __, numbers: builder.fma(*numbers)

    @intrinsic
    def next_below_instruction(_typing: Any, value: Any) -> Any:
        def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            bits = builder.bitcast(arguments[0], ir.IntType(64))
            return builder.bitcast(builder.sub(bits, ir.IntType(64)(1)), ir.DoubleType())

        return types.float64(types.float64), generate

    @intrinsic
    def lowest_bit_instruction(_typing: Any, mask: Any) -> Any:
        number, no_matter_at_0 = types.int64, ir.Constant(ir.IntType(1), 1)
        return number(number), lambda _, builder, __, masks: builder.cttz(*masks, no_matter_at_0)

    @intrinsic
    def fetch_instruction(_typing: Any, array: Any, place: Any) -> Any:
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

    return {
        "fused": lambda a, b, c: lambda a, b, c: fused_instruction(a, b, c),
        "next_below": lambda value: lambda value: next_below_instruction(value),
        "lowest_bit": lambda mask: lambda mask: lowest_bit_instruction(mask),
        "fetch": lambda array, place: lambda array, place: fetch_instruction(array, place),
    }
