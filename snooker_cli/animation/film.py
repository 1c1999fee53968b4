"""A repeat -> a film: its collisions, energy and pressure in a span of time."""

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli.analysis.decay import decays
from snooker_cli.analysis.time_series import series
from snooker_cli.engine import replay, replayed, simulate
from snooker_cli.errors import FigureError
from snooker_cli.formatting import printable, short
from snooker_cli.options import SINCE
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, SLIDE, Events, Trace

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int32]

MOST_COLLISIONS = 10_000
"""In a film, unless another number is given: a page steps through them one by one."""

MOST_AGAIN = 10_000_000  # collisions simulated for a film of a summary: some 30 s and 240 MB
MOST_BALLS = 10_000  # in a film: a browser draws this number several times a second
BATCH = 2_000_000  # balls times collisions whose states are in memory at a time; 64 MB
FASTER = 0.02  # share of the balls' speeds above the colour scale: a gas has a few fast balls
FIRST_COLLISIONS = 100  # collisions whose mean pressure may leave the panel
SHORTEST = 0.05  # share of the steps between collisions that times need not show
MARGIN = 0.03  # around the container, as a part of its size
STRAY = 0.5  # part of its size: the view follows a container that moves farther

Pace = Literal["time", "events"]
"""What passes evenly while a film is shown: its time, or its collisions."""


@dataclass(frozen=True)
class Film:
    """What is shown of a repeat from one time to another; SI units with k_B = 1.

    trace : the repeat up to the last collision shown; with sliding balls, one more event
    title, subtitle, ending : shown at the top; why the repeat ended early, or empty
    start, end : s
    before, left_out : number of collisions before the film; of the events that are too many
    time, i, j : (*n*,) the collisions and the bodies that collide, as in ``Events``
    contacts : (*n*, 2) points of contact, m
    extent : left, right, bottom and top of the part of the plane that is shown, m
    follow : whether this view moves with the container's centre, the origin of ``extent`` then
    kinetic_energy : (*n* + 1,) of the balls at the start and after each collision, J
    spin_energy : that of rough balls' spins, J; zero of smooth ones
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
    time: Floats
    i: Integers
    j: Integers
    contacts: Floats
    extent: tuple[float, float, float, float]
    follow: bool
    kinetic_energy: Floats
    spin_energy: Floats
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
    def pressure_top(self) -> float:
        """The largest mean pressure that a panel shows, Pa m.

        It is that after a tenth of the collisions, or ``FIRST_COLLISIONS``: before, it may be that
        of a single hit. A gas that cools has its largest pressure soon after.
        """
        return float(np.max(self.pressure(self.rows[min(len(self) // 10, FIRST_COLLISIONS) :])))

    @property
    def decimals(self) -> int:
        """Of times in s: they show a ten-thousandth of the film, and steps between collisions.

        ``SHORTEST`` of the steps are too short for them. More than nine are only for a brief film.
        """
        steps = np.diff(self.rows)
        fine = np.quantile(steps[steps > 0], SHORTEST) if np.any(steps > 0) else self.end
        coarse = 4 - math.ceil(math.log10(self.end - self.start or self.end))
        return max(0, coarse, min(9, math.ceil(-math.log10(fine))))

    def time_text(self, time: float) -> str:
        """A time in s with these decimals, or in a brief film with a power of ten."""
        return f"{time:.{self.decimals}f}" if self.decimals <= 9 else short(time, 8)

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
        raise FigureError(
            "was recorded as a summary; run it with `-o record=events --out OTHER` to get a film"
        )
    if scene.number > MOST_BALLS:
        raise FigureError(f"has {scene.number:,} balls; a film shows at most {MOST_BALLS:,}")
    if trace.stop.time == 0:
        raise FigureError(f"has nothing to show: {trace.stop.message}")
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
    (haff,) = (d.fits[0] for d in decays([trace], ("kinetic_energy",)) if d.law == "haff")
    # Later events are not needed, except the next one: a ball may bounce until it slides there.
    trace = replace(trace, events=events[: last + 1 if scene.slides else last], summary=None)
    columns, rows = series(trace), slice(first, last + 1)
    energy = columns.kinetic_energy[rows]
    if not np.isfinite(energy).all():
        raise FigureError("has an energy that is not finite")
    spins = np.zeros_like(energy) if columns.spin_energy is None else columns.spin_energy[rows]
    slides = _slides(trace)
    if scene.container.has_wall:
        pressure_gain = _slide_forces(trace, slides)[rows] / scene.container.wall_length
        pressure_sum = columns.wall_impulse[rows] / scene.container.wall_length
    else:
        flown = columns.kinetic_energy[:-1] * np.diff(columns.time)
        moving = np.append(0.0, np.cumsum(flown))[rows]
        pressure_gain = energy / scene.container.area
        pressure_sum = (moving + columns.pair_virial[rows] / 2) / scene.container.area
    pressure_sum[0] += pressure_gain[0] * (since - columns.time[first])
    opening, centres = replay(trace, [since]), replay(trace, [since, end]).container_position
    contacts, moved, speeds = _at_collisions(trace, time, i, j)
    extent, follow = _view(trace, np.vstack([centres, moved]))
    speeds = np.append(np.hypot(*opening.velocities[0].T), speeds)
    ended = end >= trace.stop.time and not trace.stop.reason.complete
    return Film(
        trace=trace,
        title=printable(title),
        subtitle=printable(subtitle),
        ending=printable(trace.stop.message) if ended else "",
        start=float(since),
        end=float(end),
        before=first,
        left_out=left_out,
        time=time,
        i=i,
        j=j,
        contacts=contacts,
        extent=extent,
        follow=follow,
        kinetic_energy=energy,
        spin_energy=spins,
        haff_rate=haff.value if haff.value > 0 else None,
        pressure_sum=pressure_sum,
        pressure_gain=pressure_gain,
        top_speed=float(np.quantile(speeds, 1 - FASTER)) or 1.0,
    )


def with_events(trace: Trace, since: float, most: int) -> Trace:
    """A repeat with the events that ``film`` needs: those of a summary are simulated again.

    Raises ``FigureError`` for more than ``MOST_AGAIN`` collisions.
    """
    if trace.summary is None:
        return trace
    grid = trace.summary.series
    before = np.append(grid.wall_events + grid.pair_events, trace.collisions)
    # One more collision shows that the film leaves some out, or how a ball bounces until it slides.
    number = min(int(before[np.searchsorted(grid.time, since)]) + most + 1, trace.collisions)
    if number > MOST_AGAIN:
        needed = f"needs {number:,} collisions simulated again, {MOST_AGAIN:,} at most"
        raise FigureError(f"is a summary, and the film {needed}; choose an earlier {SINCE}")
    return replace(trace, events=simulate(trace.start, collisions=number).events)


def turned_by(events: Events, scene: Scene) -> Floats:
    """(*N*,) what the angles of rough balls have after events, beside spin times time, rad.

    An impulse J at the time t changes a spin by −J/(q m r), and so the angle ∫ω dt is
    ωt + Σ J t/(q m r), exactly.
    """
    assert events.tangential is not None
    assert scene.surface is not None
    given, at_ball = events.tangential * events.time, events.j >= 0
    turned = np.bincount(events.i, given, scene.number)
    turned += np.bincount(events.j[at_ball], given[at_ball], scene.number)
    return turned / (scene.surface.inertia * scene.masses * scene.radii)


def _at_collisions(
    trace: Trace, time: Floats, i: Integers, j: Integers
) -> tuple[Floats, Floats, Floats]:
    """(*n*, 2) contacts, (*n*, 2) centres of the container, (*n*,) speeds of i after it.

    Collisions at the same instant all have the state after the last of them.
    """
    scene, first, number = trace.start, 0, len(time)
    contacts, moved, speeds = np.empty((number, 2)), np.empty((number, 2)), np.empty(number)
    for states in replayed(trace, time, BATCH):
        chunk = slice(first, first + len(states.time))
        ball, other, first = i[chunk], j[chunk], chunk.stop
        row, at_wall = np.arange(len(states.time)), other <= CONTAINER
        place, centre = states.positions[row, ball], states.container_position
        outwards = scene.container.nearest_image(states.positions[row, other] - place)
        outwards[at_wall] = scene.container.wall_directions(place - centre)[at_wall]
        lengths = np.hypot(*outwards.T)[:, None]
        unit = np.divide(outwards, lengths, out=np.zeros_like(outwards), where=lengths > 0)
        at = place + scene.radii[ball][:, None] * unit
        contacts[chunk] = centre + scene.container.nearest_image(at - centre)
        moved[chunk] = centre
        speeds[chunk] = np.hypot(*states.velocities[row, ball].T)
    return contacts, moved, speeds


def _view(trace: Trace, centres: Floats) -> tuple[tuple[float, float, float, float], bool]:
    """``extent`` and ``follow`` of a film in which the container's centre is at these places."""
    size = np.array(trace.start.container.size)
    low, high = centres.min(axis=0), centres.max(axis=0)
    follow = bool(np.any(high - low > STRAY * size))
    if follow:
        low = high = np.zeros(2)
    reach = size / 2 + MARGIN * size.max()
    (left, bottom), (right, top) = (low - reach).tolist(), (high + reach).tolist()
    return (left, right, bottom, top), follow


