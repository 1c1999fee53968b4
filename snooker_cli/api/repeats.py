"""A repeat of a run, or a simulation without files: its collisions, states and observables."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snooker_cli import engine, export, options
from snooker_cli.api.arguments import TIMES_NEEDED
from snooker_cli.config import Point
from snooker_cli.engine import States
from snooker_cli.errors import ArgumentError, ArgumentTypeError, FigureError, UserError
from snooker_cli.files import write_text
from snooker_cli.formatting import point_label
from snooker_cli.pages.html_page import in_notebook
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, Stop, Trace, event_hashes

Result = TypeVar("Result")


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

        j is −1 for the container and −2 for a slide along the wall. Rough balls also have
        ``tangential_impulse`` (kg m/s), on j, to the left of the line from i to j. Raises
        ``UserError`` for a repeat that was recorded as a summary.
        """
        return _records(export.events_table(self._recorded()))

    def states(self, times: ArrayLike) -> States:
        """Places and velocities at times (s, ascending), just after a collision at that time.

        The fields are ``time`` (*t*,), ``positions`` and ``velocities`` (*t*, *N*, 2), and
        ``container_position`` and ``container_velocity`` (*t*, 2), in s, m and m/s. Rough balls
        have ``spins`` (*t*, *N*), rad/s, positive to the left; of smooth ones it is ``None``. All
        have the bits of the simulation. Of snapshots they are the stored states nearest to the
        times, so look at ``time``. Raises ``UserError`` for times that do not ascend within 0 and
        the end, and for a summary.
        """
        return self._replayed(lambda: engine.replay(self.trace, _times(times)))

    def hashes(self) -> list[tuple[int, str]]:
        """Numbers of collisions, and the SHA-256 of as many: the first 1,000, 10,000 … and all.

        Repeats with the same hash have the same collisions to the bit. Raises ``UserError`` for a
        summary.
        """
        return event_hashes([self._recorded()])

    def series(self) -> "np.recarray[Any, Any]":
        """Observables at time zero and after each collision; a summary's on its grid of times.

        ``time`` (s), ``kinetic_energy`` and ``container_energy`` (J); since the start
        ``wall_impulse`` (kg m/s), ``pair_virial`` (impulse times distance, kg m²/s),
        ``wall_events`` and ``pair_events``; ``mean_speed`` (m/s), and ``energy_moment``,
        <k²>/<k>² of the balls' kinetic energies. If walls give energy, ``wall_energy`` and
        ``lost_energy`` (J) are what they gave and what collisions between balls took. Rough balls
        have ``spin_energy`` (J), that of their rotation. Very long repeats give an even choice of
        rows.
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

        batches = self._replayed(lambda: engine.replayed(self.trace, _times(times)))
        values = (structure.of_states(observable, self.scene, states) for states in batches)
        return np.array(list(chain.from_iterable(values)))

    def state(self, time: float) -> Scene:
        """The scene at a time, s: ``simulate`` continues from it, after ``replace`` with other CoR.

        Of snapshots it is the stored state nearest to the time.

        Raises ``UserError`` as ``states`` does.
        """
        return self._replayed(lambda: engine.state_at(self.trace, _times(time).item()))[1]

    @property
    def stored_times(self) -> NDArray[np.float64]:
        """When its states are stored, s: at the start, at snapshots and at the end."""
        return engine.stored_times(self.trace)

    def structure_factor(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Wave numbers k (1/m), ascending, and S(k) = |Σ exp(−ik·r)|²/N of the state at a time, s.

        Each is a mean over waves of about this length in several directions. Raises ``UserError``
        as ``states``, and for a container that does not repeat.
        """
        from snooker_cli.analysis import structure

        scene = self.state(time)
        chosen = self._of_state(lambda: structure.waves(scene))
        return chosen.numbers, structure.structure_factor(*_moving(scene), scene, chosen)

    def cluster_sizes(self, time: float, gap: float | None = None) -> NDArray[np.int64]:
        """Balls of each cluster at a time, s; the largest first, and a ball alone counts as one.

        gap : m, at most, between two linked balls [a tenth of the mean diameter]

        The glossary has the rule. Raises ``UserError`` as ``states``, and for a gap below 0.
        """
        from snooker_cli.analysis import structure

        scene = self.state(time)
        return self._of_state(lambda: structure.cluster_sizes(*_moving(scene), scene, gap))

    def density_fluctuation(self, time: float, balls_in_cell: float = 20.0) -> float:
        """Variance over mean of the number of balls in the cells of a grid, at a time, s.

        balls_in_cell : on average

        About 1 for independent points (Poisson). Raises ``UserError`` as ``states``.
        """
        from snooker_cli.analysis import structure

        scene = self.state(time)
        return structure.density_fluctuation(*_moving(scene), scene, balls_in_cell)

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
        if self.trace.snapshots is None:
            self._recorded()
        return self._of_state(replay)

    def _of_state(self, computed: Callable[[], Result]) -> Result:
        """What is computed. Raises ``UserError`` for values that do not fit."""
        try:
            return computed()
        except ValueError as error:
            raise ArgumentError(str(error)) from None


def _times(given: ArrayLike) -> NDArray[np.float64]:
    """Times that are given, s. Raises ``ArgumentTypeError`` for what is no numbers."""
    try:
        return np.atleast_1d(np.asarray(given, dtype=np.float64))
    except (TypeError, ValueError):
        raise ArgumentTypeError(f"{options.STATE_TIMES}: {TIMES_NEEDED}") from None


def _moving(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions and velocities of a scene."""
    return scene.positions, scene.velocities


def _records(columns: Mapping[str, NDArray[Any]]) -> "np.recarray[Any, Any]":
    """Columns as one structured array."""
    types = [(name, column.dtype) for name, column in columns.items()]
    return np.rec.fromarrays(list(columns.values()), dtype=types)
