"""Deliberate faults, each of which some tests must find: ``python tests/faults.py [WORD …]``.

Each entry of ``tests/data/faults.yaml`` changes one place of the package in a copy of the project:

fault : what is wrong then
in : the place by names: the part of the package, then class, function, variable that is assigned
change : what is changed there, see ``Change``; the number after ``#`` is that of its occurrence
tests : files, without their long tests, or single tests; they must fail

The command tries the faults that contain one of the words, or all. It ends with 1 if a fault is
not found.
"""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from subprocess import PIPE

import yaml

ROOT = Path(__file__).parents[1]
FAULTS: list[dict[str, str]] = yaml.safe_load(
    (ROOT / "tests" / "data" / "faults.yaml").read_text(encoding="utf-8")
)
PASSED, FAILED = 0, 1  # exit codes of pytest

OPERATORS = {"+": ast.Add, "-": ast.Sub, "*": ast.Mult, "/": ast.Div}
OPERATORS |= {"<": ast.Lt, "<=": ast.LtE, ">": ast.Gt, ">=": ast.GtE}


class Change(ast.NodeTransformer):
    """Changes one place of a syntax tree.

    OLD to NEW : an operator, or the value of an expression, is another one
    never NAME, always NAME : a condition with this name is false or true; of conditions that are
        joined by ``and`` or ``or``, only the one with the name
    without NAME : a function is not called; the first argument is used instead of its value
    returns VALUE : a function only returns this
    """

    def __init__(self, change: str) -> None:
        pattern = r"(?:(never|always|without|returns) (.+?)|(.+) to (.+?))(?: #(\d+))?"
        parts = re.fullmatch(pattern, change)
        assert parts is not None, f"there is no such change: {change}"
        self.verb, self.name, self.old, self.new, occurrence = parts.groups()
        self.left = int(occurrence or 1)
        self.conditions: list[ast.expr] = []

    def visit(self, node: ast.AST) -> ast.AST:
        """The node, or the one that replaces it."""
        if self.verb in ("never", "always"):
            self.conditions += conditions_of(node)
        new = self.replacement(node)
        if new is not None:
            self.left -= 1
            if self.left == 0:
                return new
        return self.generic_visit(node)

    def replacement(self, node: ast.AST) -> ast.AST | None:
        """The node that replaces one, if the change is about it."""
        match self.verb:
            case "returns" if isinstance(node, ast.FunctionDef):
                node.body = ast.parse(f"return {self.name}").body
                return node
            case "never" | "always" if node in self.conditions and self.name in names_in(node):
                return ast.Constant(self.verb == "always")
            case "without" if isinstance(node, ast.Call) and names_in(node.func)[:1] == [self.name]:
                return node.args[0] if node.args else ast.Constant(None)
            case None if self.old in OPERATORS:
                return OPERATORS[self.new]() if isinstance(node, OPERATORS[self.old]) else None
            case None if isinstance(node, ast.expr) and ast.unparse(node) == self.old:
                is_target = isinstance(getattr(node, "ctx", None), ast.Store)
                return None if is_target else ast.parse(self.new, mode="eval").body
        return None


def conditions_of(node: ast.AST) -> list[ast.expr]:
    """The conditions that a statement or an expression has."""
    found = [*getattr(node, "ifs", []), *([node.test] if hasattr(node, "test") else [])]
    found += node.values if isinstance(node, ast.BoolOp) else []
    return [condition for condition in found if not isinstance(condition, ast.BoolOp)]


def names_in(node: ast.AST) -> list[str]:
    """The names of variables and attributes; of a function, first its own."""
    named = [inner for inner in ast.walk(node) if isinstance(inner, (ast.Name, ast.Attribute))]
    return [inner.id if isinstance(inner, ast.Name) else inner.attr for inner in named]


def with_name(name: str, outer: ast.AST) -> Iterator[ast.AST]:
    """The definitions of a name in a module or class, or the statements that assign it."""
    for node in ast.walk(outer) if isinstance(outer, ast.FunctionDef) else outer.body:
        match node:
            case ast.FunctionDef(name=found) | ast.ClassDef(name=found) if found == name:
                yield node
            case ast.Assign(targets=[target]) | ast.AnnAssign(target=target):
                if name in names_in(target):
                    yield node


def with_fault(fault: dict[str, str]) -> tuple[Path, str]:
    """The file of the package that has a fault's place, and its text with the fault."""
    part, *names = fault["in"].split(".")
    folder = ROOT / "snooker_cli" / part
    found = []
    for path in sorted(folder.glob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        places: list[ast.AST] = [tree]
        for name in names:
            places = [inner for place in places for inner in with_name(name, place)]
        found += [(path, tree, place) for place in places[:1]]
    assert len(found) == 1, f"{fault['in']} is in {len(found)} files"
    path, tree, place = found[0]
    before, change = ast.unparse(tree), Change(fault["change"])
    change.visit(place)
    after = ast.unparse(ast.fix_missing_locations(tree))
    assert after != before, f"{fault['in']} has no place for: {fault['change']}"
    return path, after


def copy_project(copy: Path) -> None:
    """Copy the files that git knows."""
    names = subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).splitlines()
    for name in names:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name)


def is_found(fault: dict[str, str], copy: Path) -> bool:
    """Whether the fault's tests fail while the fault is in the copy."""
    original, text = with_fault(fault)
    source = copy / original.relative_to(ROOT)
    source.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    command += [*fault["tests"].split(), *([] if "::" in fault["tests"] else ["-m", "not long"])]
    environment = os.environ | {"PYTHONPATH": str(copy)}
    if fault["in"].startswith(("engine", "laws")):  # kernels are compiled for this fault only
        environment["NUMBA_CACHE_DIR"] = str(copy.with_name("cache"))
    try:
        done = subprocess.run(
            command, cwd=copy, env=environment, stdout=PIPE, text=True, timeout=900, check=False
        )
        if done.returncode > FAILED:  # below zero, the fault has crashed the tests
            raise SystemExit(f"{fault['fault']}: the tests could not run\n{done.stdout}")
        return done.returncode != PASSED
    except subprocess.TimeoutExpired:
        return True
    finally:
        shutil.copy(original, source)


def main(words: list[str]) -> int:
    """Try the faults with these words, or all; 1 if the tests miss one."""
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        copy_project(copy)
        for fault in FAULTS:
            if not words or any(word in str(fault) for word in words):
                found = is_found(fault, copy)
                missed += not found
                print("found " if found else "MISSED", fault["fault"], flush=True)
    print(f"{missed} missed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
