"""Points as series of a figure: which of them, in which order and colours, and words for them."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeVar

from snooker_cli import facts
from snooker_cli.config import Point, unit_of
from snooker_cli.config.problems import key_path
from snooker_cli.containers import SHAPES
from snooker_cli.errors import FigureError
from snooker_cli.facts import GasType, gas_type, traits_of
from snooker_cli.formatting import listed, short
from snooker_cli.laws import SIDES
from snooker_cli.options import WHERE
from snooker_cli.ranges import Model
from snooker_cli.runs.run import RUN
from snooker_cli.runs.selection import distinct, value_at, varying
from snooker_cli.trace import even_choice

Item = TypeVar("Item")

MOST_DIFFERENCES = 2  # between runs side by side, that a legend names
MOST_KEYS = 2  # in which series of one figure differ
MOST_SERIES = 16  # a figure with more series than this is unreadable


def by_run(points: Sequence[Point]) -> list[list[Point]]:
    """The points of each of the runs side by side."""
    runs = distinct(points, RUN)
    return [[point for point in points if value_at(point, RUN) == run] for run in runs]


def of_label(points: Sequence[Point]) -> list[str]:
    """The keys that tell points apart in a legend.

    Of runs side by side that differ in many keys, these are the run and the keys that a run sweeps.
    """
    keys = varying(points)
    if RUN not in keys:
        return keys
    inside = {key for run in by_run(points) for key in varying(run)}
    between = [key for key in keys if key not in {RUN, *inside}]
    return [key for key in keys if key not in between[MOST_DIFFERENCES:]]


def evenly(points: Sequence[Point], most: int = MOST_SERIES) -> list[Point]:
    """Points of one figure; of too many an even choice along the first key.

    The other keys then have their middle value.
    """
    return spread(at_middle(points, varying(points)[1:]) if len(points) > most else points, most)


def as_series(points: Sequence[Point], most: int = MOST_SERIES) -> list[Point]:
    """`evenly` of points that differ in two keys at most, since colours show no third one."""
    keys = varying(points)
    return evenly(points if RUN in keys else at_middle(points, keys[MOST_KEYS:]), most)


def at_middle(points: Sequence[Point], keys: Sequence[str]) -> Sequence[Point]:
    """The points where these keys have the middle of their values.

    A key that changes with another one is left: its middle value would leave one point.
    """
    for key in reversed(keys):
        values = distinct(points, key)
        middle = [point for point in points if value_at(point, key) == values[len(values) // 2]]
        points = middle if len(middle) > 1 else points
    return points


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """At most this many items, from the first to the last at even distances."""
    return [items[row] for row in even_choice(len(items), most)]


def ranks(points: Sequence[Point]) -> tuple[float, ...]:
    """Ranks from 0 to 1 in the order of a key with a number of its own for each point, if any."""
    keys = varying(points)
    for key in keys if RUN not in keys else ():  # runs side by side have a colour each
        values = [value_at(point, key) for point in points]
        if len(set(values)) == len(values) and set(map(type, values)) <= {int, float}:
            return tuple(sorted(values).index(value) / (len(values) - 1) for value in values)
    return ()


def swept_numbers(points: Sequence[Point]) -> list[str]:
    """The swept keys whose values here are numbers, two or more of each."""
    return [
        key
        for key in varying(points)
        if all(isinstance(value, int | float) for value in distinct(points, key))
    ]


def swept_number(points: Sequence[Point]) -> str:
    """The first of `swept_numbers`. Raises ``FigureError``."""
    keys = swept_numbers(points)
    if not keys:
        raise FigureError("it needs points at two or more values of a number; sweep a key")
    return keys[0]


class TwoKeys(NamedTuple):
    """Series that differ in two keys: the hue and the shade of each, and the words for both.

    hues, shades : a number from 0, and a rank from 0 to 1, for each series
    hue_names : of each hue
    shade_names : of the shade of each series
    """

    hues: tuple[int, ...]
    shades: tuple[float, ...]
    hue_names: tuple[str, ...] = ()
    shade_names: tuple[str, ...] = ()


def two_keys(points: Sequence[Point]) -> TwoKeys | None:
    """Hues and shades of series that differ in two keys; of runs side by side a hue for each run.

    ``None`` if no key has several values for one value of the other. Runs whose points do not
    differ in one key have no names.
    """
    keys = varying(points)
    if RUN in keys:
        runs = by_run(points)
        if max(map(len, runs)) == 1:
            return None
        inside = {key for run in runs for key in varying(run)}
        names = (RUN, *inside) if len(inside) == 1 else ()
        return _two_keys(points, runs, names)
    if len(keys) != 2:
        return None
    hue, shade = sorted(keys, key=lambda key: len(distinct(points, key)))
    if len(points) == len(distinct(points, shade)):
        return None
    groups = [[p for p in points if value_at(p, hue) == value] for value in distinct(points, hue)]
    return _two_keys(points, groups, (hue, shade))


def _two_keys(
    points: Sequence[Point], groups: Sequence[Sequence[Point]], names: Sequence[str]
) -> TwoKeys:
    """A hue for each group, and shades in it; `names` are the keys of both, or none."""
    shade = {p.index: rank / max(len(g) - 1, 1) for g in groups for rank, p in enumerate(g)}
    hue = {point.index: number for number, group in enumerate(groups) for point in group}
    hues, shades = tuple(hue[p.index] for p in points), tuple(shade[p.index] for p in points)
    if not names:
        return TwoKeys(hues, shades)
    of_hue, of_shade = names
    values = distinct(points, of_shade)
    shades = tuple(values.index(value_at(p, of_shade)) / max(len(values) - 1, 1) for p in points)
    hue_names = tuple(described(group[0], of_hue) for group in groups)
    return TwoKeys(hues, shades, hue_names, tuple(described(p, of_shade) for p in points))


def changing_with(points: Sequence[Point], x: str) -> list[str]:
    """The keys that have one value for each value of another key, as those of ``sweep.zip``."""
    values = distinct(points, x)
    return [
        key
        for key in varying(points)
        if key not in (x, RUN)
        and all(
            len(distinct([p for p in points if value_at(p, x) == value], key)) == 1
            for value in values
        )
    ]


def along(
    points: Sequence[Point], xs: Sequence[str], by: str | None, *, together: bool = False
) -> list[list[Point]]:
    """Points in order of one of the keys ``xs``, a list for each value of the key ``by``.

    together : whether other keys may change with this key

    Runs side by side have lists of their own, if ``xs`` vary in a run. Other keys have their middle
    value. Raises ``FigureError`` if each of ``xs`` has one value only, or if others change with it.
    """
    keys, numbers = varying(points), swept_numbers(points)
    x = next((key for key in xs if key in numbers), None)
    if x is None:
        raise FigureError(
            f"it needs points at two or more values of {' or '.join(xs)}; sweep that key"
        )
    if RUN in keys:
        swept = [run for run in by_run(points) if x in varying(run)]
        if swept:
            return [group for run in swept for group in along(run, [x], by, together=together)]
        keys.remove(RUN)  # a value of x from each run
        if len(distinct(points, x)) < len(points):
            raise FigureError(f"it needs one value of {x} from each run; choose it with {WHERE}")
    points = at_middle(points, [key for key in keys if key not in (x, by)])
    keys = [key for key in varying(points) if key != RUN]
    linked = [key for key in changing_with(points, x) if key != by]
    if linked and not together:
        raise FigureError(
            f"{listed(linked)} {'change' if linked[1:] else 'changes'} with {x}, so that it does "
            f"not show {x} alone; run a sweep of {x} alone"
        )
    if others := [key for key in keys if key not in (x, by, *linked)]:
        raise FigureError(f"it needs one value of {listed(others)}; choose it with {WHERE}")
    ordered = sorted(points, key=lambda point: float(value_at(point, x)))
    if by is None or by == x or by not in keys:
        return [ordered]
    values = spread(distinct(points, by), MOST_SERIES)
    return [[point for point in ordered if value_at(point, by) == value] for value in values]


def gas_type_of(point: Point) -> GasType:
    """Whether walls give energy to a point's gas; else whether collisions take some."""
    return gas_type(traits_of(point.config))


