"""What one can ask of the points of a run, and of runs side by side: numbers, figures and films."""

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, product
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from snooker_cli import options, runs
from snooker_cli.api.arguments import with_options
from snooker_cli.api.results import Records, SavedFigure
from snooker_cli.config import Point
from snooker_cli.errors import ArgumentTypeError, FigureError, UserError, check_name
from snooker_cli.formatting import counted, point_label
from snooker_cli.runs.progress import counting
from snooker_cli.runs.selection import (
    Selection,
    chosen_values,
    file_stem,
    matching,
    unfinished,
    unlisted,
    with_runs,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure  # loaded only if it is needed

    from snooker_cli.analysis.run_analysis import RunAnalysis
    from snooker_cli.animation import Film
    from snooker_cli.animation.film import Pace
    from snooker_cli.api.repeats import Repeat

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class AnalysedRun(runs.RunFolder):
    """Points with their repeats, and the analyses and figures that scripts use.

    ``run[point, repeat]`` is a repeat, and ``for repeat in run`` gives all of them. One file is in
    memory at a time: a long repeat, or a batch of short ones.
    """

    def __repr__(self) -> str:
        size = f"{counted(len(self.points), 'point')}, {counted(self.config.repeats, 'repeat')}"
        return f"<run {self.name}: {size} each>"

    def __getitem__(self, place: tuple[int, int]) -> "Repeat":
        """A repeat, by its point and number. Raises ``PlaceError`` or ``StoreError``."""
        if not isinstance(place, tuple) or len(place) != 2:
            raise ArgumentTypeError(f"run[{place!r}]: give a point and a repeat, as in run[0, 3]")
        from snooker_cli.api.repeats import Repeat

        point = self.chosen(*place)
        return Repeat(self.read(point, place[1]), point, place[1])

    def __iter__(self) -> "Iterator[Repeat]":
        """All repeats that are there, point after point. Raises ``StoreError``."""
        return chain.from_iterable(self.repeats(point.index) for point in self.points)

    def __len__(self) -> int:
        """The number of repeats that are there, of all points."""
        return sum(len(self.present(point)) for point in self.points)

    def __bool__(self) -> bool:
        """True: a run without repeats is a run."""
        return True

    def repeats(self, point: int) -> "Iterator[Repeat]":
        """The repeats of a point that are there. Raises ``UserError`` or ``StoreError``."""
        from snooker_cli.api.repeats import Repeat

        chosen = self.chosen(point, 0)
        numbers = self.present(chosen)
        traces = self.traces(chosen, numbers) if numbers else ()
        return (Repeat(trace, chosen, k) for k, trace in zip(numbers, traces, strict=True))

    # Which points.

    def where(self, *conditions: str) -> dict[str, Any]:
        """Keywords for ``matching`` from texts: ``"cor>0.8"``, ``"cor=0.7:0.9"``, ``"cor=0.8,1"``.

        ``run.table(**run.where("cor>0.8"))`` has the points with these values. Raises
        ``UserError``, and ``FigureError`` for a key that the config does not have.
        """
        return chosen_values(self, conditions)

    @with_options()
    def matching(self, **where: Any) -> tuple[Point, ...]:
        """The points with these values: ``cor=0.8``, ``cor=[0.8, 0.9]``, ``**{"balls.radius": 1}``.

        Raises ``FigureError`` if there is none.
        """
        return matching(self, Selection(_alternatives(where)))

    # Numbers.

    @with_options()
    def table(self, **where: Any) -> dict[str, NDArray[Any]]:
        """Columns with a row for each repeat that is there: ``pandas.DataFrame(run.table())``.

        where : only points with these values, as in ``matching``

        ``point``, the swept keys (nan for null), ``repeat``; ``ending`` as ``show`` has it and
        ``complete``; ``time`` (s) and numbers of ``collisions``, of which ``wall_collisions`` are
        with the wall and ``pair_collisions`` between balls. ``temperature`` (J), ``pressure``
        (Pa m) and ``mean_speed`` (m/s) are means over the time of the repeat. ``energy_ratio`` is
        the energy at the end over that at the start. ``k`` and ``alpha`` (1/s) are fits to the
        energy: the constants of exp(−kt) and of Haff's law; nan without a fit. Where walls give
        energy, ``wall_energy`` and ``lost_energy`` (J) are what they gave and what collisions
        between balls took, and ``stationary_from`` (s) is when the stationary part begins, in the
        complete repeats of a point that has one; otherwise these are nan. With rough balls there
        is ``rotational_temperature`` (J), twice the mean energy of a spin. A swept key with the
        name of another column gets the prefix ``config.``. Raises ``FigureError``,
        ``StoreError``, and ``RunError`` if no repeat is there.
        """
        from snooker_cli.api.exports import table_of

        return table_of(self, self.matching(**where))

    @with_options(options.FIT_SINCE, options.FIT_UNTIL, options.QUANTITY, options.MODEL)
    def fit(
        self,
        since: float = 0.0,
        until: float | None = None,
        *,
        quantity: str | Sequence[str] = (),
        model: str | Sequence[str] = (),
        **where: Any,
    ) -> Records:
        """The records of ``snooker fit --json``.

        where : only points with these values, as in ``matching``

        ``print`` shows them as tables. Raises ``RunError``, ``FigureError`` or ``UserError``.
        """
        from snooker_cli.analysis.decay import JUDGEMENT, SAMPLING
        from snooker_cli.analysis.run_analysis import fits

        points = self.matching(**where)
        end = math.inf if until is None else until
        analysis = fits(self, since, end, points, counting)
        return self._records(analysis, (SAMPLING, JUDGEMENT), quantity, model, where)

    @with_options(options.QUANTITY, options.MODEL)
    def compare(
        self,
        *,
        quantity: str | Sequence[str] = (),
        model: str | Sequence[str] = (),
        **where: Any,
    ) -> Records:
        """The records of ``snooker compare --json``.

        where : only points with these values, as in ``matching``

        ``print`` shows them as tables. Raises ``RunError``, ``FigureError`` or ``UserError``.
        """
        from snooker_cli.analysis.run_analysis import comparisons
        from snooker_cli.analysis.tables import MORE_COMPARED, PAIRED

        analysis = comparisons(self, self.matching(**where), counting)
        footer, states = (f"{PAIRED} {options.ALL} {MORE_COMPARED}",), analysis.states
        return self._records(analysis, footer, quantity, model, where, states)

    @with_options()
    def finding(self, **where: Any) -> str:
        """What holds, in sentences: the main results beside theory, as reports begin.

        where : only points with these values, as in ``matching``

        Of several points it is about all of them. ``print(run.compare().text(brief=True))`` has a
        line for each. Raises ``RunError`` or ``FigureError``.
        """
        from snooker_cli.analysis.findings import Findings
        from snooker_cli.analysis.run_analysis import comparisons, fits

        points = self.matching(**where)
        fitted = fits(self, points=points, counting=counting)
        compared = comparisons(self, points, counting)
        findings = Findings(fitted.rows, compared.rows, compared.states)
        return findings.overview if points[1:] else findings.at_point(findings.labels[0])

    def _records(
        self,
        analysis: "RunAnalysis",
        footer: Sequence[str],
        quantity: str | Sequence[str],
        model: str | Sequence[str],
        where: Mapping[str, Any],
        states: Sequence[dict[str, Any]] = (),
    ) -> Records:
        """An analysis of the points with some values, and of quantities and models by name."""
        from snooker_cli.runs.status import early_warning

        points = self.matching(**where)
        others = [f"T{text[1:]}." for text in [unlisted(self)] if text]
        records = Records(
            analysis.rows,
            analysis.notes,
            points=len(points),
            states=states,
            footer=() if where else (*footer, *others),
            unfinished=unfinished(self, Selection(_alternatives(where))),
            warning=early_warning(self, points),
        )
        return records.only(several(quantity), several(model)) if quantity or model else records

    # Figures, films and pages.

    @with_options(
        *(options.REPEAT, options.TIMES, options.COLOUR, options.LOG_X, options.LOG_Y),
    )
    def plot(
        self,
        name: str,
        *,
        repeat: int | None = None,
        times: str | Sequence[float] | None = None,
        colour: str | None = None,
        log_x: bool = False,
        log_y: bool = False,
        **where: Any,
    ) -> "Figure":
        """A figure by its name in ``snooker plot --list``, as matplotlib's ``Figure``.

        where : only points with these values, as in ``matching``; a figure of one point, such as
            "snapshot", shows the first of them and names it in its title

        ``colour="density"`` shows the packing around each ball. A logarithmic axis has no zeros.
        Raises ``FigureError`` if the run cannot give it.
        """
        from snooker_cli.api.drawings import of_states
        from snooker_cli.figures.drawing import draw
        from snooker_cli.figures.figure_data import with_logarithmic_axes
        from snooker_cli.figures.registry import FIGURES

        check_name(name, FIGURES, "figure", options.FIGURE_NAMES)
        chosen = Selection(_alternatives(where), repeat, *of_states([name], times, colour))
        made = FIGURES[name].make(self, chosen, first=True)
        return draw(with_logarithmic_axes(made, log_x, log_y))

    @with_options(options.REPEAT)
    def possible_figures(
        self, *names: str, repeat: int | None = None, **where: Any
    ) -> list[dict[str, Any]]:
        """Which figures the config allows: ``figure``, ``title``, ``possible``, ``left_out``.

        names : of ``snooker.figure_list``; all by default
        where : as of ``plot``

        ``left_out`` has the reasons, as sentences. No repeat is read: a figure may still need more
        collisions than there are. Raises ``FigureError`` if no repeat is there.
        """
        from snooker_cli.api.drawings import possible_figures

        return possible_figures(self, names, Selection(_alternatives(where), repeat))

    @with_options(
        *(options.FIGURES_OUT, options.SIZE, options.DPI, options.LOG_X, options.LOG_Y),
        *(options.REPEAT, options.TIMES, options.COLOUR),
    )
    def save_figures(
        self,
        *names: str,
        out: str | PathLike[str] | None = None,
        formats: Sequence[str] = ("svg", "png"),
        size: str | Sequence[float] | None = None,
        dpi: int | None = None,
        log_x: bool = False,
        log_y: bool = False,
        repeat: int | None = None,
        times: str | Sequence[float] | None = None,
        colour: str | None = None,
        saved: Callable[[SavedFigure], None] = lambda _: None,
        **where: Any,
    ) -> list[SavedFigure]:
        """Draw figures, and save them with their numbers as JSON; what was saved.

        names : of ``snooker.figure_list``; by default all that are possible
        formats : of ``"svg"``, ``"png"`` and ``"pdf"``
        where : as of ``plot``; figures of one point are drawn for each
        saved : is called after each figure

        Raises ``UserError`` for a figure that was named and cannot be drawn, after all others.
        """
        from snooker_cli.api.drawings import of_states, save_figures

        return save_figures(
            self,
            names,
            None if out is None else Path(out),
            Selection(_alternatives(where), repeat, *of_states(names, times, colour)),
            formats=formats,
            size=size,
            dpi=dpi,
            logarithmic=(log_x, log_y),
            saved=saved,
        )

    @with_options(options.SINCE, options.UNTIL, options.COLLISIONS)
    def films(
        self,
        repeats: Sequence[int] = (0,),
        /,
        since: float = 0.0,
        until: float | None = None,
        most: int | None = None,
        **where: Any,
    ) -> "list[Film]":
        """Films of repeats of the points with these values, for ``animation.save_films``.

        where : as in ``matching``

        A summary is simulated again. Raises ``FigureError``, and ``UserError`` for a repeat that
        cannot be shown.
        """
        from snooker_cli.animation import MOST_COLLISIONS, film, with_events

        films = []
        for point, number in product(self.matching(**where), repeats):
            trace = self[point.index, number].trace
            parameters = {"cor": f"{trace.start.restitution:g}"} | dict(point.parameters)
            balls = counted(trace.start.number, "ball")
            subtitle = f"{point_label(parameters)}, {balls}, repeat {number}"
            span = since, until, most or MOST_COLLISIONS
            try:
                if trace.summary is not None and not self.can_be_replayed:
                    raise FigureError(
                        "is a summary of another engine version, which cannot be replayed"
                    )
                trace = with_events(trace, since, span[2])
                run, _ = self.origin(point)
                films.append(film(trace, run.config.title or run.name, subtitle, *span))
            except FigureError as error:
                raise UserError(f"repeat {number} of {self.name} {error}") from None
        return films

    @property
    def _first(self) -> dict[str, Any]:
        """What chooses the first point; of runs side by side that of each run."""
        return dict(self.points[0].parameters)

    @with_options(
        *(options.FILM_OUT, options.SINCE, options.UNTIL, options.COLLISIONS, options.PACE),
        *(options.SECONDS, options.FPS),
    )
    def animate(
        self,
        out: str | PathLike[str] | None = None,
        repeats: Sequence[int] | None = None,
        /,
        *,
        since: float = 0.0,
        until: float | None = None,
        most: int | None = None,
        pace: "Pace" = "time",
        seconds: float | None = None,
        fps: int | None = None,
        replace: bool = True,
        **where: Any,
    ) -> Path:
        """Write a film of repeats: a page, a GIF or an MP4; its file.

        repeats : their numbers [the first]; a page shows up to 4 films
        replace : also a file that is not a page of snooker; else such a file raises ``UserError``
        where : as in ``matching`` [the first point]

        Raises as ``films``, and ``UserError`` if no such file can be written.
        """
        from snooker_cli.animation import MOST_COLLISIONS, check_film_file, save_films
        from snooker_cli.api.output_files import check_free

        numbers = sorted(set(repeats or [0]))
        self.chosen(None, numbers[-1])  # raises for a repeat that cannot be
        chosen = _alternatives(where) or self._first
        parts = with_runs(chosen, self.points) | ({"repeat": tuple(numbers)} if repeats else {})
        path = Path(out or self.directory / f"{file_stem('film', Selection(parts))}.html")
        is_page = path.suffix.lower() == ".html"
        if fps is not None and is_page:
            raise UserError(
                f"{options.FPS} is for a GIF or an MP4", "the browser chooses it for a page"
            )
        check_film_file(path, len(self.matching(**chosen)) * len(numbers))
        if is_page and not self.can_be_replayed:
            raise UserError(
                f"{self.name} holds results of engine version {self.engine_version}, which a page "
                "of this version cannot simulate again",
                "give a name that ends in .gif or .mp4",
            )
        check_free(path, replace)
        limit = most or MOST_COLLISIONS
        films = self.films(numbers, since=since, until=until, most=limit, **chosen)
        for film in films if most is None else ():
            if film.left_out:
                ways = f"{options.SINCE}, {options.UNTIL} and {options.COLLISIONS} choose others"
                span = f"{len(film):,} collisions, at {film.end:.6g} s"
                _log.warning("the film of %s ends after %s; %s", film.subtitle, span, ways)
        save_films(path, films, given=out is not None, pace=pace, seconds=seconds, rate=fps or 20)
        return path


def several(names: str | Sequence[str]) -> Sequence[str]:
    """One name or several, as several."""
    return [names] if isinstance(names, str) and names else names


def _alternatives(where: Mapping[str, Any]) -> dict[str, Any]:
    """The conditions of a selection, which has a tuple for a choice of values."""
    return {key: tuple(to) if isinstance(to, list) else to for key, to in where.items()}
