"""Tagged balls -> paths, mean squared displacement, velocity autocorrelation, and their limits.

In a periodic box they are seen from the balls' centre of mass, which does not rest in every scene.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.analysis.observables import meeting_temperature
from snooker_cli.analysis.structure import species
from snooker_cli.engine.replay import Replay, times_within
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace, even_choice

Array = NDArray[np.float64]
Balls = Sequence[int] | NDArray[np.intp]

RELAXING = 5.0  # relaxation times of the ball's velocity before it is measured
MOST_ORIGINS = 200  # times of a repeat from which displacements count; more are hardly independent
MOST_ROWS = 2_000_000  # balls times instants of a repeat, which take seconds and 64 MB


class Diffusion(NamedTuple):
    """What theory expects of a ball in equilibrium.

    mean_square_speed : ⟨v²⟩ = 2T/m, m²/s²
    relaxation_time : τ of the velocity, which falls as exp(−t/τ), s
    coefficient : D = ⟨v²⟩τ/2, m²/s
    """

    mean_square_speed: float
    relaxation_time: float
    coefficient: float


def contact_times(trace: Trace, ball: int) -> Array:
    """Times of the collisions of a ball, s; between them it flies straight."""
    events = trace.events
    assert events is not None
    return np.asarray(events.time[(events.i == ball) | (events.j == ball)])


def path(trace: Trace, ball: int, times: Array) -> tuple[Array, Array]:
    """Places and velocities (*t*, 2) of a ball; as `paths` of it."""
    places, velocities = paths(trace, [ball], times)
    return places[:, 0], velocities[:, 0]


def paths(trace: Trace, balls: Balls, times: Array) -> tuple[Array, Array]:
    """Places and velocities (*t*, *m*, 2) of balls at ascending times (*t*,), in m, m/s and s.

    In a periodic box their places are unwrapped. The images are counted exactly: from one of its
    collisions to the next, a ball flies straight.

    Raises ``ValueError`` for times outside the repeat, and for a repeat without events.
    """
    if trace.events is None:
        raise ValueError("this repeat was recorded as a summary: it has no path to show")
    wanted, period = times_within(trace, times), trace.start.container.period
    events, own = trace.events, np.empty(0)
    if period is not None:
        own = events.time[np.isin(events.i, balls) | np.isin(events.j, balls)]
    time = np.sort(np.concatenate([wanted, own[own <= wanted[-1]]]))
    done = np.searchsorted(events.time, time, side="right")
    rows = Replay(trace).states(done, time, np.array([balls]))[0].transpose(0, 2, 1)
    places, velocities = rows[..., :2], rows[..., 2:4]
    if period is not None:
        flown = places[:-1] + velocities[:-1] * np.diff(time)[:, None, None]
        images = np.cumsum(np.rint((flown - places[1:]) / period), axis=0)
        places = places + np.array(period) * np.concatenate([np.zeros_like(places[:1]), images])
    at = np.searchsorted(time, wanted, side="right") - 1
    return places[at], velocities[at]


def expected(scene: Scene, ball: int) -> Diffusion:
    """Theory for a ball: equipartition, and Enskog's friction among all others.

    In a periodic box, where the total momentum is kept, a ball of the share s of all mass has
    1 − s of the mean square speed and of the relaxation time, because the others move against it.
    """
    temperature = float(meeting_temperature(scene.kinetic_energy, scene))
    mass, share = float(scene.masses[ball]), 0.0
    if not scene.container.has_wall:
        share = mass / float(np.sum(scene.masses))
    friction = theory.friction(ball, scene.masses, scene.radii, temperature, scene.container)
    square = 2 * temperature / mass * (1 - share)
    relaxation = mass * (1 - share) / friction if friction else math.inf
    return Diffusion(square, relaxation, square * relaxation / 2)


def tagged_balls(trace: Trace, lags: int) -> NDArray[np.intp]:
    """The balls of the species of ball 0; an even choice of them in a long repeat."""
    alike = next(balls for balls in species(trace.start) if balls[0] == 0)
    events = len(trace.events.time) if trace.events is not None else 0
    most = MOST_ROWS // (MOST_ORIGINS * (lags + 1) + events)
    return alike[even_choice(len(alike), max(1, most))]


def correlations(trace: Trace, balls: Balls, lags: Array) -> tuple[Array, Array]:
    """Mean squared displacement (m²) and ⟨v(0)·v(t)⟩ (m²/s²) of balls after lags (*l*,), s.

    balls : of one species

    Both are means over the balls and over times of the repeat after ``RELAXING`` relaxation times.
    Raises ``ValueError`` for a repeat that ends before the last lag after that.
    """
    scene = trace.start
    relaxation = expected(scene, balls[0]).relaxation_time
    first, last = RELAXING * relaxation, trace.stop.time - float(lags[-1])
    if not first <= last:
        raise ValueError(f"a repeat ends before {first + lags[-1]:.4g} s; run longer")
    number = math.ceil(min(MOST_ORIGINS, max(2.0, (last - first) / relaxation)))
    origins = np.linspace(first, last, number)
    instants = np.minimum(origins[:, None] + np.append(0.0, lags), trace.stop.time)
    times, rows = np.unique(instants, return_inverse=True)
    rows = rows.reshape(instants.shape)
    drift = np.zeros(2)
    if not scene.container.has_wall:
        drift = scene.masses @ scene.velocities / np.sum(scene.masses)
    places, velocities = paths(trace, balls, times)
    places, velocities = places - drift * times[:, None, None], velocities - drift
    squares, products = np.zeros(len(lags)), np.zeros(len(lags))
    for instant in rows:  # one origin at a time, which limits the memory
        squares += np.sum((places[instant[1:]] - places[instant[0]]) ** 2, axis=(1, 2))
        products += np.sum(velocities[instant[1:]] * velocities[instant[0]], axis=(1, 2))
    return squares / (number * len(balls)), products / (number * len(balls))


def farthest(scene: Scene, ball: int) -> float:
    """Mean squared distance of two random places of a ball in a container with walls, m²."""
    radius = float(scene.radii[ball])
    distances = np.linspace(0.0, scene.container.longest_distance(radius), 2000)
    density = scene.container.distance_density(distances, radius)
    return float(np.trapezoid(distances**2 * density, distances))
