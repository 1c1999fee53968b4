"""Conditions for points, as texts such as ``cor>0.8``."""

import operator
import re
from collections.abc import Sequence
from typing import Any

from snooker_cli.config.axes import option_values
from snooker_cli.config.problems import PathError
from snooker_cli.errors import IN_COMMAND, ArgumentError
from snooker_cli.figures.selection import distinct, value_at
from snooker_cli.runs import Run

COMPARED = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
COMPARED["="] = operator.ge  # of the lower end of a range


def chosen_values(run: Run, conditions: Sequence[str]) -> dict[str, Any]:
    """What ``Run.where`` returns: a value of each key, or a tuple of several of the run's.

    Keys are those of the config, so that they are no other arguments of the methods of ``Run``.
    """
    values_of_key: dict[str, Any] = {}
    for text in conditions:
        where = f"--where {text}" if IN_COMMAND.get() else f"where({text!r})"
        match = re.fullmatch(r"\s*([^<>=\s]+)\s*([<>]=?|=)\s*(.*\S)\s*", text)
        if not match:
            raise ArgumentError(f"{where}: give KEY=VALUE, as in cor=0.8, cor=0.7:0.9, cor>0.8")
        key, sign, value = match.groups()
        value_at(run.points[0], key)  # raises for a key that the experiment does not have
        try:
            if sign == "=" and value.count(":") != 1:
                values = option_values(value, where)
            else:
                low, *high = map(float, value.split(":") if sign == "=" else [value])
                numbers = [n for n in distinct(run.points, key) if isinstance(n, int | float)]
                values = [
                    n for n in numbers if COMPARED[sign](n, low) and n <= min(high, default=n)
                ]
                values = values or [f"{sign}{value}".removeprefix("=")]  # which no point has
        except PathError as error:
            raise ArgumentError(f"{where}: {error}") from None
        except ValueError:
            raise ArgumentError(f"{where}: give numbers, as in cor=0.7:0.9 or cor>0.8") from None
        values_of_key[key] = tuple(values) if len(values) > 1 else values[0]
    return values_of_key
