"""Python's formulas as JavaScript: a page computes with the same ones, and needs no second text.

A formula is a function of assignments, conditions and a result. It computes with numbers, fields
and other formulas. Names become those of JavaScript: ``wall_cor`` is ``wallCor``.
"""

import ast
import inspect
import json
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import is_dataclass, replace
from functools import lru_cache
from itertools import count
from math import inf
from pathlib import Path
from string import ascii_lowercase
from types import ModuleType
from typing import Any

import numpy as np
from pydantic.dataclasses import is_pydantic_dataclass

OPERATORS: dict[type[ast.AST], tuple[str, int]] = {
    ast.Or: ("||", 1),
    ast.And: ("&&", 2),
    ast.Eq: ("===", 3),
    ast.NotEq: ("!==", 3),
    ast.Is: ("==", 3),  # of None, which is also what JavaScript calls undefined
    ast.IsNot: ("!=", 3),
    ast.Lt: ("<", 4),
    ast.LtE: ("<=", 4),
    ast.Gt: (">", 4),
    ast.GtE: (">=", 4),
    ast.Add: (" + ", 5),
    ast.Sub: (" - ", 5),
    ast.Mult: ("*", 6),
    ast.Div: ("/", 6),
    ast.Not: ("!", 7),
    ast.USub: ("-", 7),
    ast.Pow: ("**", 8),
}
"""Each in JavaScript, and how strongly it binds."""

STRONGEST = 9

FUNCTIONS = {
    **{f"math.{name}": f"Math.{name}" for name in ("sqrt", "exp", "log", "log1p", "expm1")},
    **{f"np.{name}": f"Math.{name}" for name in ("sqrt", "exp", "log1p", "expm1")},
    "np.maximum": "Math.max",
    "np.minimum": "Math.min",
    "min": "Math.min",
    "max": "Math.max",
    "math.lgamma": "lgamma",
    "polyval": "polyval",
    "sum": "sum",  # of theory.js and scene.js
    "float": "",
    "np.asarray": "",
}
"""What JavaScript or a script of the page has."""


def camel(name: str) -> str:
    """``wallCor`` for wall_cor."""
    first, *others = name.strip("_").split("_")
    return first + "".join(map(str.capitalize, others))


class Formulas:
    """Functions in JavaScript, with all functions, records and constants that they need."""

    def __init__(self) -> None:
        self._names: dict[Any, str] = {}
        self._texts: dict[str, str] = {}

    @property
    def text(self) -> str:
        """The declarations."""
        return "".join(f"{text}\n" for text in self._texts.values())

    def name_of(self, thing: Any, name: str = "") -> str:
        """The name of a function or a record, which is declared with all that it needs.

        name : that it should have, if another one has its own

        Raises ValueError for what JavaScript does not have.
        """
        remembered = hasattr(thing, "cache_info")
        thing = inspect.unwrap(thing)
        if thing not in self._names:
            module = thing.__module__.rpartition(".")[2]
            names = camel(thing.__name__), name, camel(f"{module}_{thing.__name__}")
            name = next(name for name in names if name.isidentifier() and name not in self._texts)
            self._names[thing], self._texts[name] = name, ""
            is_record = isinstance(thing, type)
            text = self._record(thing) if is_record else self._function(thing, name)
            self._texts[name] = f"const {name} = remembered({text});" if remembered else text
        return self._names[thing]

    def _constant(self, name: str, value: Any) -> str:
        """A number, or the name of several."""
        if isinstance(value, int | float):
            return "Infinity" if value == inf else json.dumps(value)
        if isinstance(value, str):
            return json.dumps(value, ensure_ascii=False)
        text = f"const {name} = {json.dumps(np.asarray(value).tolist())};"
        if self._texts.setdefault(name, text) != text:
            raise ValueError(f"two modules have a constant {name}: give one another name")
        return name

    def _record(self, record: type) -> str:
        """A class with the fields of a NamedTuple or of a dataclass, and its methods."""
        fields = [*inspect.signature(record).parameters]
        names = ", ".join(map(camel, fields))
        lines = [f"  constructor({names}) {{ Object.assign(this, {{ {names} }}); }}"]
        for name, method in vars(record).items():
            if inspect.isfunction(method) and not name.startswith("_"):
                lines.append("  " + self._function(method, camel(name)).removeprefix("function "))
        body = "\n".join(lines)
        return f"class {camel(record.__name__)} {{\n{body}\n}}"

    def _function(self, function: Callable[..., Any], name: str) -> str:
        """A function or a method as a declaration."""
        node = _definition(function)
        body = [ast.Return(node.body)] if isinstance(node, ast.Lambda) else node.body
        local = dict.fromkeys(name for part in (node.args, *body) for name in _names_in(part))
        short = dict(zip(local, _short_names(), strict=False))
        return _Scope(self, function, short).declared(name, node.args, body)

    def resolved(self, name: str, value: Any) -> str:
        """A name of a module, by its value."""
        is_formula = inspect.isfunction(inspect.unwrap(value)) or _is_record(value)
        return self.name_of(value) if is_formula else self._constant(name, value)


