"""The registry: every figure by name, the runs that can give it, and the function that makes it."""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.resources import files
from typing import Any

import yaml

from snooker_cli import facts
from snooker_cli.analysis.quantities import QUANTITIES, Quantity, main_quantities
from snooker_cli.analysis.theories import gas_kinds
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.declared_result import Result
from snooker_cli.figures.figure_builder import FigureBuilder, Reading, silent
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.figures.series import (
    MOST_SERIES,
    along,
    as_series,
    changing_with,
    evenly,
    spread,
    swept_number,
    swept_numbers,
)
from snooker_cli.formatting import listed
from snooker_cli.options import WHERE
from snooker_cli.plugins import PluginError, Table, check_function
from snooker_cli.runs import RunFolder
from snooker_cli.runs.run import RUN
from snooker_cli.runs.selection import Selection, distinct, file_stem, selected, varying, with_runs

ANY = "any"  # of a figure that any swept number can be along
MOST_ALONG = 200  # points of a series along x; the eye cannot separate more
MOST_COLLISIONS = 10_000_000  # of a figure that takes a choice of the repeats; they take seconds


@dataclass(frozen=True)
class FigureSpec:
    """A figure that runs can give.

    name : small letters and hyphens, as ``snooker plot RUN NAME`` has it
    title : above the figure
    needs : what a run must have, in words
    draw : the points to show -> the figure; raises ``FigureError``. Of a figure of snooker: the
        names of its module, which is loaded when it is needed, and of its function, and ``of``
    axes : fields of ``FigureData`` that do not depend on the run: ``x_label``, ``y_label``,
        ``x_log``, ``y_log``, ``x_limits``, ``y_limits``, ``equal_axes``, ``panel_label``
    result : its quantity and the names of its numbers; ``None`` if there is none
    shows : what is plotted, the first sentence of the caption
    report_figures : the source report's figures of this type
    requires : the facts that a point's config must meet, the type of gas first
    along : the swept keys, one of which is on the x axis; ``any``: the first swept number
    by : the key with a series for each value
    alike : the key that has one value for all points
    most : series at most
    each_point : a figure shows one point, so that several points make several figures
    sample : an even choice of many repeats is enough, as for curves and distributions
    reproduce_only : own runs have a better figure: it is drawn by name and by
        ``snooker reproduce``
    """

    name: str
    title: str
    needs: str
    draw: Callable[[FigureBuilder], FigureData] | tuple[str, ...]
    axes: Mapping[str, Any]
    result: Result | None
    shows: str = ""
    was: Sequence[str] = ()
    report_figures: Sequence[int] = ()
    requires: Sequence[str] = ()
    along: Sequence[str] | str = ()
    by: str | None = None
    alike: str | None = None
    most: int = MOST_SERIES
    each_point: bool = False
    sample: bool = False
    reproduce_only: bool = False

    def fitting(self, points: Sequence[Point]) -> tuple[list[Point], Counter[str]]:
        """The points that the figure can show by their config; why it cannot show the others.

        It may still lack collisions. The reasons count the points; the last one is that of the
        points that nearly fit.
        """
        fitting = [(point, facts.traits_of(point.config)) for point in points]
        reasons = Counter[str]()
        for name in self.requires:
            fact = facts.FACTS[name]
            reasons.update(fact.reason(gas) for _, gas in fitting if not fact.holds(gas))
            fitting = [(point, gas) for point, gas in fitting if fact.holds(gas)]
        return [point for point, _ in fitting], reasons

    def groups(self, points: Sequence[Point]) -> list[list[Point]]:
        """Points that fit, as ``FigureBuilder`` has them. Raises ``FigureError``."""
        if self.alike in varying(points):
            name = self.alike.rpartition(".")[2]
            raise FigureError(f"it needs one {name}; choose it by {self.alike} with {WHERE}")
        if not self.along:
            return [(as_series if self.most <= MOST_SERIES else evenly)(points, self.most)]
        xs, by = self.along, self.by
        if xs == ANY:
            xs = [_key_alone(points)]
            linked = changing_with(points, *xs)
            by = next((key for key in varying(points) if key not in (RUN, *xs, *linked)), None)
        groups = along(points, xs, by, together=self.along == ANY)
        return [spread(group, MOST_ALONG) for group in groups]

    def make(
        self,
        run: RunFolder,
        selection: Selection,
        *,
        first: bool = False,
        source: bool = False,
        reading: Reading = silent,
    ) -> FigureData:
        """The figure of the selected points; if it shows one point, ``first`` chooses the first.

        source : whether it has the form that the reproduction of the source report prints
        reading : is called for each repeat that is read

        Raises ``FigureError`` if the run cannot give it, and ``StoreError`` if a repeat cannot be
        read.
        """
        points, reasons = self.fitting(selected(run, selection))
        if not points:
            raise FigureError([*reasons][-1])
        total = len(points)
        points = points[:1] if self.each_point and first else points
        if self.each_point and len(points) > 1:
            keys = listed(varying(points))
            raise FigureError(
                f"it shows one point and {len(points)} are there; choose one by {keys} with {WHERE}"
            )
        fields = {"kind": self.name, "title": self.title, **self.axes}
        groups = self.groups(points)
        words = self.shows, self.result
        build = FigureBuilder(run, selection, groups, fields, *words, total=total, source=source)
        build.reading = reading
        if self.along:
            longest = swept_numbers(max(groups, key=len))
            build.key = next(key for key in longest if self.along == ANY or key in self.along)
        for point in build.points if self.sample else ():
            collisions = [status.collisions for status in build.statuses(point)]
            build.limit(point, MOST_COLLISIONS // len(build.points) // max(1, *collisions))
        draw = self.draw if callable(self.draw) else _loaded(*self.draw)
        figure = draw(build)
        if not isinstance(figure, FigureData):
            raise FigureError(f"its function draws no FigureData but {figure!r:.40}; return one")
        return figure


def _key_alone(points: Sequence[Point]) -> str:
    """The first swept number along which no other figure has the main result of points.

    Raises ``FigureError`` without one.
    """

    swept_number(points)
    kinds = gas_kinds(facts.traits_of(points[0].config))
    main = next(quantity for quantity in main_quantities(*kinds) if quantity.has_values)
    shown = {key: _name_along(points, key, main) for key in swept_numbers(points)}
    alone = [key for key, name in shown.items() if name is None]
    if not alone:
        (key, name), *_ = shown.items()
        raise FigureError(f"{name} has {main.name} along {key}; draw {name}")
    return alone[0]


def _name_along(points: Sequence[Point], key: str, main: Quantity) -> str | None:
    """The name of the figure of own runs that has a main quantity of points along a key."""
    for name, spec in FIGURES.items():
        if spec.reproduce_only or spec.along == ANY or key not in spec.along:
            continue
        if spec.result is None or spec.result.definition.symbol != main.symbol:
            continue
        fitting, _ = spec.fitting(points)
        with suppress(FigureError):
            if len(distinct(fitting, key)) > 1 and spec.groups(fitting):
                return name
    return None


def _loaded(module: str, function: str, *first: str) -> Callable[[FigureBuilder], FigureData]:
    """A function of a module of this package, with its first argument if it has several figures."""
    loaded = getattr(import_module(f"snooker_cli.figures.{module}"), function)
    return partial(loaded, *first)


def _read() -> dict[str, FigureSpec]:
    text = (files("snooker_cli.figures") / "registry.yaml").read_text(encoding="utf-8")
    fields = FigureData.__dataclass_fields__.keys() - {"title", "result"}
    specs = {}
    for name, entry in yaml.safe_load(text).items():
        axes = {key: entry.pop(key) for key in fields if key in entry}
        first = [entry.pop("of")] if "of" in entry else []
        draw = *entry.pop("draw").split("."), *first
        result = entry.pop("result")  # of a figure without one it is null
        declared = None if result is None else Result(**result)
        specs[name] = FigureSpec(name=name, draw=draw, axes=axes, result=declared, **entry)
    return specs


def _taken(thing: object) -> tuple[str, FigureSpec]:
    """What a distribution adds to ``FIGURES``. Raises ``PluginError``."""
    if not isinstance(thing, FigureSpec):
        raise PluginError("it is no FigureSpec", "name an object of this class")
    if not re.fullmatch("[a-z0-9]+(-[a-z0-9]+)*", thing.name):
        raise PluginError(f"its name is {thing.name!r}", "give it words in small letters, with -")
    if callable(thing.draw):
        check_function(thing.draw, "draw", "build")
    for name in thing.requires:
        if name not in facts.FACTS:
            raise PluginError(f"there is no fact {name} that `requires` may name")
    for name in thing.axes:
        if name not in FigureData.__dataclass_fields__:
            raise PluginError(f"there is no field {name} that `axes` may have")
    if thing.result is not None and thing.result.quantity not in QUANTITIES:
        name = thing.result.quantity
        raise PluginError(f"its result {name} is no quantity", "add it to snooker.quantities")
    return thing.name, thing


FIGURES = Table("snooker.figures", _read(), _taken)
"""Every figure by its name: the source report's in the order of its figures, then ours."""


def own_figures() -> tuple[str, ...]:
    """The figures of one's own runs; the others are drawn by name and by ``snooker reproduce``."""
    return tuple(name for name, spec in FIGURES.items() if not spec.reproduce_only)


def former_names() -> dict[str, str]:
    """The figures that have the content of former ones, by the names of these."""
    return {name: spec.name for spec in FIGURES.values() for name in spec.was}


def figures_of(
    run: RunFolder,
    names: Iterable[str],
    selection: Selection,
    reading: Reading = silent,
    most: int | None = None,
) -> Iterator[tuple[str, str, FigureData | FigureError]]:
    """Name, file name without ending, and content of figures; an error if the run cannot give it.

    A figure that shows one point is made for each selected point. Raises ``FigureError`` if no
    repeat is there.

    most : points at most that such figures are made for, evenly chosen
    """
    points = selected(run, selection)

    for name in names:
        spec = FIGURES[name]
        chosen = [selection]
        if spec.each_point:
            fitting, reasons = spec.fitting(points)
            yield from ((name, "", FigureError(reason)) for reason in reasons.elements())
            fitting = evenly(fitting, most or len(fitting)) if fitting else []
            chosen = [replace(selection, where=dict(point.parameters)) for point in fitting]
        for one in chosen:
            try:
                named = replace(one, where=with_runs(one.where, points))
                yield name, file_stem(name, named), spec.make(run, one, reading=reading)
            except FigureError as error:
                yield name, "", error


def possible(
    names: Iterable[str], points: Sequence[Point]
) -> Iterator[tuple[str, bool, Counter[str]]]:
    """Name of figures, whether these points fit by their config, and why some of them do not.

    No repeat is read, so that a figure that fits may still need more collisions than there are.
    """
    for name in names:
        fitting, reasons = FIGURES[name].fitting(points)
        try:
            if fitting:
                FIGURES[name].groups(fitting)
        except FigureError as error:
            fitting, reasons[str(error)] = [], len(fitting)
        yield name, bool(fitting), reasons
