"""The house's plan: which room may import which, and where each library lives."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "snooker_cli"
MODULES = sorted(PACKAGE.rglob("*.py"))

MOST_LINES = 400

# A room is a module or a folder of the package. It may import the rooms named beside it; those
# stand above it in the table, so that data walks one way and there are no circles.
DATA = ("config", "results", "scene", "store", "trace")
ROOMS: dict[str, tuple[str, ...]] = {
    "__init__": (),
    # What needs nothing of ours
    "config": (),
    "fit": (),
    "neighbours": (),
    "scene": ("neighbours",),
    "theory": (),
    "words": (),
    # Simulating
    "trace": ("scene",),
    "engine": ("scene", "trace"),
    "arrange": ("config", "neighbours", "scene"),
    # Storing
    "store": ("scene", "trace"),
    "results": ("config", "engine", "store", "trace"),
    "runner": ("arrange", "config", "engine", "results", "scene", "store", "trace"),
    # Understanding
    "observables": ("engine", "scene", "trace"),
    "kinetic": ("observables", "scene", "theory"),
    "decay": ("fit", "observables", "theory", "trace", "words"),
    "compare": ("decay", "kinetic", "observables", "scene", "theory", "trace", "words"),
    # Showing
    "gallery": (*DATA, "compare", "decay", "fit", "kinetic", "observables", "theory", "words"),
    "animation": ("engine", "observables", "scene", "trace"),
    "export": ("engine", "store", "trace"),
    "figures": ("animation", "gallery", "words"),
    # Measuring
    "bench": (
        *("arrange", "config", "engine", "gallery", "kinetic", "observables", "scene", "store"),
        *("theory", "trace", "words"),
    ),
}
# These two see everything below them.
ROOMS["report"] = tuple(ROOMS)
ROOMS["cli"] = tuple(ROOMS)
ROOMS["__main__"] = ("cli",)

HOMES: dict[str, tuple[str, ...]] = {
    "typer": ("cli",),
    "rich": ("cli",),
    "pydantic": ("config",),
    "pydantic_core": ("config",),
    "yaml": ("config",),
    "numba": ("engine.jit",),
    "llvmlite": ("engine.jit",),
    "h5py": ("store",),
    "pyarrow": ("export",),
    "distributed": ("runner",),
    "mpmath": ("bench",),
    "scipy": ("fit", "theory"),
    "matplotlib": ("figures",),
    "PIL": ("figures",),
    "jinja2": ("report",),
    "typst": ("report",),
    "numpy": tuple(room for room in ROOMS if room != "config"),
}
"""The only rooms, or modules, in which a library may be imported; one that is not here, nowhere."""


def room_of(module: str) -> str:
    """The room of a module of the package, from its dotted name without the package's."""
    return module.partition(".")[0]


def dotted(path: Path) -> str:
    """``engine.simulate`` for engine/simulate.py, ``engine`` for engine/__init__.py."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


def imported(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and dotted name of all that is imported, in functions and for type checkers too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name
        elif isinstance(node, ast.ImportFrom):
            origin = "." * node.level + (node.module or "")
            if origin != "snooker_cli":
                yield node.lineno, origin
                continue
            for name in node.names:
                is_room = name.name in ROOMS or name.name in {
                    room_of(dotted(path)) for path in MODULES
                }
                yield node.lineno, f"snooker_cli.{name.name if is_room else '__init__'}"


def violations(module: str, source: str) -> list[str]:
    """A sentence for each import of a module that the plan does not foresee."""
    room = room_of(module)
    if room not in ROOMS:
        return [f"{module}: the room {room} is not in the plan; add it with what it may import"]
    found = []
    for line, name in imported(ast.parse(source)):
        where = f"{module}, line {line}"
        origin, _, rest = name.partition(".")
        if origin == "":
            found.append(f"{where}: {name} is a relative import; write the module's whole name")
        elif origin == "snooker_cli":
            other = room_of(rest) or "__init__"
            if other not in ROOMS:
                found.append(f"{where}: the room {other} is not in the plan")
            # The package itself holds its version alone, which everybody may tell.
            elif other not in (room, "__init__", *ROOMS[room]):
                allowed = ", ".join(ROOMS[room]) or "none of our rooms"
                found.append(f"{where}: {room} imports {other}, but may import {allowed} only")
        elif origin in sys.stdlib_module_names:
            continue
        elif origin not in HOMES:
            found.append(f"{where}: {origin} is a library without a home in the plan")
        elif not {room, module} & set(HOMES[origin]):
            homes = " and ".join(HOMES[origin])
            found.append(f"{where}: {room} imports {origin}, which belongs to {homes}")
    return found


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_a_module_imports_what_the_plan_allows(path: Path) -> None:
    found = violations(dotted(path), path.read_text(encoding="utf-8"))
    assert not found, "\n".join(found)


@pytest.mark.parametrize("path", MODULES, ids=dotted)
def test_a_module_is_short_and_says_what_it_is_for(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    assert len(source.splitlines()) <= MOST_LINES
    docstring = ast.get_docstring(ast.parse(source), clean=False)
    assert docstring is not None
    assert docstring.splitlines()[0].strip()


def test_every_folder_of_modules_is_a_package() -> None:
    for folder in {path.parent for path in MODULES}:
        assert (folder / "__init__.py").exists(), folder


def test_the_plan_has_no_circles() -> None:
    """Every room stands below all that it imports."""
    order = list(ROOMS)
    for room, others in ROOMS.items():
        for other in others:
            assert order.index(other) < order.index(room), f"{room} stands above {other}"


def test_the_plan_has_no_room_that_is_not_there() -> None:
    there = {room_of(dotted(path)) for path in MODULES}
    assert there == set(ROOMS)


@pytest.mark.parametrize(
    ("module", "source", "sentence"),
    [
        ("engine.contact", "import h5py", "engine imports h5py, which belongs to store"),
        ("engine", "from snooker_cli.store import read", "engine imports store, but may import"),
        (
            "theory.gas",
            "from snooker_cli import scene",
            "theory imports scene, but may import none",
        ),
        ("scene", "def f():\n    import snooker_cli.cli.output", "line 2: scene imports cli"),
        ("fit", "if TYPE_CHECKING:\n    from snooker_cli.trace import Trace", "fit imports trace"),
        ("figures.draw", "from snooker_cli.results import Run", "figures imports results"),
        ("gallery", "from matplotlib import pyplot", "gallery imports matplotlib"),
        ("engine.collide", "import numba", "imports numba, which belongs to engine.jit"),
        ("cli", "import click", "click is a library without a home"),
        ("decay", "from . import fit", "is a relative import"),
        ("decay", "from ..decay import fit", "is a relative import"),
        ("cellar", "import math", "the room cellar is not in the plan"),
        ("decay", "from snooker_cli.cellar import wine", "the room cellar is not in the plan"),
    ],
)
def test_what_the_plan_forbids_is_found(module: str, source: str, sentence: str) -> None:
    (found,) = violations(module, source)
    assert sentence in found


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("store", "from snooker_cli import __version__"),
        ("runner", "from snooker_cli import store"),
        ("engine.jit", "import numba\nfrom snooker_cli.engine.layout import X"),
        ("cli.running", "import typer\nfrom snooker_cli.runner import execute"),
        ("arrange", "import math, decimal\nimport numpy as np"),
    ],
)
def test_what_the_plan_allows_is_let_pass(module: str, source: str) -> None:
    assert violations(module, source) == []
