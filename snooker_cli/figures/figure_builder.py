"""``FigureBuilder`` collects the layers, numbers and caption of a figure of several points."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import theories
from snooker_cli.analysis.decay import Decay, decays_of
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import standard_errors
from snooker_cli.analysis.quantities import Quantity
from snooker_cli.analysis.run_analysis import measurement_of
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures.axis_limits import beginning_of_decades, farthest
from snooker_cli.figures.caption_text import Caption, setting, theory_sentence
from snooker_cli.figures.declared_result import (
    Result,
    agreement,
    deviation_sentence,
    deviations,
)
from snooker_cli.figures.figure_data import (
    BY_THEORY,
    EXTRAPOLATED,
    MEASURED,
    NEUTRAL,
    Array,
    Band,
    Course,
    FigureData,
    Layer,
    Line,
    LineStyle,
    Panel,
    Points,
    Reference,
    Repeats,
    at_common_times,
    last_known,
    lasting,
    lasting_rows,
    mean_of_remaining,
    more_than_a_decade,
    remaining,
)
from snooker_cli.figures.series import described, of_label, ranks, scale, spread, two_keys
from snooker_cli.formatting import counted, least_to_most, short
from snooker_cli.runs import RepeatStatus, RunFolder
from snooker_cli.runs.selection import Selection, statuses, varying
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace, even_choice

MOST_BANDS = 8  # series with bands; more would hide each other
SPREAD = "mean ± standard deviation of a repeat"  # what the band of a fit shows
LOG_SPREAD = "mean ± standard deviation of logarithms"  # the same on a logarithmic axis
FEWEST_STATES = 2  # of a repeat that a figure over time or space can have
BARS = "Bars: standard errors over the repeats."  # of all markers with errors
ENERGIES = "Temperatures are energies: Boltzmann's constant is 1."  # of an axis in J
OVER_THEORY = "ln(result / theory)"  # the y label of a panel of residuals
MOST_SINGLE = 12  # thin lines of single repeats in a figure at most
EARLY = 0.8  # share of the median end, before which the end of a repeat is early


Reading: TypeAlias = Callable[[str], None]
"""Gets a text about what a figure reads now, for a display of progress."""


def silent(_text: str) -> None:
    """Shows no progress."""


@dataclass
class FigureBuilder:
    """A figure of several points, while its layers, numbers and results are collected.

    groups : points along the x axis, a list for each series; or one list, of a series each
    fields : fields of ``FigureData`` that do not depend on the run
    shows : the sentence that begins the caption
    result : the result of the figure, if it has one; the caption says it next
    lines, bands : layers; bands are behind lines
    averaged : whether some lines are means over repeats
    panel : layers of the panel below
    results : residuals that the caption is about, if they are not those of the panel
    records : the numbers of each point, as JSON
    places : the point of each record in words
    singles : thin lines of single repeats, behind all of them
    cited : sources of the theories that the caption names, by their names
    thin : whether theory is left out for a mean free path that exceeds the container
    brief : numbers of repeats that results of means leave out because they end early, by series
    fewest : number of repeats that remain at the end of a mean course, and number of all; of the
        points with mean courses, the one with the least share
    errors : what bars and bands are, if not standard errors over the repeats
    beside_theory : whether the caption of the figure itself says the result beside theory
    headline : the result in a few words, after the title; without it, whether theory agrees
    where : after words on theory in the title, which points these are on
    key : the swept key that the x axis shows; empty without one
    total : number of points before those in ``groups`` were chosen
    most : repeats of a point at most, by the point's index
    source : whether figures have the form and the theories of the source report's reproduction
    reading : is called for each repeat that is read
    """

    run: RunFolder
    selection: Selection
    groups: Sequence[Sequence[Point]]
    fields: Mapping[str, Any]
    shows: str = ""
    result: Result | None = None
    lines: list[Layer] = field(default_factory=list)
    bands: list[Band] = field(default_factory=list)
    averaged: bool = False
    singles: list[Repeats] = field(default_factory=list)
    panel: list[Layer] = field(default_factory=list)
    results: list[Layer] = field(default_factory=list)
    records: list[dict[str, Any]] = field(default_factory=list)
    places: list[str] = field(default_factory=list)
    cited: dict[str, str] = field(default_factory=dict)
    thin: bool = False
    brief: dict[int, int] = field(default_factory=dict)
    fewest: tuple[int, int] = (1, 1)
    errors: str = ""
    beside_theory: bool = False
    headline: str = ""
    where: str = ""
    key: str = ""
    total: int = 0
    most: dict[int, int] = field(default_factory=dict)
    source: bool = False
    reading: Reading = silent
    _statuses: dict[tuple[int, int | None], list[RepeatStatus]] = field(default_factory=dict)

    @property
    def points(self) -> list[Point]:
        """All points."""
        return [point for group in self.groups for point in group]

    def statuses(self, point: Point) -> list[RepeatStatus]:
        """The selected repeats of a point that have a file; the files are looked at once."""
        key = point.index, self.selection.repeat
        if key not in self._statuses:
            self._statuses[key] = statuses(self.run, point, self.selection)
        return self._statuses[key]

    def limit(self, point: Point, most: int) -> None:
        """Use an even choice of at most this many repeats of a point, which the caption counts."""
        self.most[point.index] = max(1, min(most, self.most.get(point.index, most)))

    def states(
        self, point: Point, wanted: int, most: int, *, each: int = 0, fewest: int = FEWEST_STATES
    ) -> int:
        """How many states of each repeat a figure can afford, at most ``wanted``; it takes seconds.

        most : balls times states of the figure; a state counts as ``each`` balls more
        fewest : states that a repeat has before there are fewer repeats

        If even one repeat has too many, it has fewer states. Raises ``FigureError`` if those are
        too many.
        """
        number = self.start(point).number
        share = most // len(self.points) // (number + each)
        self.limit(point, share // fewest)
        states = min(wanted, share // len(self.repeats(point)))
        least = min(FEWEST_STATES, fewest)
        if states < least and least * number > most:
            raise FigureError(f"it takes too long for more than {most // least:,} balls")
        return max(states, least)

    def traces(self, point: Point) -> Iterator[Trace]:
        """The selected repeats of a point, for figures that need their states.

        Raises ``StoreError``.
        """
        repeats = self.repeats(point)
        where = f"{self.run.place(point)}, " if len(self.run.points) > 1 else ""
        for k, trace in enumerate(self.run.traces(point, repeats), start=1):
            self.reading(f"{self.fields['kind']}: {where}repeat {k:,} of {len(repeats):,}")
            yield trace

    def measurement(self, point: Point) -> Measurement:
        """The measurement of these repeats. Raises ``StoreError``."""
        own = self.run.origin(point)
        return measurement_of(*own, self.repeats(point), lambda: self.traces(point))

    def energy_decays(self, point: Point) -> list[Decay]:
        """The decay of the energy of a point, over these repeats of it."""
        return decays_of(self.measurement(point), ("kinetic_energy",))

    def repeats(self, point: Point) -> list[int]:
        """The numbers of these repeats."""
        numbers = [status.repeat for status in self.statuses(point)]
        return spread(numbers, self.most.get(point.index, len(numbers)))

    def predicted(self, scene: Scene, quantity: Quantity, *models: str) -> float | None:
        """What the first of these theories that holds for a scene says; the caption cites it."""
        known = theories.values_of(scene, quantity, *models)
        for model, value in known.items():
            self.cite(quantity, model)
            return value
        return None

    def cite(self, quantity: Quantity, model: str) -> str:
        """Let the caption name a theory with its source; returns its name."""
        self.cited[model] = theories.source_of(quantity, model)
        return model

    def too_thin(self, scene: Scene) -> bool:
        """Whether a ball flies farther than the container's size from ball to ball."""
        density, radius = scene.number / scene.container.area, float(np.mean(scene.radii))
        thin = theory.mean_free_path(density, radius) > max(scene.container.size)
        self.thin |= thin
        return thin

    def start(self, point: Point) -> Scene:
        """The start of a point's first repeat. Raises ``StoreError``."""
        return next(self.traces(point)).start

    def label(self, point: Point, points: Sequence[Point] | None = None) -> str | None:
        """A point's text in the legend: the keys that vary; ``None`` if it is alone."""
        return _joined(point, of_label(points or self.points)) or None

    def name_of(self, group: Sequence[Point]) -> str:
        """The text in the legend of one of `groups`, which is a series along x."""
        return self.label(group[0], [points[0] for points in self.groups]) or "simulation"

    def all_hold(self, *names: str) -> bool:
        """Whether these facts are true of the starts of all points."""
        return all(facts.hold(self.start(point), *names) for point in self.points)

    def record(self, point: Point, **numbers: Any) -> None:
        """Add the numbers of a point, or of a species of it; a pair is a value and its error."""
        row = {"parameters": point.as_json(), "repeats": len(self.repeats(point))}
        for name, value in numbers.items():
            if isinstance(value, tuple):
                value, row[f"{name}_error"] = value
            row[name] = value
        self.records.append(row)
        self.places.append(", ".join(filter(None, [self.label(point), numbers.get("species")])))

    def _result_sentence(self, numbers: Mapping[str, Any]) -> str:
        """The sentence on the result, unless the caption has one already."""
        if self.result is None or self.beside_theory:
            return ""
        if self.result.number in numbers:
            return self.result.sentence([numbers], [""], self.fewest_repeats)
        return self.result.sentence(self.records, self.places, self.fewest_repeats)

    @property
    def fewest_repeats(self) -> int:
        """Repeats that the point with the fewest has."""
        return min(len(self.repeats(point)) for point in self.points)

    def _choice(self) -> str:
        """Sentences if there are more points or repeats than the figure uses."""
        shown, used = len(self.points), [len(self.repeats(point)) for point in self.points]
        points = f"Shown: {shown} of {self.total} points." * (shown < self.total)
        if used == [len(self.statuses(point)) for point in self.points]:
            return points
        number = least_to_most(used, str)
        noun = "repeat" if max(used) == 1 else "evenly chosen repeats"
        where = " of each point" * (shown > 1)
        return f"{points} The figure uses {number} {noun}{where}.".lstrip()

    def _left_out(self) -> str:
        """A sentence on the repeats that the result of a mean course leaves out."""
        brief = sum(self.brief.values())
        if not brief:
            return ""
        number = counted(brief, "repeat")
        verb, whose = ("ends", "its") if brief == 1 else ("end", "their")
        half = f"half of {whose} point's median time"
        return f"The result leaves out {number} that {verb} before {half}."

    def _arrows_sentence(self, high: float | None) -> str:
        """A sentence on measured values above the upper limit of the y axis, which arrows mark."""
        top = farthest(self.lines, high)
        if top is None:
            return ""
        *_, unit = ["", *re.findall(r"\((.*?)\)$", self.fields["y_label"])]
        return (
            f"Arrows: the axis ends below the highest values, up to {short(top)} {unit}".rstrip()
            + "."
        )

    def _largest_deviation(self, panel_label: str, axis: str) -> str:
        """A sentence on the residuals, unless the caption has one already."""
        residuals = self.results or self.panel * (panel_label == OVER_THEORY)
        names = {_owner(line): line.label for line in self.lines if line.label}
        if self.beside_theory:
            return ""
        axis = "" if self.results else axis
        return deviation_sentence(residuals, names, axis, self.fewest_repeats)

    @property
    def title(self) -> str:
        """The title, with the swept keys that have one value here."""
        shown = varying(self.points)
        fixed = [key for key in varying(self.run.points) if key not in shown]
        where = _joined(self.points[0], fixed)
        return f"{self.fields['title']}: {where}" if where else self.fields["title"]

    def _agreement(self, numbers: Mapping[str, Any], panel_label: str) -> str:
        """Whether the residuals, or else the result, agree with theory, in a few words."""
        tested, symbol = self.results, ""
        rows = self.records if self.result and self.result.number not in numbers else [numbers]
        if not tested and panel_label == OVER_THEORY:
            tested = self.panel
        elif self.result:
            symbol = self.result.definition.symbol
            own = map(self.result.residual, rows)
            tested = tested or [replace(one, series=k) for k, one in enumerate(own) if one]
        said = agreement(tested, self.fewest_repeats, whose=symbol)
        alone = sum(np.size(getattr(layer, "x", 0)) for layer in tested) == 1
        if said and alone and len(self.places) == len(self.points) > 1:
            said += f" at {self.places[_owner(tested[0])]}"
        return f"{said} {self.where}".rstrip() if said else ""

    def _title_with_result(self, numbers: Mapping[str, Any], panel_label: str) -> str:
        """The title, and the result in a few words. Titles of the source report have none."""
        if self.source:
            return self.title
        said = self.headline or self._agreement(numbers, panel_label)
        mark = "," if ":" in self.title else ":"
        return f"{self.title}{mark} {said}" if said else self.title

    def add_mean_course(self, index: int, point: Point, curves: Sequence[Course]) -> Course:
        """`add_means` of curves that have times of their own, at common times."""
        times, rows = remaining(curves)
        self.add_means(index, self.label(point), times, rows)
        kept = lasting(curves)
        self.brief[index] = len(curves) - len(kept)
        return at_common_times(kept)

    def add_means(
        self, index: int, label: str | None, x: Array, rows: Array, style: LineStyle = MEASURED
    ) -> Course:
        """Add the mean of rows (*n*, *x*) of the repeats, the band of its error, and the repeats.

        A row is nan where its repeat has ended: the mean goes on with those that remain, with a gap
        if it jumps. Where fewer than half remain it is thin. Near the end of all it ends where it
        would be thin or jump.

        Returns the rows of which results are: `lasting`.
        """
        kept = self.lasting(index, x, rows)
        ends = x[last_known(rows)]
        few = int(np.argmax(2 * np.sum(ends[:, np.newaxis] >= x, axis=0) < len(rows))) or len(x)
        if x[few - 1] >= EARLY * x[-1]:  # a few that last a bit longer show no more
            x, rows = x[:few], rows[:, :few]
        mean, error = mean_of_remaining(rows)
        # Where a repeat ends, a mean of few others may jump, which is no event of the gas.
        known = np.isfinite(rows[:, 1:])
        before = mean_of_remaining(np.where(known, rows[:, :-1], math.nan))[0]
        steps = np.abs(before - mean[:-1])
        late = 1 + np.flatnonzero((steps > error[:-1] / 4) & (x[1:] >= EARLY * x[-1]))
        until = int(late[0]) if len(late) else len(x)
        x, rows, mean, error = (column[..., :until] for column in (x, rows, mean, error))
        few, jumps = min(few, until), 1 + np.flatnonzero(steps[: until - 1] > error[:-1] / 2)
        few += int(np.count_nonzero(jumps < few))
        times = np.insert(x, jumps, x[jumps])
        mean, error = (np.insert(column, jumps, math.nan) for column in (mean, error))
        self.lines.append(Line(times[:few], mean[:few], label, index, style))
        if few < len(times):
            thin = times[few - 1 :], mean[few - 1 :]
            self.lines.append(Line(*thin, None, index, style, thin=True))
        if len(rows) > 1:
            self.averaged = True
            if self.source or len(self.points) <= MOST_BANDS:
                self.bands.append(Band(times, mean - error, mean + error, None, index))
            if style == MEASURED:
                self.singles.append(Repeats(x, rows, None, index))
        self.note_remaining(ends, float(x[-1]))
        return kept

    def for_panel(self) -> "FigureBuilder":
        """A builder that collects the lines of a panel of this figure; see `as_panel`."""
        return replace(self, lines=[], bands=[], singles=[], brief={})

    def as_panel(self, label: str, *behind: Layer, log: bool = False) -> Panel:
        """The lines as a panel, on these layers. Its legend is that of the figure."""
        return Panel((*behind, *self.shown_singles(), *self.bands, *self.lines), label, log)

    def lasting(self, index: int, x: Array, rows: Array) -> Course:
        """`lasting_rows` of a series, while the caption counts the repeats that these leave out."""
        kept = lasting_rows(x, rows)
        self.brief[index] = max(self.brief.get(index, 0), len(rows) - len(kept[1]))
        return kept

    def note_remaining(self, ends: Array, end: float) -> None:
        """Let the caption say how many repeats remain at an end, if one ends long before it.

        ends : (*repeats*,)
        """
        if ends.min() < EARLY * end:
            left = int(np.count_nonzero(ends >= end)), len(ends)
            self.fewest = min(self.fewest, left, key=lambda pair: pair[0] / pair[1])

    def _remaining_sentence(self) -> str:
        """A sentence if the end of a mean course has fewer repeats than its beginning."""
        left, total = self.fewest
        if left == total:
            return ""
        few = any(isinstance(line, Line) and line.thin for line in self.lines)
        thin = "; a mean of fewer than half is thin" * few
        return f"Means go on with the repeats that remain, {left} of {total} at the end{thin}."

    def add_points(self, index: int, label: str | None, x: Array, rows: Array) -> None:
        """Add markers at the mean of rows (*n*, *x*) of the repeats, with standard errors."""
        mean, errors = rows.mean(axis=0), standard_errors(rows)
        self.lines.append(Points(x, mean, errors, label or "simulation", index))

    def add_residuals(
        self, index: int, x: Array, y: Array, error: Array, theory: Array, *, filled: bool = True
    ) -> None:
        """Add markers to the panel below: ln(y/theory), where both are known and have one sign.

        error : standard error of y, or of its difference from theory
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            known = np.isfinite(y / theory) & (y / theory > 0)
        x, y, error, theory = (column[known] for column in (x, y, error, theory))
        if len(x):
            self.panel.append(Points(x, np.log(y / theory), error / np.abs(y), None, index, filled))

    @property
    def covers_decades(self) -> bool:
        """Whether the lines cover more than a decade."""
        return more_than_a_decade(line.y for line in self.lines if isinstance(line, Line))

    def add_histogram(
        self, index: int, point: Point, edges: Array, heights: Array, errors: Array
    ) -> None:
        """Add the outline of bins between edges (*n* + 1,), and the band of their errors."""
        x, y, error = np.append(edges[0], edges), np.pad(heights, 1), np.pad(errors, 1)
        self.lines.append(Line(x, y, self.label(point), index, steps=True))
        if np.isfinite(errors).all():
            self.bands.append(Band(x, y - error, y + error, None, index, steps=True))

    def shown_singles(self) -> list[Repeats]:
        """An even choice of the single repeats of each series, as many as a figure can show."""
        each = MOST_SINGLE // max(1, len(self.singles))
        return [
            replace(layer, rows=layer.rows[even_choice(len(layer.rows), each)])
            for layer in self.singles
            if each > 1
        ]

    def _means_sentence(self, singles: bool) -> str:
        """A sentence on means over the repeats, their bands, and the repeats, if they are drawn."""
        if self.errors or not any(band.label is None for band in self.bands):
            return "Lines: means over the repeats." if self.averaged else ""
        thin = "; thin: single repeats" * singles
        return f"Bold: means over the repeats{thin}; bands: standard errors."

    def _axes(self, others: Mapping[str, Any]) -> dict[str, Any]:
        """Two logarithmic axes if the series span more than two decades of both; else none.

        The figures of the source report keep theirs.
        """
        begins = beginning_of_decades(self.lines)
        if self.source or begins is None or {**self.fields, **others}.get("x_log"):
            return {}
        limits = {"x_limits": (begins, None), "y_limits": (None, None)}
        return {"x_log": True, "y_log": True, **limits}

    def _series_styles(self, series: Sequence[Point], labels: set[str | None]) -> dict[str, Any]:
        """The fields of ``FigureData`` for the colours of series and their names.

        labels : of all layers of the series
        """
        both = two_keys(series)
        if both is None:
            label, values = scale(series)
            names = {described(point, key) for point in series for key in varying(series)}
            named = {"scale": values, "scale_label": label} if labels <= names else {}
            return {"shades": ranks(series), **named}
        named = {}
        if both.hue_names and labels <= {self.label(point, series) for point in series}:
            named = {"hue_names": both.hue_names, "scale": both.shade_names}
        return {"shades": both.shades, "hues": both.hues, **named}

    def _named(self, name: str) -> list[Layer]:
        """The lines; if they are of one series that no label names, its first one has this name."""
        series = [line for line in self.lines if _owner(line) != NEUTRAL]
        unnamed = not any(line.label for line in series) and len(set(map(_owner, series))) == 1
        if not unnamed or not isinstance(series[0], Line):  # markers are explained by neutral ones
            return self.lines
        entries = [line for line in self.lines if isinstance(line, Line) and not len(line.x)]
        if any(entry.style == MEASURED for entry in entries):  # what solid lines are
            return self.lines
        return [replace(line, label=name) if line is series[0] else line for line in self.lines]

    def figure(
        self,
        caption: str = "",
        *,
        numbers: Mapping[str, Any] | None = None,
        logarithmic: bool = False,
        **others: Any,
    ) -> FigureData:
        """The figure: bands, and lines on them.

        caption : what is drawn, beside the title, the axes and the legend; results are `numbers`
        logarithmic : whether its curves cover more than a decade
        others : fields of ``FigureData`` that depend on the run
        """
        if logarithmic:
            others = {"y_log": True, "y_limits": (None, None)} | others
        others = self._axes(others) | others
        singles = self.shown_singles()
        layers: Sequence[Layer] = [*singles, *self.bands, *theories_once(self._named("simulation"))]
        if self.panel:
            panel = (Reference("y", 0.0), *self.panel)
            others = {"panel": panel, "panel_label": OVER_THEORY} | others
        owners = {_owner(layer) for layer in layers} - {NEUTRAL}
        series = [group[0] for group in self.groups] if self.groups[1:] else self.groups[0]
        if owners == set(range(len(series))):
            labels = {layer.label for layer in layers if _owner(layer) != NEUTRAL}
            others = self._series_styles(series, labels - {None}) | others
        if len(owners) == 1:  # entries of the legend alone have the colour of the only series
            (owner,) = owners
            layers, others = _in_all_axes(layers, others, partial(_with_owner, owner=owner))
        if (len(self.points) == 1 or len(owners) == 1) and not self.source:
            layers, others = _in_all_axes(layers, others, theories_last)
        errors = [layer.y_error for layer in layers if isinstance(layer, Points)]
        barred = any(error is not None and np.isfinite(error).any() for error in errors)
        limits = others.get("y_limits", self.fields.get("y_limits", (None, None)))
        axes = [{**self.fields, **others}[f"{axis}_label"] for axis in "xy"]
        text = Caption(
            shows=[self.shows],
            result=[
                self._result_sentence(numbers or {}),
                caption,
                self._largest_deviation(others.get("panel_label", ""), axes[0]),
            ],
            theory=[
                theory_sentence(self.cited),
                "Theory fails where the mean free path exceeds the container." if self.thin else "",
            ],
            drawn=[
                self._arrows_sentence(limits[1]),
                self.errors or BARS * barred,
                ENERGIES * any("temperature" in axis and "(J)" in axis for axis in axes),
                self._means_sentence(bool(singles)),
                self._remaining_sentence(),
                self._left_out(),
            ],
            scene=[setting(self.run, self.points, self.selection), self._choice()],
        ).text
        return FigureData(
            layers=tuple(layers),
            caption=text,
            numbers={
                **(numbers or {}),
                **deviations(self.panel),
                **({"points": self.records} if self.records else {}),
            },
            result=self.result.as_json() if self.result else {},
            **{
                **self.fields,
                "title": self._title_with_result(numbers or {}, others.get("panel_label", "")),
                **others,
            },
        )


def _joined(point: Point, keys: Iterable[str]) -> str:
    """A point's values of keys in words, but for keys that it does not have."""
    return ", ".join(filter(None, (described(point, key) for key in keys)))


