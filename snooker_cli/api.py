"""The Python interface: ``import snooker_cli as snooker``, then ``run``, ``open`` or ``simulate``.

Units are SI with k_B = 1. Everything that a user can get wrong raises a ``SnookerError``.
"""

import html
import json
import math
import re
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import chain, product
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli import config as configs
from snooker_cli import engine, export, runs
from snooker_cli.config import Point
from snooker_cli.containers import Container
from snooker_cli.engine import States
from snooker_cli.errors import (
    IN_COMMAND,
    FigureError,
    RunError,
    SnookerError,
    UserError,
    check_name,
)
from snooker_cli.files import own_folder, write_text
from snooker_cli.formatting import counted, plain, point_label
from snooker_cli.laws import is_random
from snooker_cli.pages.html_page import in_notebook
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import starting_state
from snooker_cli.runs.execution import processors
from snooker_cli.runs.plan import checked
from snooker_cli.runs.progress import counting, execute_watched, share_done, showing_notices
from snooker_cli.runs.status import ended, run_status
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Stop, Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure  # loaded only if it is needed

    from snooker_cli.animation import Film

Records: TypeAlias = list[dict[str, Any]]
Result = TypeVar("Result")

UNITS = {"time": "s", "temperature": "J", "pressure": "Pa m", "mean_speed": "m s-1"}
UNITS |= {"k": "s-1", "alpha": "s-1"}
UNITS |= {"wall_energy": "J", "lost_energy": "J", "stationary_from": "s"}
"""Of the columns of ``Run.table`` that have one."""


ARGUMENTS = {
    "--controls": "controls",
    "--language": "language",
    "--fresh": "fresh=True",
    "--from": "since",
    "--jobs": "jobs",
    "--out": "out=…",
    "--until": "until",
    "--where": "keywords, as in cor=0.8",
}
"""What Python has for the options of commands that errors of the package name."""


@contextmanager
def _in_python() -> Iterator[None]:
    """Inside, errors name arguments of Python, not options of commands."""
    try:
        yield
    except SnookerError as error:
        if IN_COMMAND.get():
            raise
        # A command in backticks is one that a user can give.
        parts = re.split("(`[^`]*`)", str(error))
        parts[::2] = (
            re.sub("--[a-z]+", lambda option: ARGUMENTS.get(option[0], option[0]), part)
            for part in parts[::2]
        )
        error.args = ("".join(parts),)
        raise


