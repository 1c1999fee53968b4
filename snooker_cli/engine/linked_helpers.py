"""Helper functions that get no machine code of their own: a third less to wait for a new kernel.

Numba optimises each helper function and turns it into machine code, though only the kernels into
which it is linked ever run. Here its code for LLVM stays as it is, for the kernel to be optimised
as a whole, and once: Numba does so twice, for reference counts, which kernels do not have. Results
are the same.

This uses internals of Numba: a compiler and a library of code, as versions from ``OLDEST`` to
``NEWEST`` have them. With another version, or if one of them looks different, there are no such
compilers, and all is compiled in Numba's way.
"""

import inspect
from functools import cache
from typing import Any, NamedTuple

OLDEST, NEWEST = (0, 61), (0, 68)
"""Versions of Numba of which this has been tested."""

ARGUMENTS = ["self", "typingctx", "targetctx", "library", "args", "return_type", "flags", "locals"]
"""Those of Numba's compiler."""

INTERNALS = (
    *("_codegen", "_final_module", "_finalized", "_linking_libraries", "_raise_if_finalized"),
    *("_finalize_dynamic_globals", "_get_module_for_linking", "_optimize_functions"),
    *("_optimize_final_module", "_module_pass_manager", "_shared_module"),
    *("finalize", "get_llvm_str", "get_pointer_to_function", "_ensure_finalized"),
)
"""Names that a library of Numba has."""


class Compilers(NamedTuple):
    """Classes for Numba's option ``pipeline_class``."""

    helper: Any
    kernel: Any


@cache
def compilers() -> Compilers | None:
    """The compilers of helpers and of kernels; ``None`` for another Numba."""
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
        """Code for LLVM of a function alone, and the libraries of the functions that it calls.

        Only for a kernel all are linked, so that no code is copied once for each of its callers.
        """

        _alone: Any = None

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout

        def finalize(self) -> None:
            """Make nothing that can run."""
            self._raise_if_finalized()
            for library in self._linking_libraries:
                if hasattr(library, "_reload_init"):  # since version 0.62
                    self._reload_init.update(library._reload_init)
            self._finalize_dynamic_globals()
            self._finalized = True

        def linked(self, module: Any) -> Any:
            """A module with this function, and all that it calls, directly or not.

            A caller is linked before what it calls, because LLVM leaves out what nothing calls yet.
            """
            known, left = {self}, [*reversed(self._linking_libraries)]
            while left:
                library = left.pop()
                if library not in known:
                    known.add(library)
                    if isinstance(library, HelperLibrary):
                        module.link_in(library.alone(), preserve=True)
                        left.extend(reversed(library._linking_libraries))
                    else:
                        module.link_in(library._get_module_for_linking(), preserve=True)
            return module

        def alone(self) -> Any:
            """This function for linking into others."""
            if self._alone is None:
                self._ensure_finalized()
                self._alone = super()._get_module_for_linking()
                self._shared_module = None
            return self._alone

        def _get_module_for_linking(self) -> Any:
            if self._shared_module is None:
                self._shared_module = self.linked(self.alone().clone())
            return self._shared_module

        def get_llvm_str(self) -> str:
            """The code with all that it calls."""
            self._ensure_finalized()
            return str(self.linked(self._final_module.clone()))

        def get_pointer_to_function(self, name: str) -> int:
            """No address: only kernels call helpers."""
            return 0

        @property
        def codegen(self) -> "HelperLibrary":
            return self

        def set_env(self, name: str, environment: object) -> None:
            """What is not in memory needs no environment; ``codegen.set_env`` writes one there."""

    class KernelLibrary(codegen.JITCodeLibrary):  # type: ignore[misc]
        """A kernel, with all that it calls."""

        def _optimize_final_module(self) -> None:
            manager = self._codegen._module_pass_manager()
            # Newer versions of Numba give a builder of passes with it.
            passes, *builder = manager if isinstance(manager, tuple) else (manager,)
            passes.run(self._final_module, *builder)

    class HelperCompiler(compiler.Compiler):  # type: ignore[misc]
        def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
            own = library or HelperLibrary(target.codegen(), "helper")
            super().__init__(typing, target, own, *others)

    class KernelCompiler(compiler.Compiler):  # type: ignore[misc]
        def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
            if library is None:
                library = KernelLibrary(target.codegen(), "kernel")
                library.enable_object_caching()
            super().__init__(typing, target, library, *others)

    return Compilers(HelperCompiler, KernelCompiler)
