"""Imports between parts of the package, and uses of libraries."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from snooker_cli.containers import SHAPES
from snooker_cli.laws import LAWS

PACKAGE = Path(__file__).parents[1] / "snooker_cli"
MODULES = sorted(PACKAGE.rglob("*.py"))

# A part is a module or a folder of the package. It may import the parts named beside it, which
# come earlier in the table. So data flows in one direction and there are no circles.
SIMULATING = (
    "containers",
    "errors",
    "fields",
    "files",
    "laws",
    "lazy_names",
    "ranges",
    "plugins",
    "results_cache",
    "neighbours",
    "scene",
    "trace",
)
RUNNING = (
    *(
        "config",
        "engine",
        "facts",
        "formatting",
        "options",
        "placement",
        "runs",
        "signals",
        "store",
    ),
    *("theory", "two_temperatures", *SIMULATING),
)
PARTS: dict[str, tuple[str, ...]] = {
    # Nothing of ours below
    "files": (),
    "formatting": (),
    "lazy_names": (),
    "neighbours": (),
    "signals": (),
    "fields": (),
    "options": (),
    "errors": ("formatting", "options", "signals"),
    "plugins": ("errors", "options"),
    "results_cache": ("errors", "files"),
    "region_integrals": ("neighbours",),
    "containers": ("errors", "neighbours", "region_integrals"),
    "ranges": ("containers",),
    "laws": ("plugins", "ranges"),
    # A scene and its trace
    "config": ("containers", "errors", "formatting", "laws", "lazy_names", "options", "ranges"),
    "scene": ("containers", "errors", "fields", "laws", "neighbours"),
    "theory": ("containers", "laws", "scene"),
    "facts": ("config", "containers", "laws", "scene", "theory"),
    "trace": ("fields", "scene"),
    "two_temperatures": (),
    # From a config to stored repeats
    "placement": ("config", "containers", "errors", "fields", "laws", "neighbours", "scene"),
    "engine": ("containers", "errors", "fields", "files", "laws", "lazy_names", "scene", "trace"),
    "store": ("containers", "errors", "fields", "files", "laws", "lazy_names", "scene", "trace"),
    "runs": tuple(part for part in RUNNING if part != "runs"),
    "export": ("engine", "errors", "fields", "files", "plugins", "scene", "store", "trace"),
    # From repeats to conclusions
    "analysis": RUNNING,
    "figures": (*RUNNING, "analysis"),
    "extending": (*RUNNING, "analysis", "export", "figures"),
    # Pages
    "pages": (),
    "live_page": (
        *("analysis", "config", "containers", "engine", "errors", "facts", "fields", "laws"),
        *("options", "pages", "placement", "scene", "theory"),
    ),
    "animation": (
        *(
            *SIMULATING,
            "analysis",
            "engine",
            "figures",
            "formatting",
            "live_page",
            "options",
            "pages",
        ),
    ),
    "validation": (*RUNNING, "analysis", "figures"),
}
# These may import all parts above them.
PARTS["report"] = tuple(part for part in PARTS if part not in ("engine", "export", "store"))
PARTS["api"] = tuple(PARTS)
# It has what notebooks have, figures, theory, and the means to write pages; a dotted name allows
# this module of a part alone.
PARTS["reproduction"] = (
    *("api", "errors", "figures", "files", "formatting", "report.document", "theory"),
    "runs.selection",
    *("validation.accuracy_study", "validation.physics_study"),  # figures of saved measurements
)
PARTS["__init__"] = ("api", "config", "containers", "errors", "lazy_names", "scene", "trace")
# A command reads options, calls the API and prints. `reproduce` and `bench` have their own parts.
PARTS["cli"] = (
    *("api", "errors", "formatting", "options", "report.document", "reproduction", "signals"),
    *("validation", "config.template_configs", "export", "runs.progress"),
)
PARTS["__main__"] = ("cli",)

LIBRARIES: dict[str, tuple[str, ...]] = {
    "typer": ("cli",),
    "rich": ("runs.progress",),
    "pydantic": (
        "config",
        "laws",
        "live_page.javascript",
        "ranges",
        "runs.manifest",
        "store.reader",
    ),
    "pydantic_core": ("config", "ranges"),
    "yaml": ("config", "figures", "live_page", "report", "reproduction", "validation"),
    "numba": ("engine.jit", "engine.linked_helpers"),
    "llvmlite": ("engine.jit", "engine.webassembly"),
    "h5py": ("export", "store"),
    "pyarrow": ("export",),
    "distributed": ("runs.dask_executor",),
    "flint": ("validation",),
    "scipy": (
        "analysis.fitting",
        "analysis.goodness",
        "analysis.stationarity",
        "analysis.structure",
        "theory",
        "two_temperatures",
        "validation.physics_study",
    ),
    "matplotlib": ("animation.movie", "api", "figures"),
    "PIL": ("animation.movie", "figures"),
    "jinja2": ("report.document",),
    "typst": ("report.document",),
    "numpy": tuple(part for part in PARTS if part != "config"),
}
"""The parts or modules that may import a library. Other libraries may not be imported."""


def part_of(module: str) -> str:
    """The part that a module belongs to, from its dotted name without the package's."""
    return module.partition(".")[0]