def elastic(point: Point) -> bool:
    """Whether no collision of a point loses or gives energy."""
    return gas_type_of(point) == "elastic"


SCENE_WORDS = {  # of the keys whose common values a caption prints
    "balls.rings": "N = {}",
    "balls.count": "N = {}",
    "balls.radius": "r = {} m",
    "balls.packing": "packing {}",
    "balls.speed": "v₀ = {} m/s",
    "container.shape": "{}",
    **{f"container.{key}": f"{key} {{}} m" for shape in SHAPES.values() for key in shape.keys},
    "container.radius": "R = {} m",
    "container.packing": "packing {}",
    "cor": "CoR {}",
    "cor_speed": "as at {} m/s",
    "wall_cor": "wall CoR {}",
    "wall_cor_speed": "wall CoR as at {} m/s",
    "tangential_cor": "tangential restitution β = {}",
    "friction": "μ = {}",
    "wall_tangential_cor": "wall β = {}",
    "wall_friction": "wall μ = {}",
    "wall_speed": "walls driven at V = {} m/s",
    "wall_temperature": "wall at {} J",
}
_WORDS = SCENE_WORDS | {
    "tangential_cor": "β = {}",
    "wall_speed": "V = {} m/s",
    "balls.mass": "m = {} kg",
    "balls.ring_extent": "ring extent {}",
    "container.mass": "M = {} kg",
    "collisions": "{} collisions",
    "time": "{} s",
}