class _Scope:
    """The names that a function knows; those of its own are short, because pages are mailed."""

    def __init__(
        self, formulas: Formulas, function: Callable[..., Any], local: dict[str, str]
    ) -> None:
        self.formulas, self.local = formulas, local
        self.globals: dict[str, Any] = inspect.unwrap(function).__globals__

    def declared(self, name: str, args: ast.arguments, body: Sequence[ast.stmt]) -> str:
        """A function with its body on one line."""
        given = [self.local[arg.arg] for arg in args.args if arg.arg != "self"]
        for place, default in enumerate(reversed(args.defaults), 1):
            given[-place] += f" = {self.expression(default)}"
        inside = "".join(map(self._statement, body))
        return f"function {name}({', '.join(given)}) {{ {inside} }}"

    def _statement(self, node: ast.stmt) -> str:
        match node:
            case ast.Expr(ast.Constant()) | ast.Assert():  # a docstring; what types know
                return ""
            case ast.Return(value) if value is not None:
                return f"return {self.expression(value)};"
            case ast.Assign([target], value) | ast.AnnAssign(target, _, value) if value is not None:
                return f"const {self.expression(target)} = {self.expression(value)};"
            case ast.If(test, [ast.Raise()], []):
                return f"if ({self.expression(test)}) throw new RangeError();"
            case ast.If(test, body, []):
                inside = "".join(map(self._statement, body))
                return f"if ({self.expression(test)}) {{ {inside} }}"
            case ast.FunctionDef(name, args, body):
                return self.declared(self.local[name], args, body)
        raise _unknown(node)

    def expression(self, node: ast.expr) -> str:
        """An expression in JavaScript. Raises ValueError for one that pages do not have."""
        match node:
            case ast.BoolOp(op, values):
                sign, strength = OPERATORS[type(op)]
                return sign.join(self._inside(value, strength) for value in values)
            case ast.UnaryOp(op, operand) if type(op) in OPERATORS:
                sign, strength = OPERATORS[type(op)]
                return sign + self._inside(operand, strength)
            case ast.BinOp(left, ast.FloorDiv(), right):
                return f"Math.floor({self._inside(left, 6)}/{self._inside(right, 7)})"
            case ast.BinOp(left, op, right) | ast.Compare(left, [op], [right]):
                if type(op) in OPERATORS:
                    sign, strength = OPERATORS[type(op)]
                    first = self._inside(left, strength + isinstance(op, ast.Pow))
                    return f"{first}{sign}{self._inside(right, strength + 1)}"
            case ast.IfExp(test, body, other):
                parts = (self._inside(part, 1) for part in (test, body, other))
                return "{} ? {} : {}".format(*parts)
            case ast.Tuple(elements):
                return f"[{', '.join(map(self.expression, elements))}]"
            case ast.Starred(value):
                return f"...{self.expression(value)}"
            case ast.Subscript(value, ast.Constant(int(place))):
                return f"{self._inside(value, STRONGEST)}[{place}]"
            case ast.Constant(None):
                return "null"
            case ast.Constant(value):
                return json.dumps(value)
            case ast.Call():
                return self._call(node)
            case ast.Name("self"):
                return "this"
            case ast.Name(name) if name in self.local:
                return self.local[name]
            case ast.Name() | ast.Attribute():
                return self._named(node)
        raise _unknown(node)

    def _inside(self, node: ast.expr, strength: int) -> str:
        """An expression as a part of one that binds so strongly, else in parentheses."""
        text = self.expression(node)
        return text if _strength(node) >= strength else f"({text})"

    def _named(self, node: ast.Name | ast.Attribute) -> str:
        """A name of the module, or of an imported one; or the field of a value."""
        if isinstance(node, ast.Name):
            return self.formulas.resolved(node.id, self._value(node))
        if isinstance(self._value(node.value), ModuleType):
            return self.formulas.resolved(node.attr, self._value(node))
        return f"{self._inside(node.value, STRONGEST)}.{camel(node.attr)}"

    def _value(self, node: ast.expr) -> Any:
        """What a name of the module has as its value; ``None`` for others."""
        if isinstance(node, ast.Attribute):
            owner = self._value(node.value)
            return getattr(owner, node.attr) if isinstance(owner, ModuleType) else None
        if not isinstance(node, ast.Name) or node.id in self.local:
            return None
        if node.id not in self.globals:
            raise _unknown(node)
        return self.globals[node.id]

    def _call(self, node: ast.Call) -> str:
        known = FUNCTIONS.get(ast.unparse(node.func))
        if known is not None and not node.keywords:
            computed = ", ".join(map(self.expression, node.args))
            return f"{known}({computed})" if known else computed
        called = self._value(node.func)
        if called is replace:  # a record with some other fields
            changed = [f"{camel(w.arg or '')}: {self.expression(w.value)}" for w in node.keywords]
            record = self.expression(node.args[0])
            return f"Object.assign(Object.create({record}), {{ {', '.join(changed)} }})"
        if is_pydantic_dataclass(called):
            return self._literal(called, node.args)
        args = ", ".join(map(self.expression, [*node.args, *_by_place(node, called)]))
        text = f"{self.expression(node.func)}({args})"
        return f"new {text}" if _is_record(called) else text

    def _literal(self, record: type, values: Sequence[ast.expr]) -> str:
        """A record of files as JSON has it: with its name, if it has one."""
        texts = {"name": json.dumps(record.name)} if hasattr(record, "name") else {}
        keys = inspect.signature(record).parameters
        texts |= zip(keys, map(self.expression, values), strict=True)
        return f"{{ {', '.join(f'{key}: {text}' for key, text in texts.items())} }}"


