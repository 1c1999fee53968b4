"""Evenly spaced values in a few characters: ``range(1, 6)`` and ``0.5:1.0:11``, both ends in."""

import re
from decimal import Context, Decimal

from snooker_cli.config.paths import PathError
from snooker_cli.config.scalars import resolved

MAX_POINTS = 100_000
"""Points of a sweep, and so values of a key. More take minutes to try and gigabytes to hold."""

_RANGE = re.compile(r"\s*range\s*\((.*)\)\s*", re.DOTALL)
_SPACED = re.compile(r"\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*:\s*([-+.0-9eE]+)\s*")
_INTEGER = re.compile(r"\s*[-+]?[0-9]{1,18}\s*")

_DECIMAL = Context(prec=60)
"""Enough digits that rounding to the nearest double is the only rounding that shows."""


def values_of(text: str) -> list[int] | list[float] | None:
    """The values that a text stands for; none if it is no range. Raises PathError."""
    if match := _RANGE.fullmatch(text):
        return _range(match[1])
    if match := _SPACED.fullmatch(text):
        return _spaced(match[1], match[2], match[3])
    return None


def _range(arguments: str) -> list[int]:
    """The integers of Python's range(arguments)."""
    numbers = arguments.split(",")
    if len(numbers) > 3 or not all(_INTEGER.fullmatch(number) for number in numbers):
        raise PathError("range needs one to three whole numbers: range(start, stop, step)")
    limits = [int(number) for number in numbers]
    if len(limits) == 3 and limits[2] == 0:
        raise PathError("the step of a range cannot be 0; choose another")
    values = range(*limits)
    # len() of a range longer than a machine word raises.
    if not values:
        raise PathError("this range is empty; it stops before its second limit, as in Python")
    if (count := (values[-1] - values[0]) // values.step + 1) > MAX_POINTS:
        raise _too_many(count)
    return list(values)


def _spaced(start: str, stop: str, count: str) -> list[float]:
    """`count` evenly spaced numbers from start to stop, each the double nearest to its decimal."""
    usage = "start:stop:count needs two numbers and a whole count of 2 or more, such as 0.5:1.0:11"
    try:
        ends = [resolved(start), resolved(stop)]
    except ValueError as error:
        raise PathError(str(error)) from None
    if not all(isinstance(end, int | float) for end in ends) or not _INTEGER.fullmatch(count):
        raise PathError(usage)
    number = int(count)
    if number < 2:
        raise PathError(usage)
    if number > MAX_POINTS:
        raise _too_many(number)
    # repr of a double is the shortest decimal that means it: 0.1 here is exactly one tenth.
    first, last = (Decimal(repr(float(end))) for end in ends if isinstance(end, int | float))
    width = _DECIMAL.subtract(last, first)
    return [
        float(_DECIMAL.add(first, _DECIMAL.divide(_DECIMAL.multiply(width, step), number - 1)))
        for step in map(Decimal, range(number))
    ]


def _too_many(count: int) -> PathError:
    return PathError(f"these are {count:,} values, of at most {MAX_POINTS:,}; take fewer")
