"""Which points and repeats of a run are meant: by values of keys, numbers and conditions."""

import difflib
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

from snooker_cli.config import Point
from snooker_cli.config.points import single_values
from snooker_cli.config.problems import PathError
from snooker_cli.errors import ArgumentError, FigureError, KeyAbsentError
from snooker_cli.formatting import listed, value_text
from snooker_cli.options import WHERE, Wording
from snooker_cli.runs.run import RUN, RepeatState, RepeatStatus, RunFolder, point_and_repeats

FEWEST_DIGITS = 3  # of a value that may stand for one with more

COMPARED = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
COMPARED["="] = operator.ge  # of the lower end of a range


@dataclass(frozen=True)
class Selection:
    """The points and repeats to show.

    where : keys of the config and the value that a point must have there; a tuple is a choice
    repeat : a repeat's number, from 0; ``None`` for all, or the first in a figure of one repeat
    times : of the states in a figure of states, s; none for the end
    colour : what the colours of balls show, of ``snapshot.COLOURS``; ``None`` for the gas's own
    """

    where: Mapping[str, Any] = field(default_factory=dict)
    repeat: int | None = None
    times: tuple[float, ...] = ()
    colour: str | None = None


def file_stem(name: str, selection: Selection) -> str:
    """The name of a file without its ending: a figure's name and what is selected."""
    parts = []
    for key, value in selection.where.items():
        values = value if isinstance(value, tuple) else (value,)
        parts += [
            *([key] if key != RUN else []),
            *map(value_text, values),
        ]
    if selection.repeat is not None:
        parts += ["repeat", str(selection.repeat)]
    parts += ["time", *(f"{time:.6g}" for time in selection.times)] if selection.times else []
    parts += [selection.colour] if selection.colour else []
    return name + "".join("-" + re.sub(r"[^A-Za-z0-9._-]", "_", part) for part in parts)


def with_runs(where: Mapping[str, Any], points: Sequence[Point]) -> dict[str, Any]:
    """Conditions as a file's name has them: of runs side by side, their names too."""
    if RUN not in dict(points[0].parameters):
        return dict(where)
    return {RUN: tuple(distinct(points, RUN)), **where}


def selected(run: RunFolder, selection: Selection) -> tuple[Point, ...]:
    """The selected points that have a repeat, at least one. Raises ``FigureError``."""
    return _some(run, selection, lambda point: bool(statuses(run, point, selection)))


def _some(
    run: RunFolder, selection: Selection, is_there: Callable[[Point], bool]
) -> tuple[Point, ...]:
    """The selected points that something is true of, at least one. Raises ``FigureError``."""
    points = tuple(filter(is_there, matching(run, selection)))
    if not points:
        what = "no repeat is" if selection.repeat is None else f"repeat {selection.repeat} is not"
        raise FigureError(f"{run.name}: {what} there yet; run the config again")
    return points


def begun(run: RunFolder, selection: Selection) -> tuple[Point, ...]:
    """`selected` by the names of files alone, which are not opened. Raises ``FigureError``."""

    def is_there(point: Point) -> bool:
        files = run.batches(point.index)
        return (
            bool(files)
            if selection.repeat is None
            else any(selection.repeat in point_and_repeats(file)[1] for file in files)
        )

    return _some(run, selection, is_there)


def matching(run: RunFolder, selection: Selection) -> tuple[Point, ...]:
    """The points that are selected, simulated or not, at least one. Raises ``FigureError``."""
    repeats = max(run.requested(point) for point in run.points)
    if selection.repeat is not None and not 0 <= selection.repeat < repeats:
        raise FigureError(
            f"there is no repeat {selection.repeat}: {run.name} has repeats 0 to {repeats - 1}"
        )
    points = run.points
    for key, wanted in selection.where.items():
        # A list of coordinates is itself a tuple, and may be the one value that is wanted.
        values = (wanted, *wanted) if isinstance(wanted, tuple) else (wanted,)
        known = distinct(points, key)
        values = tuple(_known_value(value, known) for value in values)
        chosen = tuple(point for point in points if value_at(point, key) in values)
        if not chosen:
            present = listed([value_text(value) for value in known])
            raise FigureError(f"{run.name}: no point has {key} = {wanted}: there it is {present}")
        points = chosen
    return points