@dataclass(frozen=True, eq=False, repr=False)
class Repeat:
    """A repeat of a run, or a simulation without files.

    trace : all that is stored of it
    point, number : its point and its number there; ``None`` for a simulation without files
    """

    trace: Trace
    point: Point | None = None
    number: int | None = None

    @property
    def _name(self) -> str:
        if self.point is None:
            return "simulation"
        return f"repeat {self.number} of {point_label(self.point.as_json())}"

    def __repr__(self) -> str:
        return f"<{self._name}: {self.stop.message}>"

    @property
    def scene(self) -> Scene:
        """The scene at the start."""
        return self.trace.start

    @property
    def stop(self) -> Stop:
        """How it ended: ``reason``, ``time`` (s), ``balls`` and ``message``."""
        return self.trace.stop

    @property
    def parameters(self) -> dict[str, Any]:
        """The swept keys and their values; none without a sweep."""
        return {} if self.point is None else dict(self.point.parameters)

    @cached_property
    def events(self) -> "np.recarray[Any, Any]":
        """All collisions in order: ``time`` (s), ``i``, ``j`` and ``impulse`` (kg m/s).

        j is −1 for the container and −2 for a slide along the wall. Raises ``UserError`` for a
        repeat that was recorded as a summary.
        """
        return _records(export.events_table(self._recorded()))

    def states(self, times: ArrayLike) -> States:
        """Places and velocities at times (s, ascending), just after a collision at that time.

        The fields are ``time`` (*t*,), ``positions`` and ``velocities`` (*t*, *N*, 2), and
        ``container_positions`` and ``container_velocities`` (*t*, 2), in s, m and m/s. They have
        the bits of the simulation. Raises ``UserError`` for times that do not ascend within 0 and
        the end, and for a summary.
        """
        return self._replayed(lambda: engine.replay(self.trace, np.atleast_1d(times)))

    def series(self) -> "np.recarray[Any, Any]":
        """Observables at time zero and after each collision; a summary's on its grid of times.

        ``time`` (s), ``kinetic_energy`` and ``container_energy`` (J); since the start
        ``wall_impulse`` (kg m/s), ``pair_virial`` (impulse times distance, kg m²/s),
        ``wall_events`` and ``pair_events``; ``mean_speed`` (m/s), and ``energy_moment``,
        <k²>/<k>² of the balls' kinetic energies. If walls give energy, ``wall_energy`` and
        ``lost_energy`` (J) are what they gave and what collisions between balls took. Very long
        repeats give an even choice of rows.
        """
        from snooker_cli.analysis import time_series

        return _records(time_series.series(self.trace).columns)

    def measure(
        self,
        observable: Callable[[NDArray[np.float64], NDArray[np.float64], Scene], Any],
        times: ArrayLike,
    ) -> NDArray[Any]:
        """Your own observable at times (s, ascending); its results are stacked, (*t*, ...).

        observable : f(positions, velocities, scene), with (*N*, 2) arrays in m and m/s and the
            scene at that time: ``scene.masses``, ``scene.container``, ...; a number or an array

        Raises ``UserError`` as ``states`` does.
        """
        from snooker_cli.analysis import structure

        batches = self._replayed(lambda: engine.replayed(self.trace, np.atleast_1d(times)))
        values = (structure.of_states(observable, self.scene, states) for states in batches)
        return np.array(list(chain.from_iterable(values)))

    def state(self, time: float) -> Scene:
        """The scene at a time, s: ``simulate`` continues from it, after ``replace`` with other CoR.

        Raises ``UserError`` as ``states`` does.
        """
        at = self.states(time)
        return replace(
            self.scene,
            positions=at.positions[0],
            velocities=at.velocities[0],
            container_position=at.container_positions[0],
            container_velocity=at.container_velocities[0],
        )

    @_in_python()
    def animate(self, out: str | PathLike[str], **span: Any) -> Path:
        """Write an HTML page that plays the repeat; its file.

        span : ``since`` and ``until`` (s) and ``most`` collisions, as of ``animation.film``

        Raises ``FigureError`` for a summary, too many balls or a time outside of the repeat.
        """
        from snooker_cli.animation import film, page

        write_text(Path(out), page(film(self.trace, self._name, **span)), given=True)
        return Path(out)

    def _repr_html_(self) -> str | None:
        """Its film; a notebook shows ``repr`` where there is none."""
        from snooker_cli.animation import film, page

        with suppress(FigureError):
            return in_notebook(page(film(self.trace, self._name)), self._name, height=45)
        return None

    def _recorded(self) -> Events:
        """The events. Raises ``UserError`` for a summary."""
        if self.trace.events is None:
            problem = "this repeat was recorded as a summary: it has no events"
            raise UserError(problem, "run the config with `record: events`")
        return self.trace.events

    def _replayed(self, replay: Callable[[], Result]) -> Result:
        """What a replay gives. Raises ``UserError``."""
        self._recorded()
        try:
            return replay()
        except ValueError as error:
            raise UserError(str(error)) from None


def _records(columns: Mapping[str, NDArray[Any]]) -> "np.recarray[Any, Any]":
    """Columns as one structured array."""
    types = [(name, column.dtype) for name, column in columns.items()]
    return np.rec.fromarrays(list(columns.values()), dtype=types)


