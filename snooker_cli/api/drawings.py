"""Figures of a run as files, and which figures a run can give."""

import logging
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from snooker_cli import options
from snooker_cli.analysis.quantities import QUANTITIES
from snooker_cli.analysis.run_analysis import shorter_note
from snooker_cli.api.arguments import TIMES_NEEDED, times_given
from snooker_cli.api.output_files import own_output
from snooker_cli.api.results import SavedFigure, first
from snooker_cli.errors import ArgumentError, ArgumentTypeError, FigureError, UserError, check_name
from snooker_cli.figures.figure_data import FigureData, with_logarithmic_axes
from snooker_cli.figures.registry import FIGURES, figures_of, former_names, own_figures, possible
from snooker_cli.figures.series import MOST_SERIES
from snooker_cli.formatting import listed, point_label, short, text_table, with_error
from snooker_cli.runs import RunFolder
from snooker_cli.runs.folder import writing
from snooker_cli.runs.progress import reporting
from snooker_cli.runs.selection import Selection, begun, matching, selected, unfinished
from snooker_cli.runs.status import early_warning

FORMATS = ("svg", "png", "pdf")
SNAPSHOT = "snapshot"  # the figure of states
MOST_PIXELS = 10_000  # of a side of a PNG, which then takes 400 MB of memory

_log = logging.getLogger(__name__)


def check_names(names: Iterable[str]) -> None:
    """Raise ``UserError`` for a name that no figure has."""
    former = former_names()
    for name in names:
        if name in former:
            raise ArgumentError(f"the figure {name} is now part of {former[name]}; give that name")
        check_name(name, FIGURES, "figure", options.FIGURE_NAMES)


def possible_figures(
    run: RunFolder, names: Sequence[str], selection: Selection
) -> list[dict[str, Any]]:
    """What ``Run.possible_figures`` returns."""
    check_names(names)
    points = begun(run, selection)
    return [
        {
            "figure": name,
            "title": FIGURES[name].title,
            "possible": fits,
            "left_out": [_left_out(name, *reason, len(points), fits) for reason in why.items()],
        }
        for name, fits, why in possible(dict.fromkeys(names or own_figures()), points)
    ]


def save_figures(
    run: RunFolder,
    names: Sequence[str],
    out: Path | None,
    selection: Selection,
    *,
    formats: Sequence[str],
    size: str | Sequence[float] | None,
    dpi: int | None,
    logarithmic: tuple[bool, bool],
    saved: Callable[[SavedFigure], None],
) -> list[SavedFigure]:
    """What ``Run.save_figures`` does."""
    check_names(names)
    if not set(formats) <= set(FORMATS):
        raise ArgumentError(
            f"{options.FORMATS.of(','.join(formats))}: give svg, png or pdf, or several with commas"
        )
    how = formats, _inches(size, dpi), dpi
    wanted = list(dict.fromkeys(names or own_figures()))
    _warn_of_missing(run, selection)
    most = None if names or selection.where else MOST_SERIES
    drawn: list[SavedFigure] = []
    impossible: Counter[tuple[str, str]] = Counter()
    for name, stem, made in _with_progress(run, wanted, selection, most):
        figure = _with_axes(made, *logarithmic)
        if isinstance(figure, FigureError):
            impossible[name, str(figure)] += 1
            continue
        folder = own_output(run.figures_folder) if out is None else out
        files = _save(figure, folder / stem, *how)
        drawn.append(SavedFigure(name, files, figure.caption, _table(figure)))
        saved(drawn[-1])
    names_drawn = list(dict.fromkeys(figure.name for figure in drawn))
    single = [name for name in names_drawn if FIGURES[name].each_point]
    if most and single and len(run.points) > most:
        rest = f"{options.WHERE} or names of figures draw the others"
        few = f"{listed(single)}: drawn for {most} of {len(run.points):,} points, evenly chosen"
        _log.warning("%s; %s", few, rest)
    if names or not drawn:
        for (name, reason), times in impossible.items():
            others = name in names_drawn
            _log.warning("%s", _left_out(name, reason, times, len(run.points), others))
    missing = [name for name in wanted if name not in names_drawn]
    if missing and (names or not drawn):
        raise UserError(f"{run.name} cannot give {', '.join(missing)}; see the reasons above")
    return drawn


def of_states(
    names: Sequence[str], times: str | Sequence[float] | None, colour: str | None
) -> tuple[tuple[float, ...], str | None]:
    """The times (s) and the colours of a figure of states. Raises ``UserError``."""
    for option, given in (
        (options.TIMES, times is not None and len(times) > 0),
        (options.COLOUR, colour is not None),
    ):
        if given and SNAPSHOT not in names:
            raise UserError(f"{option} is for the figure {SNAPSHOT}; name it, or leave this out")
    if colour is not None:
        from snooker_cli.figures.snapshot import COLOURS

        if colour not in COLOURS:
            raise ArgumentError(f"{options.COLOUR.of(colour)}: give {' or '.join(COLOURS)}")
    if isinstance(times, str):
        times = times_given(times, options.TIMES).tolist()
    try:
        return tuple(map(float, () if times is None else times)), colour
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{options.TIMES}: {TIMES_NEEDED}") from None


