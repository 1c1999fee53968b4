"""The facts of a gas and the needs of theories, as a script of a page.

A page changes its scene without Python. So it has the functions of ``facts.py`` in JavaScript. It
also has the needs of each theory that it draws, from the table of theories.
"""

import ast
import inspect
import json
import textwrap
from collections.abc import Iterable
from math import inf
from typing import Any

from snooker_cli import facts
from snooker_cli.analysis import quantities, theories
from snooker_cli.theory import FINITE

DRAWN = {
    "ratio": (quantities.RATIO, FINITE),
    "alpha": (quantities.HAFF_RATE, FINITE),
    "speeds": (quantities.KURTOSIS, theories.FIXED),
}
"""The theories that a page draws, by the names that the page uses."""

REFERENCES = {"wall": ("warm_walls", "one_wall_temperature", "smooth")}
"""What a page draws to compare with: the energy that elastic balls would have from the wall. A gas
that collisions cool is colder, and spins of rough balls take a part."""

TYPE_FACTS = "elastic", "warm_walls", "cooling"
"""Facts that a page asks for other reasons."""

OPERATORS: dict[type[ast.AST], str] = {
    ast.And: "&&",
    ast.Or: "||",
    ast.Eq: "===",
    ast.NotEq: "!==",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}


def needs() -> dict[str, list[str]]:
    """What each of these theories and references needs."""
    of_theories = {
        name: next(
            entry.needs for entry in theories.THEORIES if (entry.quantity, entry.model) == about
        )
        for name, about in DRAWN.items()
    }
    return {name: list(needed) for name, needed in (of_theories | REFERENCES).items()}


def facts_source() -> str:
    """The script: ``FACTS`` by their names, and ``NEEDS``."""
    names = {*TYPE_FACTS, *(name for needed in needs().values() for name in needed)}
    functions = _with_called(sorted(names))
    lines = [f"  {name}: (gas) => {text}," for name, text in functions.items()]
    body = "\n".join(lines)
    return f"const FACTS = {{\n{body}\n}};\nconst NEEDS = {json.dumps(needs())};\n"


def asked_traits() -> list[str]:
    """The traits that these facts ask for, in the spelling of JavaScript."""
    source = facts_source()
    return [name for name in map(camel, facts.Traits._fields) if f"gas.{name}" in source]


def camel(name: str) -> str:
    """``wallCor`` for wall_cor."""
    first, *others = name.split("_")
    return first + "".join(map(str.capitalize, others))


def _with_called(names: Iterable[str]) -> dict[str, str]:
    """Facts as expressions, with the facts that they call."""
    done: dict[str, str] = {}
    todo = list(names)
    while todo:
        name = todo.pop()
        if name in done:
            continue
        function: Any = facts.FACTS[name].holds
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        assert isinstance(body, ast.FunctionDef)
        (answer,) = body.body
        assert isinstance(answer, ast.Return)
        assert answer.value is not None
        done[name] = _expression(answer.value, function.__globals__)
        calls = (node.func for node in ast.walk(answer.value) if isinstance(node, ast.Call))
        todo += [call.id for call in calls if isinstance(call, ast.Name)]
    return dict(sorted(done.items()))


def _expression(node: ast.expr, known: dict[str, Any]) -> str:
    """An expression of a fact in JavaScript. Raises ValueError for any other.

    known : the values of names
    """
    match node:
        case ast.BoolOp(op, values):
            parts = [_expression(value, known) for value in values]
            return f"({f' {OPERATORS[type(op)]} '.join(parts)})"
        case ast.UnaryOp(ast.Not(), operand):
            return f"!({_expression(operand, known)})"
        case ast.Compare(left, [op], [right]) if type(op) in OPERATORS:
            sides = _expression(left, known), _expression(right, known)
            return f"{sides[0]} {OPERATORS[type(op)]} {sides[1]}"
        case ast.Attribute(ast.Name("gas"), name):
            return f"gas.{camel(name)}"
        case ast.Call(ast.Name(name), [ast.Name("gas")]) if name in facts.FACTS:
            return f"FACTS.{name}(gas)"
        case ast.Constant(value):
            return json.dumps(value)
        case ast.Name(name) if isinstance(known.get(name), int | float):
            return "Infinity" if known[name] == inf else json.dumps(known[name])
    raise ValueError(f"a fact has no {ast.unparse(node)!r}: pages have it in JavaScript too")
