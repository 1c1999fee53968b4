"""Plain YAML scalars by the YAML 1.2 core schema: which are numbers, truth values or null."""

import math
import re

from snooker_cli.config.paths import shown

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_TRUE = frozenset({"true", "True", "TRUE"})
_FALSE = frozenset({"false", "False", "FALSE"})
_INTEGER = re.compile(r"[-+]?[0-9]+")
_OCTAL = re.compile(r"0o[0-7]+")
_HEXADECIMAL = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = frozenset({".nan", ".NaN", ".NAN"})

MAX_DIGITS = 400
"""Longest integer read: the largest double has 309 digits."""


def resolved(text: str) -> bool | int | float | str | None:
    """The value of an unquoted scalar.

    Raises ValueError with one sentence when a number is too large to be represented.
    https://yaml.org/spec/1.2.2/#103-core-schema, table 10.3
    """
    if text in _NULL:
        return None
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if text in _NAN:
        return math.nan
    if _INFINITY.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    for pattern, base in ((_INTEGER, 10), (_OCTAL, 8), (_HEXADECIMAL, 16)):
        if pattern.fullmatch(text):
            return _integer(text, base)
    if _FLOAT.fullmatch(text):
        return _finite(text)
    return text


def is_number(text: str) -> bool:
    """Whether an unquoted scalar would be read as a number, infinity and NaN included."""
    try:
        value = resolved(text)
    except ValueError:
        return True
    return isinstance(value, int | float) and not isinstance(value, bool)


def _integer(text: str, base: int) -> int:
    if len(text) > MAX_DIGITS:
        raise _too_large(text)
    value = int(text, base)
    try:
        float(value)
    except OverflowError:
        raise _too_large(text) from None
    return value


def _finite(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise _too_large(text)
    return value


def _too_large(text: str) -> ValueError:
    return ValueError(
        f"the number {shown(text)} is too large; give one below 1.8e308, or .inf where infinity is "
        "allowed"
    )
