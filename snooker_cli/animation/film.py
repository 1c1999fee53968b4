"""A repeat -> a film: its balls, collisions, energy and pressure in a span of time."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.decay import repeat_fits
from snooker_cli.analysis.observables import integrals, series
from snooker_cli.engine import States, replay, simulate
from snooker_cli.errors import FigureError
from snooker_cli.formatting import printable
from snooker_cli.trace import CONTAINER, SLIDE, Trace

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int32]

MOST_COLLISIONS = 10_000
"""In a film: a page stores 83 bytes for each, and steps through them one by one."""

MOST_AGAIN = 10_000_000  # collisions simulated for a film of a summary: some 30 s and 240 MB
MOST_BALLS = 10_000  # in a film: a browser draws this number several times a second
BATCH = 2_000_000  # balls times collisions whose states are in memory at a time; 64 MB
FASTER = 0.02  # share of the balls' speeds above the colour scale: a gas has a few fast balls


@dataclass(frozen=True)
class Film:
    """What is shown of a repeat from one time to another; SI units with k_B = 1.

    trace : the repeat up to the last collision shown; with sliding balls, one more event
    title, subtitle, ending : shown at the top; why the repeat ended early, or empty
    start, end : s
    before, left_out : number of collisions before the film; of the events that are too many
    opening : the state at ``start``
    time, i, j : (*n*,) the collisions and the bodies that collide, as in ``Events``
    sliding : balls that slide along the wall at the start
    settling : the ball that bounces after the last collision until it slides, or ``None``
    after : (*n*, 4) velocities of i (u, v) and of j or the container after it, m/s
    contacts : (*n*, 2) points of contact, m
    container_path : (*n* + 2, 2) the container's centre at the start, collisions and end, m
    kinetic_energy : (*n* + 1,) of the balls at the start and after each collision, J
    haff_rate : α of Haff's law fitted to the energy of the whole repeat, 1/s; ``None`` without one
    pressure_sum : (*n* + 1,) what ``pressure`` divides by the time, Pa m s
    pressure_gain : (*n* + 1,) its increase per second from there on, Pa m
    top_speed : m/s, of the brightest colour; few balls are faster
    """

    trace: Trace
    title: str
    subtitle: str
    ending: str
    start: float
    end: float
    before: int
    left_out: int
    opening: States
    time: Floats
    i: Integers
    j: Integers
    sliding: tuple[int, ...]
    settling: int | None
    after: Floats
    contacts: Floats
    container_path: Floats
    kinetic_energy: Floats
    haff_rate: float | None
    pressure_sum: Floats
    pressure_gain: Floats
    top_speed: float

    def __len__(self) -> int:
        return len(self.time)

    @property
    def rows(self) -> Floats:
        """(*n* + 1,) times of the start and of the collisions, s."""
        return np.concatenate([[self.start], self.time])

    @property
    def knots(self) -> Floats:
        """(*n* + 2,) times of the start, the collisions and the end, s."""
        return np.append(self.rows, self.end)

    @property
    def pressure_top(self) -> float:
        """The largest mean pressure that a panel shows, Pa m.

        It is that after a tenth of the collisions: before, it may be that of a single hit. In a gas
        that cools they come early.
        """
        return float(np.max(self.pressure(self.rows[len(self) // 10 :])))

    def pressure(self, times: Floats) -> Floats:
        """Mean pressure from the repeat's start to times within the film, Pa m; at 0 its limit."""
        row = np.searchsorted(self.time, times, side="right")
        total = self.pressure_sum[row] + self.pressure_gain[row] * (times - self.rows[row])
        return np.divide(total, times, out=self.pressure_gain[row], where=times > 0)


