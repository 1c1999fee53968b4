"""A figure of several points: its layers, its numbers, and its caption with the scene."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from snooker_cli.analysis.decay import early_endings
from snooker_cli.containers import Circle
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_data import (
    Band,
    Curve,
    FigureData,
    Layer,
    Line,
    LineStyle,
    at_common_times,
    bands,
    thinned,
)
from snooker_cli.figures.selection import (
    described,
    distinct,
    facts,
    label,
    matching,
    present,
    repeats,
    value_at,
    varying,
)
from snooker_cli.formatting import listed

if TYPE_CHECKING:
    from snooker_cli.config import Point
    from snooker_cli.figures.selection import Facts, Selection
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace


SPREAD = "mean ± standard deviation of a repeat"
"""What a band shows."""

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


@dataclass
class FigureBuilder:
    """A figure of several points, while its layers, numbers and results are collected.

    points : in the order of their series
    single : whether one repeat of each point is shown
    lines, bands : layers; bands are behind lines
    records : the numbers of each point, as JSON
    results : a phrase for each series
    """

    run: Run
    selection: Selection
    points: Sequence[Point]
    single: bool = False
    lines: list[Layer] = field(default_factory=list)
    bands: list[Band] = field(default_factory=list)
    records: list[dict[str, Any]] = field(default_factory=list)
    results: list[str] = field(default_factory=list)

    def traces(self, point: Point) -> Iterator[Trace]:
        """The selected repeats of a point. Raises ``StoreError``."""
        return repeats(self.run, point, self.selection)

    def label(self, point: Point) -> str | None:
        """The legend's text for a point; ``None`` if it is alone."""
        return label(point, self.points)

    def record(self, point: Point, **numbers: Any) -> None:
        """Add the numbers of a point."""
        self.records.append({"parameters": point.as_json(), **numbers})

    def result(self, point: Point, text: str) -> None:
        """Add a phrase of the caption, with the point it belongs to."""
        name = self.label(point)
        self.results.append(f"{text} ({name})" if name else text)

    @property
    def results_text(self) -> str:
        """All phrases."""
        return "; ".join(self.results)

    def add_course(
        self,
        index: int,
        point: Point,
        curves: Sequence[Curve],
        *,
        steps: bool = True,
        style: LineStyle = "series",
    ) -> None:
        """Add the curve of the first repeat as a line, and the band of all of them."""
        time, values = curves[0]
        kept = thinned(time)
        line = Line(time[kept], values[kept], self.label(point), index, style, steps=steps)
        self.lines.append(line)
        self.bands += bands(*at_common_times(curves, steps=steps), index)

    def figure(
        self,
        *,
        caption: str,
        references: Sequence[Layer] = (),
        numbers: dict[str, Any] | None = None,
        **words: Any,
    ) -> FigureData:
        """The figure: bands, references and lines; ``words`` are fields of ``FigureData``."""
        if self.bands:
            caption += f" Lines: {_which_repeat(self.run, self.points, self.selection)}; "
            caption += f"bands: {SPREAD}."
        ending = setting(self.run, self.points, self.selection, single=self.single)
        return FigureData(
            layers=(*self.bands, *references, *self.lines),
            caption=f"{caption} {ending}",
            numbers={**(numbers or {}), "points": self.records},
            **words,
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
        text = f"{_which_repeat(run, points, selection)} of {number}{length}"
    else:
        text = f"{number} repeats{length}{' each' if length and not ended else ''}"
    sentences = [
        f"Scene: {', '.join(_constants(points))}; {text}{': ' if ended else ''}{ended}.",
        unfinished(run, selection),
        _copies(points, found),
    ]
    return " ".join(filter(None, sentences))


def _which_repeat(run: Run, points: Sequence[Point], selection: Selection) -> str:
    """The repeat that is shown where one of each point is."""
    numbers = {present(run, point, selection)[0] for point in points}
    return f"repeat {numbers.pop()}" if len(numbers) == 1 else "the first repeat of each point"


def early(shown: Sequence[Facts]) -> str:
    """How many of these repeats ended early, and why; empty if none did."""
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
    """How many of the requested repeats an unfinished run has; empty for a finished one."""
    wanted = 1 if selection.repeat is not None else run.experiment.repeats
    points = matching(run, selection)
    counts = [len(present(run, point, selection)) for point in points]
    short = [k for k, count in enumerate(counts) if count < wanted]
    if not short:
        return ""
    if len(points) == 1 or len(short) > MOST_LISTED:
        text = f"{sum(counts)} of {wanted * len(points)} repeats are there"
        none = counts.count(0)
        text += f", none at {none} of {len(points)} points" if none else ""
    else:
        keys = varying(points)
        places = [", ".join(described(points[k], key) for key in keys) for k in short]
        parts = [f"{counts[k] or 'none'} of {wanted}" for k in short]
        text = listed([f"{part} at {place}" for part, place in zip(parts, places, strict=True)])
        text += " are there"
    return f"The run is unfinished: {text}."


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
    text = " and at ".join(
        f"v₀ = {listed([f'{speed:g}' for speed in speeds])} m/s" for speeds in copies
    )
    return (
        f"The repeats at {text} have the same random numbers: they are the same motions at "
        "another pace and count once."
    )