def _slides(trace: Trace) -> Integers:
    """(*n*, 3) a ball that slides along the wall, its first such event, and the one that ends it.

    The last one is the number of events for a ball that slides to the end.
    """
    events, slides = trace.events, [np.empty((0, 3), np.int32)]
    assert events is not None
    for ball in np.unique(events.i[events.j == SLIDE]):
        own = np.flatnonzero((events.i == ball) | (events.j == ball))
        sliding = events.j[own] == SLIDE
        # The second of two such events has the impulse of the slide up to a hit.
        begins = np.flatnonzero(sliding & ~np.append(False, sliding[:-1]))
        ends = np.append(own, len(events))[begins + 1]
        slides.append(np.column_stack([np.full(len(begins), ball), own[begins], ends]))
    rows = np.concatenate(slides)
    return rows[np.argsort(rows[:, 1])]


def _slide_forces(trace: Trace, slides: Integers) -> Floats:
    """(*n* + 1,) force of sliding balls on the wall at the start and after each event, N.

    A ball of mass m that slides with speed v on a circle of radius a has the force m v²/a.
    """
    events, scene, (balls, first, last) = trace.events, trace.start, slides.T
    assert events is not None
    velocities = replay(trace, events.time[first]).velocities[np.arange(len(balls)), balls]
    reach = scene.container.size[0] / 2 - scene.radii[balls]
    pressing = scene.masses[balls] * np.sum(velocities**2, axis=1) / reach
    change = np.zeros(len(events) + 2)
    np.add.at(change, first + 1, pressing)
    np.subtract.at(change, last + 1, pressing)
    return np.cumsum(change[:-1])