def film(
    trace: Trace,
    title: str,
    subtitle: str = "",
    since: float = 0.0,
    until: float | None = None,
    most: int = MOST_COLLISIONS,
) -> Film:
    """The film of a repeat from one time to another, s.

    most : largest number of collisions; the film ends with the last one

    Raises ``FigureError`` for a repeat without events (see ``with_events``), a span outside it, and
    too many balls.
    """
    events, scene = trace.events, trace.start
    if events is None:
        raise FigureError("was recorded as a summary; run it with `record: events` to get a film")
    if scene.number > MOST_BALLS:
        raise FigureError(f"has {scene.number:,} balls; a film shows at most {MOST_BALLS:,}")
    end = trace.stop.time if until is None else until
    if not 0 <= since < end <= trace.stop.time:
        raise FigureError(
            f"cannot be shown from {since!r} s to {end!r} s; give a span within 0 and "
            f"{trace.stop.time!r} s"
        )
    first, last = np.searchsorted(events.time, [since, end], side="right").tolist()
    left_out = max(0, last - first - most)
    if left_out:
        last -= left_out
        end = float(events.time[last - 1])
    time, i, j = events.time[first:last], events.i[first:last], events.j[first:last]
    haff = repeat_fits(trace, "kinetic_energy")["haff"]
    # Later events are not needed, except the next one: a ball may bounce until it slides there.
    trace = replace(trace, events=events[: last + 1 if scene.slides else last], summary=None)
    opening, centres = replay(trace, [since]), replay(trace, [since, end]).container_positions
    table = _at_collisions(trace, time, i, j)
    energy = np.append(_energy(trace, opening), table[:, 6])
    if not np.isfinite(energy).all():
        raise FigureError("has an energy that is not finite")
    slides = _slides(trace)
    pressure_sum, pressure_gain = _pressure(trace, slides, first, since, time, energy)
    speeds = np.hypot(*np.vstack([opening.velocities[0], table[:, :2]]).T)
    return Film(
        trace=trace,
        title=printable(title),
        subtitle=printable(subtitle),
        ending=""
        if end < trace.stop.time or trace.stop.reason.complete
        else printable(trace.stop.message),
        start=float(since),
        end=float(end),
        before=first,
        left_out=left_out,
        opening=opening,
        time=time,
        i=i,
        j=j,
        sliding=tuple(ball for ball, begin, end in slides.tolist() if begin < first <= end),
        settling=next((ball for ball, begin, _ in slides.tolist() if begin == last), None),
        after=table[:, :4],
        contacts=table[:, 4:6],
        container_path=np.vstack([centres[:1], table[:, 7:], centres[1:]]),
        kinetic_energy=energy,
        haff_rate=haff.value if haff.value > 0 else None,
        pressure_sum=pressure_sum,
        pressure_gain=pressure_gain,
        top_speed=float(np.quantile(speeds, 1 - FASTER)) or 1.0,
    )


def with_events(
    trace: Trace, since: float, until: float | None, most: int, engine: str | None = None
) -> Trace:
    """A repeat with the events that ``film`` needs: those of a summary are simulated again.

    Raises ``FigureError`` for more than ``MOST_AGAIN`` collisions.
    """
    if trace.summary is None:
        return trace
    grid = trace.summary.series
    counts = np.append(grid.wall_events + grid.pair_events, trace.collisions).astype(np.int64)
    spans = np.searchsorted(grid.time, [since, np.inf if until is None else until])
    before, within = counts[spans].tolist()
    # One more collision shows that the film leaves some out, or how a ball bounces until it slides.
    number = min(before + most + 1, within + 1, trace.collisions)
    if number > MOST_AGAIN:
        needed = f"needs {number:,} collisions simulated again, {MOST_AGAIN:,} at most"
        raise FigureError(f"is a summary, and the film {needed}; choose an earlier --from")
    return replace(trace, events=simulate(trace.start, collisions=number, engine=engine).events)