def _known_value(wanted: Any, known: Sequence[Any]) -> Any:
    """A wanted value, or the only one of the known numbers that rounds to its three or more digits.

    With fewer digits, 0.8 would stand for 0.75.
    """
    if wanted in known or not isinstance(wanted, float) or not math.isfinite(wanted):
        return wanted
    digits = len(Decimal(repr(wanted)).normalize().as_tuple().digits)
    if digits < FEWEST_DIGITS:
        return wanted
    rounded = [n for n in known if isinstance(n, float) and float(f"{n:.{digits}g}") == wanted]
    return rounded[0] if len(rounded) == 1 else wanted


def value_at(point: Point, key: str) -> Any:
    """A point's value of a key such as ``balls.radius``. Raises ``KeyAbsentError``."""
    parameters = dict(point.parameters)
    if key in parameters:
        return parameters[key]
    value: Any = point.config
    for name in key.split("."):
        if name not in getattr(type(value), "model_fields", ()):
            keys = [*parameters, *single_values(point.config)]
            longer = [swept for swept in parameters if swept.endswith(f".{key}")]
            meant = longer or difflib.get_close_matches(key, keys, n=1)
            advice = f"did you mean {meant[0]}?" if meant else "name one that its config has"
            raise KeyAbsentError(key, keys, advice)
        value = getattr(value, name)
    return value


def distinct(points: Sequence[Point], key: str) -> list[Any]:
    """The values of a key over points, each once, in order."""
    return list(dict.fromkeys(value_at(point, key) for point in points))


def varying(points: Sequence[Point]) -> list[str]:
    """The swept keys that have more than one value over the points."""
    return [key for key, _ in points[0].parameters if len(distinct(points, key)) > 1]


def statuses(run: RunFolder, point: Point, selection: Selection) -> list[RepeatStatus]:
    """The selected repeats of a point that have a file; all of them if none is chosen."""
    return [
        status
        for status in run.statuses(point.index)
        if selection.repeat in (None, status.repeat) and status.state is not RepeatState.MISSING
    ]


def chosen_values(run: RunFolder, conditions: Sequence[str]) -> dict[str, Any]:
    """Conditions such as ``cor>0.8`` as a value of each key, or a tuple of several of the run's.

    Keys are those of the config, so that they are no other arguments of the methods of ``Run``.
    """
    values_of_key: dict[str, Any] = {}
    for text in conditions:
        where = str(Wording(f"{WHERE.name} {text}", f"where({text!r})"))
        match = re.fullmatch(r"\s*([^<>=\s]+)\s*([<>]=?|=)\s*(.*\S)\s*", text)
        if not match:
            raise ArgumentError(f"{where}: give KEY=VALUE, as in cor=0.8, cor=0.7:0.9, cor>0.8")
        key, sign, value = match.groups()
        value_at(run.points[0], key)  # raises for a key that the experiment does not have
        try:
            if sign == "=" and value.count(":") != 1:
                from snooker_cli.config.reading import option_values  # loads what reads YAML

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


def unfinished(run: RunFolder, selection: Selection) -> str:
    """How many of the requested repeats an unfinished run has; empty for a finished one."""
    points = matching(run, selection)
    single = selection.repeat is not None
    wanted = sum(1 if single else run.requested(point) for point in points)
    numbers = [len(statuses(run, point, selection)) for point in points]
    there, begun = sum(numbers), len(points) - numbers.count(0)
    if there == wanted:
        return ""
    of_points = f", of {begun} of {len(points)} points" if begun < len(points) else ""
    return f"the run is unfinished: {there} of {wanted} repeats are there{of_points}"


def unlisted(run: RunFolder) -> str:
    """How many of the points in a run's folder its sweep lists; empty if it lists all of them."""
    listed = len(run.points)
    if not run.unlisted:
        return ""
    return f"the sweep lists {listed} of the {listed + run.unlisted} points that are stored"