class Run(runs.Run):
    """A run's folder: its ``points``, and the repeats that are there.

    This is the ``Run`` of the package ``runs`` with the analyses and figures that scripts use.
    ``run[point, repeat]`` is a repeat, and ``for repeat in run`` gives all of them. One file is in
    memory at a time: a long repeat, or a batch of short ones.
    """

    def __dir__(self) -> list[str]:
        """What scripts use, for completion."""
        return ["directory", "name", "experiment", "points", *(n for n in vars(Run) if n[0] != "_")]

    def _repr_html_(self) -> str:
        """A table of the points, in a notebook."""
        rows = [["point", "repeats", "ended", "collisions"]]
        for row in run_status(self)["ledger"]:
            cells = point_label(row["parameters"]), row["done"], ended(row), row["collisions"]
            rows.append([html.escape(str(cell)) for cell in cells])
        table = "".join(f"<tr><td>{'<td>'.join(cells)}" for cells in rows)
        return f"<p>{html.escape(self.experiment.title or self.name)}</p><table>{table}</table>"

    def __repr__(self) -> str:
        size = f"{counted(len(self.points), 'point')}, {counted(self.experiment.repeats, 'repeat')}"
        return f"<run {self.name}: {size} each>"

    def __getitem__(self, place: tuple[int, int]) -> Repeat:
        """A repeat, by its point and number. Raises ``UserError`` or ``StoreError``."""
        if not isinstance(place, tuple) or len(place) != 2:
            raise UserError(f"run[{place!r}]: give a point and a repeat, as in run[0, 3]")
        point = self.chosen(*place)
        return Repeat(self.read(point, place[1]), point, place[1])

    def __iter__(self) -> Iterator[Repeat]:
        """All repeats that are there, point after point. Raises ``StoreError``."""
        return chain.from_iterable(self.repeats(point.index) for point in self.points)

    def repeats(self, point: int) -> Iterator[Repeat]:
        """The repeats of a point that are there. Raises ``UserError`` or ``StoreError``."""
        chosen = self.chosen(point, 0)
        numbers = self.present(chosen)
        traces = self.traces(chosen, numbers) if numbers else ()
        return (Repeat(trace, chosen, k) for k, trace in zip(numbers, traces, strict=True))

    @_in_python()
    def matching(self, **where: Any) -> tuple[Point, ...]:
        """The points with these values: ``cor=0.8``, ``cor=[0.8, 0.9]``, ``**{"balls.radius": 1}``.

        Raises ``FigureError`` if there is none.
        """
        from snooker_cli.figures.selection import Selection, matching

        return matching(self, Selection(_alternatives(where)))

    @_in_python()
    def table(self, **where: Any) -> dict[str, NDArray[Any]]:
        """Columns with a row for each repeat that is there: ``pandas.DataFrame(run.table())``.

        where : only points with these values, as in ``matching``

        ``point``, the swept keys (nan for null), ``repeat``; ``ending`` as ``show`` has it and
        ``complete``; ``time`` (s) and numbers of ``collisions``. ``temperature`` (J), ``pressure``
        (Pa m) and ``mean_speed`` (m/s) are means over the time of the repeat. ``energy_ratio`` is
        the energy at the end over that at the start. ``k`` and ``alpha`` (1/s) are fits to the
        energy: the constants of exp(−kt) and of Haff's law; nan without a fit. Where walls give
        energy, ``wall_energy`` and ``lost_energy`` (J) are what they gave and what collisions
        between balls took, and ``stationary_from`` (s) is when the stationary part begins, in the
        complete repeats of a point that has one; otherwise these are nan. A swept key with
        the name of another column gets the prefix ``config.``. Raises ``FigureError``,
        ``StoreError``, and ``RunError`` if no repeat is there.
        """
        from snooker_cli.analysis.run_analysis import results

        points = self.matching(**where)
        tables: list[dict[str, list[Any]]] = []
        for point, columns in zip(points, results(self, points, counting), strict=True):
            if not columns:
                continue
            own = {"repeat": self.present(point)} | columns
            number = len(own["repeat"])
            swept = {
                f"config.{key}" if key in own else key: [value] * number
                for key, value in point.parameters
            }
            tables.append({"point": [point.index] * number} | swept | own)
        return {
            name: _column(list(chain.from_iterable(table[name] for table in tables)))
            for name in tables[0]
        }

    @_in_python()
    def fit(self, since: float = 0.0, until: float = math.inf, **where: Any) -> Records:
        """The records of ``snooker fit --json``, of the times from ``since`` to ``until`` (s).

        where : only points with these values, as in ``matching``

        Raises ``RunError``, ``FigureError`` or ``UserError``.
        """
        from snooker_cli.analysis.run_analysis import fits

        return fits(self, since, until, self.matching(**where), counting).rows

    @_in_python()
    def compare(self, **where: Any) -> Records:
        """The records of ``snooker compare --json``, with ``where`` as in ``matching``.

        Raises ``RunError`` or ``FigureError``.
        """
        from snooker_cli.analysis.run_analysis import comparisons

        return comparisons(self, self.matching(**where), counting).rows

    @_in_python()
    def plot(self, name: str, *, repeat: int | None = None, **where: Any) -> "Figure":
        """A figure by its name in ``snooker plot --list``, as matplotlib's ``Figure``.

        repeat : only this repeat
        where : only points with these values, as in ``matching``; a figure of one point, such as
            "energy-fit", shows the first of them and names it in its title

        Raises ``FigureError`` if the run cannot give it.
        """
        from snooker_cli.figures import FIGURES, Selection
        from snooker_cli.figures.drawing import draw

        check_name(name, FIGURES, "figure", "snooker plot --list")
        return draw(FIGURES[name].make(self, Selection(_alternatives(where), repeat), first=True))

    @_in_python()
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

        since, until, most : as of ``animation.film``
        where : as in ``matching``

        A summary is simulated again. Raises ``FigureError``, and ``UserError`` for a repeat that
        cannot be shown.
        """
        from snooker_cli.animation import MOST_COLLISIONS, film, with_events

        films = []
        for point, number in product(self.matching(**where), repeats):
            trace = self[point.index, number].trace
            shown = {"cor": f"{trace.start.restitution:g}"} | dict(point.parameters)
            balls = counted(trace.start.number, "ball")
            subtitle = f"{point_label(shown)}, {balls}, repeat {number}"
            span = since, until, most or MOST_COLLISIONS
            try:
                if trace.summary is not None and not self.can_be_replayed:
                    raise FigureError(
                        "is a summary of another engine version, which cannot be replayed"
                    )
                trace = with_events(trace, since, span[2])
                films.append(film(trace, self.experiment.title or self.name, subtitle, *span))
            except FigureError as error:
                raise UserError(f"repeat {number} of {self.name} {error}") from None
        return films

    @_in_python()
    def report(self, out: str | PathLike[str] | None = None) -> list[Path]:
        """Write the report on this run, by default into its folder; the pages' files.

        Raises ``FigureError`` without repeats, and ``UserError`` without the report's libraries.
        """
        from snooker_cli.report.run_report import run_report

        folder = own_folder(self.directory / "report") if out is None else Path(out)
        return run_report([self], folder, lambda _: None)

    @_in_python()
    def export(self, out: str | PathLike[str], **where: Any) -> Path:
        """Write ``table`` as CSV, or as .parquet; its file. Raises as ``table``."""
        rows, path = self.table(**where), Path(out)
        units = {name: UNITS.get(name, "") for name in rows}
        export.write_table(path, units, [rows], {"config": configs.to_json(self.experiment)})
        return path


def _alternatives(where: Mapping[str, Any]) -> dict[str, Any]:
    """The conditions of a selection, which has a tuple for a choice of values."""
    return {key: tuple(to) if isinstance(to, list) else to for key, to in where.items()}


def _column(values: list[Any]) -> NDArray[Any]:
    """Values as an array: numbers with nan for null, or texts."""
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([math.nan if value is None else value for value in values])
    return np.array([text if isinstance(text, str) else json.dumps(text) for text in values])


@_in_python()
def open(name: str | PathLike[str]) -> Run:
    """A run by its folder or its name under ``runs/``. Raises ``RunError`` or ``StoreError``."""
    run = runs.open_run(Path(name))
    return Run(*(getattr(run, field.name) for field in fields(run)))


@_in_python()
def run(
    config: str | PathLike[str] | Mapping[str, Any],
    overrides: Mapping[str, Any] | None = None,
    *,
    out: str | PathLike[str] | None = None,
    fresh: bool = False,
    jobs: int | None = None,
    progress: bool = True,
) -> Run:
    """Simulate what is missing of a config's run, store it, and open the run.

    config : a YAML file, or the same keys as a dict
    overrides : values of keys; several values, or a range as a text, are a sweep:
        ``{"cor": [0.8, 0.9], "balls.rings": "range(1,4)"}``
    out : the run's folder [``runs/`` and the file's name; for a dict, eight digits of its hash]
    fresh : replace the results in the folder
    jobs : threads [all cores]
    progress : show a bar in a terminal, or in a notebook that has ipywidgets

    Ctrl-C stores what is simulated, then raises ``KeyboardInterrupt``; the same call continues.
    Raises ``ConfigError``, ``RunError`` for a folder with other results, and for repeats that
    failed when all others are stored.
    """
    texts = [_override(key, value) for key, value in (overrides or {}).items()]
    loaded = starting_state.load(config, texts)
    points, _ = checked(loaded)
    made = Run(Path(), loaded.experiment, points)
    name = made.identity if isinstance(config, Mapping) else Path(config).stem
    made = replace(made, directory=runs.RUNS / name if out is None else Path(out))
    cancelled = threading.Event()
    source = "{…}" if isinstance(config, Mapping) else repr(str(config))
    with showing_notices():
        outcomes, _ = execute_watched(
            made,
            fresh=fresh,
            bar=progress,
            cancelled=cancelled,
            workers=jobs or processors(),
            command=f"snooker.run({source}, {overrides})",
        )
    if cancelled.is_set():
        wanted = len(points) * made.experiment.repeats
        raise KeyboardInterrupt(f"{share_done(outcomes, wanted)}; call run again to finish")
    if errors := [outcome.error for outcome in outcomes if outcome.error]:
        failed = f"{counted(len(errors), 'repeat')} of {len(outcomes)} failed ({errors[0]})"
        raise RunError(f"{made.directory}: {failed}", "snooker.open gives the others")
    return made


def _override(key: str, value: Any) -> str:
    """An override as ``-o`` has it."""
    if isinstance(value, str):
        return f"{key}={value}"
    values = plain(value)
    return f"{key}={','.join(map(json.dumps, values if isinstance(values, list) else [values]))}"


@dataclass(frozen=True, repr=False)
class LivePage:
    """A page that simulates a gas in the browser; a notebook shows it.

    html : the page
    """

    html: str

    def __repr__(self) -> str:
        return "<live page: save it, or show it in a notebook>"

    def _repr_html_(self) -> str:
        # Users save tables and pictures.
        rights = "allow-scripts allow-downloads"
        return in_notebook(self.html, "Live page of a gas", 62, rights)

    def save(self, out: str | PathLike[str]) -> Path:
        """Write the page; its file."""
        write_text(Path(out), self.html, given=True)
        return Path(out)


@_in_python()
def live(
    config: str | PathLike[str] | Mapping[str, Any] | None = None,
    overrides: Mapping[str, Any] | None = None,
    *,
    controls: Sequence[str] | None = None,
    beginner: bool = False,
    language: str = "en",
) -> LivePage:
    """The page of ``snooker live``, which simulates the first point of a config.

    config, overrides : as of ``run``; without a config the source report's scene
    controls : names of the sliders and menus that it shows, as ``["cor", "radius"]``; None for all
    beginner : whether it leaves out virial, momentum, config and hashes
    language : ``"en"`` or ``"de"``

    Raises ``ConfigError``, also for what the page cannot show, such as more than 2,000 balls, and
    ``UserError`` for a name that no control or language has.
    """
    from snooker_cli.live_page import live_page, report_scene

    texts = [_override(key, value) for key, value in (overrides or {}).items()]
    loaded = starting_state.load(report_scene() if config is None else config, texts)
    page = live_page(loaded, controls=controls, beginner=beginner, language=language)
    return LivePage(page)


def new_scene(
    positions: ArrayLike,
    velocities: ArrayLike,
    radii: ArrayLike,
    masses: ArrayLike = 1.0,
    *,
    container: Container,
    container_mass: float = math.inf,
    cor: float = 1.0,
    wall_cor: float | None = None,
    cor_speed: float | None = None,
    wall_cor_speed: float | None = None,
    wall_speed: float | Mapping[str, float] | None = None,
    wall_temperature: float | Mapping[str, float] | None = None,
    collapse: str | Mapping[str, float] = "stop",
) -> Scene:
    """A scene from arrays, checked.

    positions, velocities : (*N*, 2), m and m/s, from the container's centre
    radii, masses : (*N*,) or one number, m and kg
    container : ``Circle(radius)``, ``Box(width, height)``, ``Channel(width, height)`` or
        ``PeriodicBox(width, height)``, m
    container_mass : of a circle that moves, kg
    cor, wall_cor, collapse : as in a config; the wall's CoR is that of the balls by default
    cor_speed, wall_cor_speed, wall_speed, wall_temperature : as in a config; none by default

    Raises ``ConfigError`` or ``SceneError``: balls that overlap or stick out, or a wrong value.
    """
    if not isinstance(container, Container):
        raise UserError(f"container={container!r}: give Circle, Box, Channel or PeriodicBox")
    given = (positions, velocities, radii, masses)
    try:
        columns = [np.asarray(values, dtype=np.float64) for values in given]
        number = len(columns[0])
        columns[2:] = [np.broadcast_to(column, number) for column in columns[2:]]
        fit = number > 0 and columns[0].shape == columns[1].shape == (number, 2)
    except (TypeError, ValueError):
        fit = False
    if not fit:
        shapes = "give positions and velocities of shape (N, 2), and N or one radius and mass"
        raise UserError("the arrays do not fit each other", shapes)
    names = ("position", "velocity", "radius", "mass")
    rows = zip(*(column.tolist() for column in columns), strict=True)
    data = {
        "container": {"shape": container.name, **container.lengths, "mass": container_mass},
        "balls": {"list": [dict(zip(names, row, strict=True)) for row in rows]},
        "cor": cor,
        "wall_cor": wall_cor,
        "cor_speed": cor_speed,
        "wall_cor_speed": wall_cor_speed,
        "wall_speed": wall_speed,
        "wall_temperature": wall_temperature,
        "collapse": collapse,
        "collisions": 1,
    }
    return starting_scene(configs.load(data).experiment, 0)


def simulate(
    scene: Scene,
    *,
    collisions: int | None = None,
    time: float | None = None,
    summary: bool = False,
) -> Repeat:
    """Simulate a scene until a number of collisions or a time (s), whichever comes first.

    summary : record observables on a grid of times instead of all collisions

    Few inelastic balls in a periodic box drift apart and may need hours for the next collision:
    give a ``time`` too. Raises ``UserError`` without a limit, for one that is not above 0, or for a
    scene that the engine cannot simulate.
    """
    for name, limit in (("collisions", collisions), ("time", time)):
        if limit is not None and not (isinstance(limit, Real) and 0 < limit < math.inf):
            raise UserError(f"{name}={limit!r}: give a number above 0")
    if is_random(scene.wall_law) and scene.wall_key is None:
        problem = (
            "a wall with a temperature draws random numbers, and the scene has no key for them"
        )
        raise UserError(problem, "give wall_key=0 or another whole number to `replace`")
    whole = None if collisions is None else math.ceil(collisions)
    try:
        return Repeat(engine.simulate(scene, collisions=whole, time=time, summary=summary))
    except ValueError as error:
        raise UserError(str(error)) from None
