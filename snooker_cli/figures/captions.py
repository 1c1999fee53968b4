"""The sentences that end a caption: the scene, its repeats, how they ended, what they share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from snooker_cli.analysis.decay import early_endings
from snooker_cli.containers import Circle
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_data import SPREAD
from snooker_cli.figures.selection import (
    described,
    distinct,
    facts,
    matching,
    there,
    value_at,
    varying,
)
from snooker_cli.formatting import listed

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.figures.figure_data import Band
    from snooker_cli.figures.selection import Facts, Selection
    from snooker_cli.runs import Run


MOST_LISTED = 3
"""More points than this with missing repeats are summed up."""

_SCENE = (
    "balls.rings",
    "balls.count",
    "balls.radius",
    "balls.packing",
    "balls.speed",
    "container.shape",
    "container.radius",
    "container.width",
    "container.height",
    "container.packing",
    "cor",
    "wall_cor",
)


def setting(
    run: Run, points: Sequence[Point], selection: Selection, *, single: bool = False
) -> str:
    """The sentences that end a caption: the scene's constants, the repeats and their endings.

    single : whether one repeat of each point is shown
    """
    found = [facts(run, point, selection, single=single) for point in points]
    ended = early([each for shown in found for each in shown])
    number = run.experiment.repeats
    several = number > 1 and not single and selection.repeat is None
    length = _length(points, " of at most" if ended and several else ", at most" if ended else ",")
    if number == 1:
        text = f"one repeat{' each' if len(points) > 1 else ''}{length}"
    elif not several:
        text = f"{which_repeat(run, points, selection)} of {number}{length}"
    else:
        text = f"{number} repeats{length}{' each' if length and not ended else ''}"
    sentences = [
        f"Scene: {', '.join(_constants(points))}; {text}{': ' if ended else ''}{ended}.",
        unfinished(run, selection),
        _copies(points, found),
    ]
    return " ".join(filter(None, sentences))


def which_repeat(run: Run, points: Sequence[Point], selection: Selection) -> str:
    """The repeat that is shown where one of each point is."""
    numbers = {there(run, point, selection)[0] for point in points}
    return f"repeat {numbers.pop()}" if len(numbers) == 1 else "the first repeat there is"


def lines_and_bands(
    run: Run, points: Sequence[Point], selection: Selection, bands: Sequence[Band]
) -> str:
    """The sentence about lines of single repeats with bands over all of them, with a space."""
    which = which_repeat(run, points, selection)
    return f"Lines: {which}, bands: {SPREAD}. " if bands else ""


def early(shown: Sequence[Facts]) -> str:
    """How many of these repeats ended early and why; empty if none did."""
    return early_endings(Counter(each.reason for each in shown))


def _constants(points: Sequence[Point]) -> list[str]:
    """What all points have in common, as ``r = 1 m``."""
    constants = [one] if (one := _single_balls(points[0])) else []
    without_walls = not any(point.experiment.container.shape_class.has_wall for point in points)
    for key in _SCENE:
        value = _common(points, key)
        unsaid = value is None or (key, value) == ("container.shape", Circle.name)
        if not unsaid and not (key == "wall_cor" and without_walls):
            constants.append(described(points[0], key))
    return constants


def _common(points: Sequence[Point], key: str) -> Any:
    """What a key is at all points; ``None`` where it varies, or their configs do not have it."""
    try:
        values = distinct(points, key)
    except FigureError:
        return None
    return values[0] if len(values) == 1 else None


def _single_balls(point: Point) -> str:
    """The number of balls that are given one by one, or by species; empty for others."""
    balls, species = point.experiment.balls, point.experiment.species
    if len(species) > 1:
        return f"N = {sum(one.count for one in species)} of {len(species)} species"
    single = getattr(balls, "list", None)
    return "" if single is None else f"N = {len(single)}"


def _length(points: Sequence[Point], before: str) -> str:
    """How long the repeats were to be, as ``, 500 collisions``; empty if that varies."""
    ends = [
        described(points[0], key)
        for key in ("collisions", "time")
        if key not in varying(points) and value_at(points[0], key) is not None
    ]
    return f"{before} {' or '.join(ends)}" if ends else ""


def unfinished(run: Run, selection: Selection) -> str:
    """Of an unfinished run, how many of the repeats that were asked for are there."""
    wanted = 1 if selection.repeat is not None else run.experiment.repeats
    points = matching(run, selection)
    present = [len(there(run, point, selection)) for point in points]
    short = [k for k, count in enumerate(present) if count < wanted]
    if not short:
        return ""
    if len(points) == 1 or len(short) > MOST_LISTED:
        said = f"{sum(present)} of {wanted * len(points)} repeats are there"
        none = present.count(0)
        said += f", none at {none} of {len(points)} points" if none else ""
    else:
        keys = varying(points)
        places = [", ".join(described(points[k], key) for key in keys) for k in short]
        counts = [f"{present[k] or 'none'} of {wanted}" for k in short]
        said = listed([f"{n} at {place}" for n, place in zip(counts, places, strict=True)])
        said += " are there"
    return f"The run is unfinished: {said}."


def _copies(points: Sequence[Point], found: Sequence[Sequence[Facts]]) -> str:
    """Which start speeds give the same motions at another pace, where all repeats do."""
    if "balls.speed" not in varying(points):
        return ""
    groups: dict[tuple[bytes, ...], list[float]] = {}
    for point, shown in zip(points, found, strict=True):
        if all(each.collisions for each in shown):
            motions = tuple(each.motion for each in shown)
            groups.setdefault(motions, []).append(value_at(point, "balls.speed"))
    copies = dict.fromkeys(tuple(speeds) for speeds in groups.values() if len(speeds) > 1)
    if not copies:
        return ""
    said = " and those at ".join(
        f"v₀ = {listed([f'{speed:g}' for speed in speeds])} m/s" for speeds in copies
    )
    return (
        f"The repeats at {said} share their random numbers and are the same motions at another "
        "pace, to the bit: they count once."
    )
