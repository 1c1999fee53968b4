"""Helper functions that get no machine code of their own: a quarter less to wait for a new kernel.

Numba optimises each helper function and turns it into machine code, though only the kernels into
which it is linked ever run. Here its code for LLVM stays as it is, for the kernel to be optimised
as a whole. Results are the same.

This uses internals of Numba: a compiler and a library of code, as versions from ``OLDEST`` to
``NEWEST`` have them. With another version, or if one of them looks different, there is no such
compiler, and helpers are compiled in Numba's way.
"""

import inspect
from functools import cache
from typing import Any

OLDEST, NEWEST = (0, 61), (0, 68)
"""Versions of Numba of which this has been tested."""

ARGUMENTS = ["self", "typingctx", "targetctx", "library", "args", "return_type", "flags", "locals"]
"""Those of Numba's compiler."""

INTERNALS = (
    *("_codegen", "_final_module", "_finalized", "_linking_libraries", "_raise_if_finalized"),
    *("_finalize_dynamic_globals", "_get_module_for_linking", "_optimize_functions"),
    *("finalize", "get_llvm_str", "get_pointer_to_function", "_ensure_finalized"),
)
"""Names that a library of Numba has."""


@cache
def compiler() -> Any:
    """The class of a compiler for Numba's option ``pipeline_class``; ``None`` for another Numba."""
    import numba
    from numba.core import codegen, compiler

    if not OLDEST <= numba.version_info[:2] <= NEWEST:
        return None
    if list(inspect.signature(compiler.Compiler.__init__).parameters) != ARGUMENTS:
        return None
    classes = codegen.CodeLibrary, codegen.CPUCodeLibrary, codegen.JITCodeLibrary
    source = "".join(map(inspect.getsource, classes))
    if not all(name in source for name in INTERNALS):
        return None

    class HelperLibrary(codegen.CPUCodeLibrary):  # type: ignore[misc]  # Numba has no types
        """Code for LLVM of a function, and of those that it calls."""

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout

        def finalize(self) -> None:
            """Link what it calls, as Numba does, but make nothing that can run."""
            self._raise_if_finalized()
            for library in dict.fromkeys(self._linking_libraries):
                if hasattr(library, "_reload_init"):  # since version 0.62
                    self._reload_init.update(library._reload_init)
                self._final_module.link_in(library._get_module_for_linking(), preserve=True)
            self._finalize_dynamic_globals()
            self._finalized = True

        def get_llvm_str(self) -> str:
            """The code with all that it calls."""
            self._ensure_finalized()
            return str(super().get_llvm_str())

        def get_pointer_to_function(self, name: str) -> int:
            """No address: only kernels call helpers."""
            return 0

        @property
        def codegen(self) -> "HelperLibrary":
            return self

        def set_env(self, name: str, environment: object) -> None:
            """What is not in memory needs no environment; ``codegen.set_env`` writes one there."""

    class HelperCompiler(compiler.Compiler):  # type: ignore[misc]
        def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
            own = library or HelperLibrary(target.codegen(), "helper")
            super().__init__(typing, target, own, *others)

    return HelperCompiler
