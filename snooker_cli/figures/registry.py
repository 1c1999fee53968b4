"""The registry: every figure by name, the runs that can give it, and the function that makes it."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.resources import files
from typing import Any

import yaml

from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.captions import FigureBuilder
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.figures.selection import (
    MOST_SERIES,
    Gas,
    Selection,
    along,
    evenly,
    file_stem,
    gas,
    selected,
    statuses,
    varying,
)
from snooker_cli.formatting import listed
from snooker_cli.runs import Run

MOST_COLLISIONS = 5_000_000  # of a point, which take seconds
MOST_IN_SAMPLE = 1_000_000  # of a run; of more, a sample is the first repeat of each point

REFUSED: Mapping[Gas, str] = {
    "cooling": "nothing decays where all collisions are elastic; take cor below 1",
    "elastic": "it is about the equilibrium of elastic balls; run it at cor 1",
    "warm": "it is about walls that give energy; set wall_speed or wall_temperature",
}
"""Why a figure of these gases does not show the points."""

WARM = "walls give energy, so the gas neither cools nor keeps its energy; see `stationary`"


@dataclass(frozen=True)
class FigureSpec:
    """A figure that runs can give; registry.yaml explains its fields.

    draw : the points to show -> the figure; raises ``FigureError``
    axes : fields of ``FigureData``
    """

    name: str
    title: str
    needs: str
    draw: Callable[[FigureBuilder], FigureData]
    axes: Mapping[str, Any]
    shows: str = ""
    report_figures: Sequence[int] = ()
    states: bool = False
    gases: Sequence[Gas] = ()
    along: Sequence[str] = ()
    by: str | None = None
    most: int = MOST_SERIES
    each_point: bool = False
    sample: bool = False

    def make(self, run: Run, selection: Selection, *, first: bool = False) -> FigureData:
        """The figure of the selected points; if it shows one point, ``first`` chooses the first.

        Raises ``FigureError`` if the run cannot give it, and ``StoreError`` if a repeat cannot be
        read.
        """
        if self.states and not run.experiment.keeps_events:
            raise FigureError("it needs the balls' states; run the config with `record: events`")
        points: Sequence[Point] = selected(run, selection)
        if self.gases and not (shown := [point for point in points if gas(point) in self.gases]):
            warm = any(gas(point) == "warm" for point in points)
            raise FigureError(WARM if warm else REFUSED[self.gases[0]])
        points = shown if self.gases else points
        total = len(points)
        points = points[:1] if self.each_point and first else points
        if self.each_point and len(points) > 1:
            keys = listed(varying(points))
            raise FigureError(
                f"it shows one point and {len(points)} are there; choose one by {keys} with --where"
            )
        groups = along(points, self.along, self.by) if self.along else [evenly(points, self.most)]
        fields = {"kind": self.name, "title": self.title, **self.axes}
        build = FigureBuilder(run, selection, groups, fields, self.shows, total=total)
        for point in build.points if self.sample else ():
            collisions = [status.collisions for status in statuses(run, point, selection)]
            build.limit(point, MOST_COLLISIONS // max(1, *collisions))
        return self.draw(build)


def _read() -> dict[str, FigureSpec]:
    text = (files("snooker_cli.figures") / "registry.yaml").read_text(encoding="utf-8")
    fields = FigureData.__dataclass_fields__.keys() - {"title"}
    specs = {}
    for name, entry in yaml.safe_load(text).items():
        axes = {key: entry.pop(key) for key in fields if key in entry}
        module, function = entry.pop("draw").split(".")
        draw = getattr(import_module(f"snooker_cli.figures.{module}"), function)
        if "of" in entry:
            draw = partial(draw, entry.pop("of"))
        specs[name] = FigureSpec(name=name, draw=draw, axes=axes, **entry)
    return specs


FIGURES = _read()
"""Every figure by its name: the source report's in the order of its figures, then ours."""


def figures_of(
    run: Run, names: Iterable[str], selection: Selection, *, sample: bool = False
) -> Iterator[tuple[str, str, FigureData | FigureError]]:
    """Name, file name without ending, and content of figures; an error if the run cannot give it.

    A figure that shows one point is made for each selected point. Raises ``FigureError`` if no
    repeat is there.

    sample : make figures of the first repeats alone if the run is large; they show which figures
        are possible, and all of them may take minutes
    """
    points = selected(run, selection)
    if sample and selection.repeat is None and _is_large(run, points):
        run = replace(run, experiment=run.experiment.model_copy(update={"repeats": 1}))
    single = [Selection(dict(point.parameters), selection.repeat) for point in points]
    for name in names:
        for chosen in single if FIGURES[name].each_point else [selection]:
            try:
                yield name, file_stem(name, chosen), FIGURES[name].make(run, chosen)
            except FigureError as error:
                yield name, "", error


def _is_large(run: Run, points: Sequence[Point]) -> bool:
    """Whether a run has many collisions, and some in each first repeat, which can be a sample."""
    repeats = [status for point in points for status in run.statuses(point.index)]
    firsts = [status for status in repeats if status.repeat == 0]
    total = sum(status.collisions for status in repeats)
    return total > MOST_IN_SAMPLE and all(status.collisions > 0 for status in firsts)
