"""Names of a package whose modules are loaded when the names are asked for.

Type checkers do not see them: a package imports them below ``if TYPE_CHECKING`` too.
"""

TYPE_CHECKING = False  # type checkers take it as true; typing takes 10 ms to load
if TYPE_CHECKING:
    from collections.abc import Callable


def lazy_names(package: str, names: dict[str, str]) -> "Callable[[str], object]":
    """The ``__getattr__`` of a package.

    names : those of each module of the package, with blanks between them
    """
    homes = {name: module for module, listed in names.items() for name in listed.split()}

    def found(name: str) -> object:
        if name in homes:
            from importlib import import_module  # here, so that `snooker` begins sooner

            return getattr(import_module(f"{package}.{homes[name]}"), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return found