def dotted(path: Path) -> str:
    """``engine.simulation`` for engine/simulation.py, ``engine`` for engine/__init__.py."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


TREES = {dotted(path): ast.parse(path.read_text(encoding="utf-8")) for path in MODULES}
"""The source of each module by its dotted name."""


def imported(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and dotted name of each import, also inside functions and for type checkers."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name
        elif isinstance(node, ast.ImportFrom):
            origin = "." * node.level + (node.module or "")
            for name in node.names:
                if origin == "snooker_cli":
                    yield node.lineno, f"{origin}.{name.name if name.name in PARTS else '__init__'}"
                else:
                    is_module = f"{origin}.{name.name}".removeprefix("snooker_cli.") in TREES
                    yield node.lineno, f"{origin}.{name.name}" if is_module else origin


def violations(module: str, tree: ast.AST) -> list[str]:
    """A sentence for each import of a module that the tables do not allow."""
    part = part_of(module)
    if part not in PARTS:
        return [f"{module}: the part {part} is not in the table"]
    found = []
    for line, name in imported(tree):
        where = f"{module}, line {line}"
        origin, _, rest = name.partition(".")
        if origin == "snooker_cli":
            other = part_of(rest) or "__init__"
            if other == part and rest == part and module != part:
                found.append(f"{where}: import from the file, not from the own package {part}")
            elif not {other, rest} & {part, "__init__", *PARTS[part]}:
                found.append(f"{where}: {part} may not import {other}")
        elif origin not in sys.stdlib_module_names:
            homes = LIBRARIES.get(origin, ())
            if module not in homes and part not in homes:
                found.append(
                    f"{where}: {origin} may be imported in {', '.join(homes) or 'no part'}"
                )
    return found


def compares_a_shape(node: ast.AST) -> bool:
    """Whether code compares something with the word of a shape, alone or in a tuple."""
    return isinstance(node, ast.Compare) and any(
        isinstance(word, ast.Constant) and word.value in SHAPES
        for side in (node.left, *node.comparators)
        for word in ast.walk(side)
    )


def writes_in_place(node: ast.AST) -> bool:
    """Whether code writes a whole file under a name that readers use."""
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
        return False
    names = {"write_text": node.func.value, "write_bytes": node.func.value}
    name = (names | {"savefig": node.args[0] if node.args else node}).get(node.func.attr)
    return name is not None and not re.search("part|scratch", ast.unparse(name))


def places(is_wrong: Callable[[ast.AST], bool]) -> list[str]:
    """Where the package has code of some sort."""
    return [
        f"{name}, line {node.lineno}"
        for name, tree in TREES.items()
        for node in ast.walk(tree)
        if is_wrong(node)
    ]


def test_modules_import_what_the_tables_allow() -> None:
    found = [sentence for name, tree in TREES.items() for sentence in violations(name, tree)]
    assert not found, "\n".join(found)


def test_only_the_classes_of_containers_know_shapes_by_their_word() -> None:
    assert not places(compares_a_shape), "ask the container's class instead"


def test_files_are_written_under_a_temporary_name() -> None:
    """So that a full disk or an interrupt leaves the older file."""
    assert not places(writes_in_place), "use files.atomic_write or files.write_text"


def test_only_the_engine_has_kernels() -> None:
    """Elsewhere arrays are enough, and nothing is compiled."""
    users = {
        name for name, tree in TREES.items() for _, origin in imported(tree) if "jit" in origin
    }
    # `runs` asks for the folder of compiled code; `validation` has methods to compare with.
    assert {part_of(name) for name in users} == {"engine", "runs", "validation"}


def test_no_file_name_occurs_twice() -> None:
    names = [path.name for path in MODULES if path.name != "__init__.py"]
    assert sorted(names) == sorted(set(names))


def test_a_part_imports_only_parts_above_it() -> None:
    order = list(PARTS)
    for part, others in PARTS.items():
        for other in others:
            assert order.index(part_of(other)) < order.index(part), f"{part} comes before {other}"


COMPUTING = (
    *("analysis.diffusion", "analysis.gas", "analysis.measurement", "analysis.observables"),
    *("analysis.profiles", "analysis.time_series", "analysis.velocity_correlations"),
    *("figures.snapshot", "runs.warm_up"),  # they draw walls by their laws, and copy states
)
"""They add up other columns for some laws and shapes, which is no question of theory."""

QUESTIONS = "adds_energy", "equal_balls", "has_wall", "keeps_drift", "keeps_rotation", "rubs_wall"
"""Fields of a scene and of its parts that facts know."""


def asks_what_a_gas_is(node: ast.AST) -> bool:
    """Whether code asks for balls, walls or collisions: ``law.adds_energy`` …"""
    if isinstance(node, ast.Attribute):
        return node.attr in QUESTIONS
    if isinstance(node, ast.Compare):
        is_none = isinstance(node.ops[0], ast.Is | ast.IsNot)
        text = ast.unparse(node.left)
        return text.endswith(".surface") if is_none else text.endswith((".cor", ".restitution"))
    called = isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
    return called and {*re.findall(r"\w+", ast.unparse(node))} & LAW_CLASSES != set()


LAW_CLASSES = {law.__name__ for law in LAWS.values()} | {"Surface"}


def test_analyses_figures_and_reports_ask_facts_what_a_gas_is() -> None:
    parts = "runs", "analysis", "figures", "report", "reproduction", "api", "cli"
    asking = [place for place in places(asks_what_a_gas_is) if place.startswith(parts)]
    assert [place for place in asking if place.partition(",")[0] not in COMPUTING] == []


@pytest.mark.parametrize(
    "source",
    [
        "scene.equal_balls",
        "scene.container.has_wall and f()",
        "wall_law.adds_energy",
        "scene.surface is None",
        "experiment.cor < 1",
        "isinstance(law, Thermal | Driven)",
    ],
)
def test_a_question_that_facts_know_is_found(source: str) -> None:
    assert any(map(asks_what_a_gas_is, ast.walk(ast.parse(source))))


def test_the_table_has_all_parts_and_no_other() -> None:
    assert {*map(part_of, TREES)} == set(PARTS)


@pytest.mark.parametrize(
    ("module", "source", "sentence"),
    [
        ("engine.contact", "import h5py", "h5py may be imported in export, store"),
        ("scene", "def f():\n    import snooker_cli.cli.output", "scene may not import cli"),
        ("store.reader", "from snooker_cli.store import read", "import from the file"),
        ("cli", "import click", "click may be imported in no part"),
        ("reproduction", "from snooker_cli.report import run_report", "may not import report"),
    ],
)
def test_a_forbidden_import_is_found(module: str, source: str, sentence: str) -> None:
    (found,) = violations(module, ast.parse(source))
    assert sentence in found