def _with_progress(
    run: RunFolder, names: list[str], selection: Selection, most: int | None
) -> Iterator[tuple[str, str, FigureData | FigureError]]:
    """``figures_of``, while a terminal shows which repeat is read."""
    figures = figures_of(run, names, selection, lambda text: show(text), most)
    while True:
        with reporting() as show:  # not while lines are printed
            figure = next(figures, None)
        if figure is None:
            return
        yield figure


def _with_axes(figure: FigureData | FigureError, x: bool, y: bool) -> FigureData | FigureError:
    """The figure with logarithmic axes, or why it has none."""
    if isinstance(figure, FigureError):
        return figure
    try:
        return with_logarithmic_axes(figure, x, y)
    except FigureError as error:
        return error


def _left_out(name: str, reason: str, times: int, total: int, others: bool) -> str:
    """Why a figure is missing; ``others`` if it is there for other points."""
    where = f" at {times:,} of {total:,} points" if others else ""
    return f"{name} left out{where}: {reason}"


def _save(figure: FigureData, stem: Path, *how: Any) -> tuple[Path, ...]:
    from snooker_cli.figures.drawing import save  # loads matplotlib

    with writing(stem.parent):
        return tuple(save(figure, stem, *how))


def _warn_of_missing(run: RunFolder, selection: Selection) -> None:
    """Warn of repeats that are missing or shorter than the extended run, and of early ends."""
    wanted = matching(run, selection)
    with reporting() as show:
        for number, point in enumerate(wanted, 1):
            show(f"reading the files of point {number:,} of {len(wanted):,}")
            run.statuses(point.index)  # which stay in memory
    points = selected(run, selection)
    if missing := unfinished(run, selection):
        _log.warning("%s; run the config again for the rest", missing)
    present = sum(len(run.present(point)) for point in points)
    for sentence in (
        shorter_note(sum(map(run.shorter, points)), present),
        early_warning(run, points),
    ):
        if sentence:
            _log.warning("%s", sentence)


def _table(figure: FigureData) -> tuple[str, ...]:
    """The declared result of several points beside its theory, as a table.

    The caption has that of one. All numbers are in the JSON file.
    """
    rows: Sequence[Mapping[str, Any]] = figure.numbers.get("points", [])
    if not figure.result or len(rows) < 2 or figure.result["number"] in figure.numbers:
        return ()
    number, theory, unit = (figure.result[name] for name in ("number", "theory", "unit"))
    varying = [
        key for key in rows[0]["parameters"] if len({str(r["parameters"][key]) for r in rows}) > 1
    ]
    symbol = QUANTITIES[figure.result["quantity"]].symbol
    headings = ["point", ", ".join(filter(None, [f">{symbol}", unit])), ">theory"]
    table = [
        [
            _row_label(row, varying),
            with_error(row.get(number), row.get(f"{number}_error")),
            short(row.get(theory), 4),
        ]
        for row in rows
    ]
    columns = 2 + any(row.get(theory) is not None for row in rows)
    lines = text_table(headings[:columns], [cells[:columns] for cells in table])
    return tuple(first(lines, noun=" points in the JSON file", rest=""))


def _row_label(row: Mapping[str, Any], keys: Sequence[str]) -> str:
    """The point of a row by these keys, and its species if it is of one."""
    species, parameters = row.get("species"), {key: row["parameters"][key] for key in keys}
    if not isinstance(species, str):
        return point_label(parameters)
    return f"{point_label(parameters)}, {species}" if parameters else species


def _inches(size: str | Sequence[float] | None, dpi: int | None) -> tuple[float, float] | None:
    """Width and height of a figure. Raises ``UserError``."""
    if size is None:
        return None
    text = size if isinstance(size, str) else "x".join(map(str, size))
    match = re.fullmatch(r"(\d*\.?\d+)x(\d*\.?\d+)", text)
    sides = (float(match[1]), float(match[2])) if match else None
    if sides is None or not all(1.5 <= side <= 50 for side in sides):
        raise ArgumentError(
            f"{options.SIZE.of(text)}: give width and height from 1.5 to 50 inches, as in 6x4"
        )
    if dpi and max(sides) * dpi > MOST_PIXELS:
        raise ArgumentError(
            f"{options.SIZE.of(text)} {options.DPI.of(dpi)}: "
            f"give at most {MOST_PIXELS:,} pixels a side"
        )
    return sides