AXES = {
    "cor": "coefficient of restitution",
    "wall_cor": "coefficient of restitution of the wall",
    "balls.rings": "rings of balls",
    "balls.count": "number of balls",
    "balls.radius": "ball radius (m)",
    "balls.speed": "speed at the start (m/s)",
    "balls.packing": "packing fraction",
    "container.packing": "packing fraction",
    "container.radius": "radius of the container (m)",
    "tangential_cor": "tangential restitution β",
    "friction": "friction μ",
    "wall_speed": "speed V of the wall (m/s)",
    "wall_temperature": "temperature of the wall (J)",
}
"""Labels of an x axis, by the swept key."""

_ABSENT = {"wall_cor": "wall CoR = ball CoR", "container.mass": "fixed wall"}
"""The meaning of a key that is null or infinite."""


def described(point: Point, key: str, words: Mapping[str, str] = {}) -> str:
    """A key and its value in words: ``CoR 0.8``, ``r = 0.1 m``.

    words : of keys, if they have others here, as ``SCENE_WORDS``

    Empty for a key that one of the runs side by side does not have.
    """
    value = value_at(point, key)
    if key == RUN:
        return str(value)
    if key in _ABSENT and value in (None, math.inf):
        return _ABSENT[key] if facts.hold(point.config, "walls") else "no wall"
    if value is None:
        return "" if RUN in dict(point.parameters) else f"no {_name(key)}"
    return words.get(key, _words(point, key)).format(_shown(point, key))


def scale(points: Sequence[Point]) -> tuple[str, tuple[str, ...]]:
    """The one key that varies with a number of its own for each point, as the label of a scale.

    ``CoR``, ``r (m)``; and each point's value as a text. Both are empty if there is no such key.
    """
    keys = varying(points)
    if len(keys) != 1 or not ranks(points):
        return "", ()
    (key,) = keys
    name, unit = (part.strip(" =") for part in _words(points[0], key).split("{}"))
    if name in ("", "wall at"):
        name = _name(key)
    label = f"{name} ({unit})" if unit and unit != name else name
    return label, tuple(_shown(point, key) for point in points)


def axis_label(point: Point, key: str) -> str:
    """The label of an axis of a swept key, with its unit: ``ball radius (m)``."""
    unit = unit_of(point.config, key)
    return AXES.get(key) or (f"{_name(key)} ({unit})" if unit else _name(key))


def _words(point: Point, key: str) -> str:
    """Words of a key with a place for its value; without words of its own its name is one."""
    wall, _, side = key.rpartition(".")
    if side in SIDES:
        return f"{side} {_WORDS[wall]}"
    return _WORDS.get(key) or f"{_name(key)} = {{}} {unit_of(point.config, key)}".rstrip()


def _name(key: str) -> str:
    """The last name of a key as words, and the wall, species (from 1) or ball that it is of."""
    *path, last = key_path(key)
    words = str(last).replace("_", " ")
    match path:
        case [*_, str(wall)] if last in SIDES:
            return f"{wall.replace('_', ' ')}, {words}"
        case ["balls", int(species)]:
            return f"{words} of species {species + 1}"
        case ["balls", "list", int(ball)]:
            return f"{words} of ball {ball}"
    return words


def _shown(point: Point, key: str) -> str:
    """A point's value of a key as a text, without its unit."""
    value = value_at(point, key)
    if key == "balls.rings":
        value = 1 + 3 * value * (value + 1)
    if key == "container.shape":
        value = SHAPES[value].title
    shown = short(value, 6) if isinstance(value, float) else str(value)
    if isinstance(value, Model):  # by side
        sides = [f"{side} {amount:g}" for side, amount in dict(value).items() if amount is not None]
        shown = ", ".join(sides)
    return shown