def _at_collisions(trace: Trace, time: Floats, i: Integers, j: Integers) -> Floats:
    """(*n*, 9) velocities of both bodies after collisions, contact, energy (J), container's place.

    Collisions at the same instant all have the state after the last of them.
    """
    scene, step = trace.start, max(1, BATCH // trace.start.number)
    table = np.empty((len(time), 9))
    for first in range(0, len(time), step):
        chunk = slice(first, first + step)
        states, ball, other = replay(trace, time[chunk]), i[chunk], j[chunk]
        row, at_wall = np.arange(len(states.time)), other <= CONTAINER
        place, moving = states.positions[row, ball], states.velocities[row, other]
        moving[at_wall] = states.container_velocities[at_wall]
        outwards = scene.container.nearest_image(states.positions[row, other] - place)
        to_wall = scene.container.wall_directions(place - states.container_positions)
        outwards[at_wall] = to_wall[at_wall]
        lengths = np.hypot(*outwards.T)[:, None]
        unit = np.divide(outwards, lengths, out=np.zeros_like(outwards), where=lengths > 0)
        centre = states.container_positions
        contacts = place + scene.radii[ball][:, None] * unit
        contacts = centre + scene.container.nearest_image(contacts - centre)
        columns = states.velocities[row, ball], moving, contacts, _energy(trace, states)
        table[chunk] = np.column_stack([*columns, centre])
    return table


def _energy(trace: Trace, states: States) -> Floats:
    """Kinetic energy of the balls, J; `film` refuses one that is not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(0.5 * np.sum(states.velocities**2, axis=2) @ trace.start.masses)


def _pressure(
    trace: Trace, slides: Integers, first: int, since: float, time: Floats, energy: Floats
) -> tuple[Floats, Floats]:
    """``pressure_sum`` and ``pressure_gain`` of a film from event ``first`` on."""
    scene, events = trace.start, trace.events
    assert events is not None
    rows = slice(first, first + len(time) + 1)
    if scene.container.has_wall:
        given, force = (
            column[rows] / scene.container.wall_length for column in _wall_impulse(trace, slides)
        )
        begun = float(events.time[first - 1]) if first else 0.0
        given[0] += force[0] * (since - begun)
        return given, force
    reach = scene.radii[events.i] + scene.radii[events.j]
    virial = np.cumsum(np.append(0.0, events.impulse * reach))[rows]
    moving = integrals(trace, series(trace).kinetic_energy, np.append(since, time))
    return (moving + virial / 2) / scene.container.area, energy / scene.container.area


def _slides(trace: Trace) -> Integers:
    """(*n*, 3) a ball that slides along the wall, its first such event, and the one that ends it.

    The last one is the number of events for a ball that slides to the end.
    """
    events, found = trace.events, [np.empty((0, 3), np.int32)]
    assert events is not None
    for ball in np.unique(events.i[events.j == SLIDE]):
        own = np.flatnonzero((events.i == ball) | (events.j == ball))
        sliding = events.j[own] == SLIDE
        # The second of two such events has the impulse of the slide up to a hit.
        begins = np.flatnonzero(sliding & ~np.append(False, sliding[:-1]))
        ends = np.append(own, len(events))[begins + 1]
        found.append(np.column_stack([np.full(len(begins), ball), own[begins], ends]))
    slides = np.concatenate(found)
    return slides[np.argsort(slides[:, 1])]


def _wall_impulse(trace: Trace, slides: Integers) -> tuple[Floats, Floats]:
    """(*n* + 1,) impulse on the wall, kg m/s, and force, N, at the start and after each event.

    A ball of mass m that slides with speed v on a circle of radius a has the force m v²/a.
    """
    events, scene, (balls, first, last) = trace.events, trace.start, slides.T
    assert events is not None
    velocities = replay(trace, events.time[first]).velocities[np.arange(len(balls)), balls]
    reach = scene.container.size[0] / 2 - scene.radii[balls]
    change = np.zeros(len(events) + 2)
    pressing = scene.masses[balls] * np.sum(velocities**2, axis=1) / reach
    np.add.at(change, first + 1, pressing)
    np.subtract.at(change, last + 1, pressing)
    force = np.cumsum(change[:-1])
    given = np.where(events.at_wall, events.impulse, 0.0)
    ends = last[last < len(events)]
    given[ends[events.j[ends] == SLIDE]] = 0.0  # counted by the force already
    pressed = force[:-1] * np.diff(events.time, prepend=0.0)
    return np.append(0.0, np.cumsum(given + pressed)), force
