"""The engine in single precision: the same source, with every number of 32 bits instead of 64.

The engine's modules are read once more, under another name. On the way each literal, conversion,
returned number and array of theirs becomes a ``float32``, so that the kernel that looks at all
pairs has its state, its clocks and all of its arithmetic in 32 bits. Only what a number of balls
multiplies, how far ahead contacts are searched, goes through 64 on its way. Where the engine knows
a rounding as 2^-52, it is 2^-23.
"""

from __future__ import annotations

import ast
import importlib
import sys
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import find_spec, spec_from_file_location
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import types
    from collections.abc import Sequence

ENGINE, SINGLE = "snooker_cli.engine", "snooker_cli.bench.single_engine"

SHARED = ("machine_code", "patience")
"""Modules that both engines use as they are."""

DOUBLE_DIGITS, SINGLE_DIGITS = 52, 23
"""Binary digits behind the first."""

NEW_ARRAYS = ("array", "empty", "full", "zeros")
"""Functions of NumPy whose arrays are of doubles unless told."""


@cache
def single_engine() -> types.ModuleType:
    """The engine's package in single precision; it knows circles, with all pairs."""
    for name in SHARED:
        sys.modules[f"{SINGLE}.{name}"] = importlib.import_module(f"{ENGINE}.{name}")
    sys.meta_path.insert(0, _Finder())  # it stays, for what is imported when it is first needed
    with np.errstate(over="ignore", under="ignore"):  # some limits are infinite or zero here
        return importlib.import_module(SINGLE)


class _Finder(MetaPathFinder):
    """Finds a module of the engine in single precision where that of the engine is."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: types.ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where it is, for names of ours alone."""
        if name != SINGLE and not name.startswith(f"{SINGLE}."):
            return None
        origin = find_spec(name.replace(SINGLE, ENGINE, 1))
        assert origin is not None
        assert origin.origin is not None
        return spec_from_file_location(
            name,
            origin.origin,
            loader=_Loader(name, origin.origin),
            submodule_search_locations=origin.submodule_search_locations,
        )


class _Loader(SourceFileLoader):
    """Reads source in single precision."""

    def get_code(self, fullname: str) -> types.CodeType:
        """From the source: what Python keeps compiled of it is in double precision."""
        path = self.get_filename(fullname)
        tree = ast.fix_missing_locations(_Singly().visit(ast.parse(self.get_data(path))))
        code: types.CodeType = compile(tree, path, "exec", dont_inherit=True)
        return code


class _Singly(ast.NodeTransformer):
    """Source in double precision -> the same in single precision."""

    def visit_Module(self, node: ast.Module) -> ast.Module:
        """With the type at hand, after the docstring and the import from the future."""
        self.generic_visit(node)
        last = max(
            k
            for k, each in enumerate(node.body[:2])
            if k == 0 or (isinstance(each, ast.ImportFrom) and each.module == "__future__")
        )
        node.body.insert(last + 1, ast.parse("from numpy import float32").body[0])
        return node

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.ImportFrom:
        """From the engine in single precision."""
        if node.module is not None:
            node.module = node.module.replace(ENGINE, SINGLE, 1)
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        """A literal."""
        return _single(node) if isinstance(node.value, float) else node

    def visit_BinOp(self, node: ast.BinOp) -> ast.BinOp:
        """A rounding, 2.0**-52, is larger."""
        self.generic_visit(node)
        if isinstance(node.op, ast.Pow) and ast.unparse(node.right) == f"-{DOUBLE_DIGITS}":
            node.right = ast.UnaryOp(ast.USub(), ast.Constant(SINGLE_DIGITS))
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """A type's name, infinity, and the next number."""
        if node.attr == "float64":
            node.attr = "float32"
        elif ast.unparse(node) == "math.inf":
            return _single(node)
        elif ast.unparse(node) == "math.nextafter":
            return ast.parse("np.nextafter", mode="eval").body
        return node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        """A conversion, an exact number, and a new array."""
        self.generic_visit(node)
        called = ast.unparse(node.func)
        if called == "float":
            node.func = _type()
        elif called == "Fraction":  # takes a double only, which each of ours is
            node.args = [_call("float", each) for each in node.args]
        untyped = all(keyword.arg != "dtype" for keyword in node.keywords)
        if untyped and called in {f"np.{name}" for name in NEW_ARRAYS}:
            node.keywords.append(ast.keyword("dtype", _type()))
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        """What it returns: an integer times a 32-bit number is one of 64 bits."""
        self.generic_visit(node)
        if node.returns is not None and ast.unparse(node.returns) == "float":
            for each in ast.walk(node):
                if isinstance(each, ast.Return) and each.value is not None:
                    each.value = _single(each.value)
        return node


def _type() -> ast.Name:
    return ast.Name("float32", ast.Load())


def _single(node: ast.expr) -> ast.Call:
    """The conversion of an expression."""
    return _call("float32", node)


def _call(name: str, argument: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), [argument], [])