def _owner(layer: Layer) -> int:
    """The series of a layer."""
    return getattr(layer, "series", NEUTRAL)


def _in_all_axes(
    layers: Sequence[Layer],
    others: Mapping[str, Any],
    change: Callable[[Sequence[Layer]], tuple[Layer, ...]],
) -> tuple[Sequence[Layer], dict[str, Any]]:
    """The layers, and the fields with those of the panels, all with a change."""
    panels = [replace(panel, layers=change(panel.layers)) for panel in others.get("panels", ())]
    panel = change(others.get("panel", ()))
    return change(layers), {**others, "panel": panel, "panels": tuple(panels)}


def _with_owner(layers: Sequence[Any], owner: int) -> tuple[Layer, ...]:
    """The layers; those that are entries of the legend alone belong to this series."""
    return tuple(
        layer if np.size(getattr(layer, "x", 0)) else replace(layer, series=owner)
        for layer in layers
    )


SAME_CURVE = 1e-3  # share of y by which curves of theory differ that a reader cannot tell apart
COMPARED_AT = 50  # places where they are compared


def theories_once(layers: Sequence[Layer]) -> list[Layer]:
    """The layers, and of curves of theory that several series share only the longest.

    A curve of theory has a dash pattern of its own. If it belongs to several series, it has the
    colour of none.
    """
    kept: list[Layer] = []
    for layer in layers:
        for place, other in enumerate(kept):
            if isinstance(layer, Line) and isinstance(other, Line) and _same_curve(layer, other):
                longest = max(layer, other, key=lambda line: float(np.ptp(line.x)))
                kept[place] = replace(longest, series=NEUTRAL)
                break
        else:
            kept.append(layer)
    return kept


def theories_last(layers: Sequence[Layer]) -> tuple[Layer, ...]:
    """The layers of a figure of one series, with its theory on its points and in another colour.

    A second series of such a figure is a second quantity or a second law, and keeps its colour.
    """
    theory = [
        layer
        for layer in layers
        if isinstance(layer, Line) and layer.style in (BY_THEORY, EXTRAPOLATED)
    ]
    own = [replace(line, series=line.series or NEUTRAL) for line in theory]
    return (*(layer for layer in layers if layer not in theory), *own)


def _same_curve(line: Line, other: Line) -> bool:
    """Whether these are curves of theory with one dash pattern that coincide where both are."""
    if line.style == MEASURED or min(len(line.x), len(other.x)) < 2:
        return False
    if line.style != other.style or line.label != other.label or line.series == other.series:
        return False
    low, high = max(line.x[0], other.x[0]), min(line.x[-1], other.x[-1])
    if not low < high:
        return False
    x = np.linspace(low, high, COMPARED_AT)
    y, other_y = np.interp(x, line.x, line.y), np.interp(x, other.x, other.y)
    return bool(np.allclose(y, other_y, rtol=SAME_CURVE, atol=0.0))
