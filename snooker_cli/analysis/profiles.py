"""Density and temperature across a container or along its radius, and the heat conducted."""

import math
from collections.abc import Iterable
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory
from snooker_cli.containers import ENDS
from snooker_cli.engine import States, replayed
from snooker_cli.laws import Law, Sides
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

Array: TypeAlias = NDArray[np.float64]

BATCH = 2**18  # balls times states at once: arrays of this size stay in the cache
NEAR = 3  # bins on each side of one to which a line is fitted for the slope there


class Profile(NamedTuple):
    """Means over states at even times in *b* bins across the container, or along the radius.

    edges : (*b* + 1,), m
    density : of centres, 1/m², (*repeats*, *b*)
    across, along : temperatures m⟨v²⟩ of the motion across (or along the radius) and at right
        angles to it, J, (*repeats*, *b*)
    """

    edges: Array
    density: Array
    across: Array
    along: Array

    @property
    def middles(self) -> Array:
        """The middles of the bins, m."""
        return middles(self.edges)

    @property
    def temperature(self) -> Array:
        """The mean energy of a ball in each bin, J."""
        return (self.across + self.along) / 2


def measured_profile(
    scene: Scene, parts: Iterable[tuple[Trace, float]], bins: int, times: int
) -> Profile:
    """The profile of the repeats of a point.

    parts : each repeat, with the time (s) after which it counts
    times : number of states of each
    """
    smallest = float(scene.radii.min())
    reach = scene.container.size[axis_across(scene)] / 2 - smallest
    shares = np.linspace(0.0, 1.0, bins + 1)
    # Rings of equal area, or strips of equal width.
    edges = reach * np.sqrt(shares) if is_radial(scene) else reach * (2 * shares - 1)
    area = scene.container.accessible(smallest).area / bins
    of_bins, rows = partial(_sums, scene, edges), []
    for trace, since in parts:
        states = replayed(trace, np.linspace(since, trace.stop.time, times), BATCH)
        balls, *squares = np.sum([*map(of_bins, states)], axis=0)
        known = np.where(balls, balls, np.nan)
        rows.append((balls / (times * area), *(square / known for square in squares)))
    density, across, along = np.swapaxes(np.array(rows), 0, 1)
    return Profile(edges, density, across, along)


def _sums(scene: Scene, edges: Array, states: States) -> Array:
    """Balls, and m v² across and along, in each bin; (3, *b*)."""
    places = states.positions - states.container_position[:, np.newaxis]
    axis, bins = axis_across(scene), len(edges) - 1
    order = [axis, 1 - axis]
    x, y = np.moveaxis(places, 2, 0)[order]
    u, v = np.moveaxis(states.velocities, 2, 0)[order]
    where = x
    if is_radial(scene):
        where = np.hypot(x, y)
        far = np.where(where > 0, where, 1.0)
        u, v = (x * u + y * v) / far, (x * v - y * u) / far
    bin_of = np.clip(np.searchsorted(edges, where.ravel(), side="right") - 1, 0, bins - 1)
    squares = ((scene.masses * speed**2).ravel() for speed in (u, v))
    weighted = [np.bincount(bin_of, square, bins) for square in squares]
    return np.array([np.bincount(bin_of, minlength=bins), *weighted])


def middles(values: Array) -> Array:
    """Means of neighbours along the last axis."""
    return (values[..., 1:] + values[..., :-1]) / 2


def is_radial(scene: Scene) -> bool:
    """Whether profiles are along the radius."""
    return scene.container.across == "radius"


def axis_across(scene: Scene) -> int:
    """The axis of profiles, 0 or 1: that across, or in a circle x."""
    return int(scene.container.across == "y")


def walls_at_ends(scene: Scene) -> dict[float, Law]:
    """The laws of the walls that a profile ends at, by the place of the wall, m."""
    right, law = scene.container.size[axis_across(scene)] / 2, scene.wall_law
    if is_radial(scene):
        return {right: law} if not isinstance(law, Sides) else {}
    first, last = ENDS[scene.container.across or "x"]
    both = (getattr(law, first), getattr(law, last)) if isinstance(law, Sides) else (law, law)
    return {-right: both[0], right: both[1]}


def wall_temperatures(scene: Scene) -> dict[float, float]:
    """Temperatures of these walls by their place, J; nan of a wall without one."""
    walls = walls_at_ends(scene).items()
    return {place: getattr(law, "temperature", math.nan) for place, law in walls}


AT_WALL = np.array([0.85, 0.45, 0.05, -0.35])
"""Weights of the first bins at a wall: the value at the wall of the line fitted to them."""


def temperature_jumps(scene: Scene, profile: Profile) -> Array:
    """By how much walls at both ends are warmer than the gas beside them, J, (*repeats*, 2).

    It is nan at a wall without a temperature.
    """
    near = profile.temperature[:, : len(AT_WALL)], profile.temperature[:, : -len(AT_WALL) - 1 : -1]
    beside = np.column_stack([strips @ AT_WALL for strips in near])
    return np.asarray([*wall_temperatures(scene).values()] - beside)


def expected_jumps(scene: Scene, profile: Profile, through: Array) -> Array:
    """The same by `theory.temperature_jump`, from the flux of heat through these walls; (2,).

    through : in the direction of x or y, J/(m s), (*repeats*, 2)
    """
    jumps, size, mass = [], float(scene.radii[0]), float(scene.masses[0])
    for side, strips in enumerate((slice(None, len(AT_WALL)), slice(-len(AT_WALL), None))):
        packing = math.pi * size**2 * float(profile.density[:, strips].mean())
        here = packing, size, float(profile.temperature[:, strips].mean()), mass
        slope = float(through[:, side].mean()) / theory.thermal_conductivity(*here)
        jumps.append(slope * theory.temperature_jump(*here) * (-1) ** side)
    return np.array(jumps)


class Conduction(NamedTuple):
    """What a profile of equal balls conducts, after Enskog, without the bins near its ends.

    places : middles of bins, m
    flux : −κ dT/dx of each repeat, J/(m s), (*repeats*, *places*)
    """

    places: Array
    flux: Array

    @property
    def middle(self) -> Array:
        """The mean flux over the places, where walls disturb it least; (*repeats*,)."""
        return np.asarray(self.flux.mean(axis=1))


def conduction(scene: Scene, profile: Profile) -> Conduction:
    """The flux of heat by `theory.thermal_conductivity`, whose κ is that of elastic balls."""
    size, mass = float(scene.radii[0]), float(scene.masses[0])
    packing = math.pi * size**2 * profile.density.mean(axis=0)
    warm, steps = profile.temperature, np.arange(-NEAR, NEAR + 1)
    conductivity = theory.thermal_conductivity(packing, size, warm.mean(axis=0), mass)
    windows = np.lib.stride_tricks.sliding_window_view(warm, len(steps), axis=1)
    slopes = windows @ steps / (np.sum(steps**2) * float(profile.edges[1] - profile.edges[0]))
    return Conduction(profile.middles[NEAR:-NEAR], -conductivity[NEAR:-NEAR] * slopes)