def _strength(node: ast.expr) -> int:
    """How strongly an expression binds in JavaScript."""
    match node:
        case ast.BoolOp(op) | ast.UnaryOp(op) | ast.BinOp(_, op) | ast.Compare(_, [op]):
            return OPERATORS.get(type(op), ("", STRONGEST))[1]
        case ast.Call(func, [only]) if FUNCTIONS.get(ast.unparse(func)) == "":
            return _strength(only)
        case ast.IfExp():
            return 0
    return STRONGEST


def _by_place(call: ast.Call, called: Any) -> list[ast.expr]:
    """Arguments with keywords in the order of the function that is called."""
    given = {word.arg: word.value for word in call.keywords}
    if not given:
        return []
    parameters = [*inspect.signature(called).parameters] if callable(called) else []
    names = parameters[len(call.args) :][: len(given)]
    if given.keys() != {*names}:
        raise _unknown(call)
    return [given[name] for name in names]


def _is_record(value: Any) -> bool:
    """Whether a value is a class of records: a NamedTuple or a dataclass."""
    return isinstance(value, type) and (is_dataclass(value) or hasattr(value, "_fields"))


def _definition(function: Callable[..., Any]) -> ast.FunctionDef | ast.Lambda:
    """The definition of a function; a lambda is the only one on its line."""
    if function.__name__ != "<lambda>":
        (node,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        assert isinstance(node, ast.FunctionDef)
        return node
    line, tree = function.__code__.co_firstlineno, _tree(inspect.getsourcefile(function) or "")
    (found,) = (
        node for node in ast.walk(tree) if isinstance(node, ast.Lambda) and node.lineno == line
    )
    return found


@lru_cache
def _tree(path: str) -> ast.Module:
    return ast.parse(Path(path).read_text(encoding="utf-8"))


def _short_names() -> Iterator[str]:
    """a, b … z, a1, b1 …"""
    return (f"{letter}{turn or ''}" for turn in count() for letter in ascii_lowercase)


def _names_in(tree: ast.AST) -> Iterator[str]:
    """The names of arguments, assignments and inner functions."""
    for node in ast.walk(tree):
        match node:
            case ast.arg(name) | ast.Name(name, ast.Store()) | ast.FunctionDef(name):
                yield name


def _unknown(node: ast.AST) -> ValueError:
    return ValueError(f"a formula has no {ast.unparse(node)!r}: pages have it in JavaScript too")
