"""A gas as theories see it: numbers of its scene, and means over the repeats of a point.

No function here asks whether a theory holds: `theories` does, by the facts that it needs.
"""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory, two_temperatures
from snooker_cli.analysis import observables, structure
from snooker_cli.analysis.measurement import WINDOWS, Measurement
from snooker_cli.analysis.profiles import Conduction, Profile, axis_across, conduction
from snooker_cli.analysis.time_series import Averages
from snooker_cli.containers import ENDS, Container
from snooker_cli.laws import Law, Sides
from snooker_cli.scene import Scene
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

Array: TypeAlias = NDArray[np.float64]

HEAVY = 1000.0
"""A free container this many times as heavy as the balls keeps their angular momentum."""


# Numbers of a scene.


def fluid_state(scene: Scene, temperature: float = 1.0) -> theory.FluidState:
    """The state of equal balls at a temperature, J. Raises ValueError if they are no fluid."""
    return theory.fluid_state(scene.number, temperature, float(scene.radii[0]), scene.container)


def enskog_rates(scene: Scene, temperature: float = 1.0) -> theory.CollisionRates:
    """Enskog's collision rates of equal balls at a temperature, J. Raises ValueError likewise."""
    return theory.collision_rates(*_balls(scene, temperature))


def wall_rate(scene: Scene, temperature: float) -> float:
    """Hits of the wall by one of these balls, 1/s, as `enskog_rates` has them."""
    return theory.fluid_wall_rate(*_balls(scene, temperature))


def _balls(scene: Scene, temperature: float) -> tuple[int, float, float, Container, float, float]:
    """What rates of equal balls depend on."""
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    return scene.number, temperature, radius, scene.container, mass, scene.container_mass


def starting_temperature(scene: Scene) -> float:
    """The temperature at which balls meet at the start, J."""
    return observables.meeting_temperature(scene.kinetic_energy, scene)


def components(scene: Scene) -> int:
    """Components of the velocities that share the energy: momentum is kept along axes of images."""
    return 2 * scene.number - sum(scene.container.periodic)


def independent_velocities(scene: Scene) -> int:
    """Number of independent velocities of balls that share a fixed energy, see `components`."""
    return components(scene) // 2


class DiskRatio(NamedTuple):
    """PV/NT of equal hard disks by a theory: at the walls, and by the virial of the balls.

    Without walls T is the temperature at which balls meet, and the two are the same.
    """

    pressure: float
    virial: float


def large_ratio(scene: Scene) -> DiskRatio:
    """PV/NT of a very large gas of equal balls."""
    large = theory.granular_compressibility(scene.packing_fraction, scene.restitution)
    return DiskRatio(large, large)


def finite_ratio(
    number: float, radius: float, container: Container, restitution: float
) -> DiskRatio:
    """PV/NT of N equal hard disks in a container. Raises ValueError if they are no fluid."""
    state = theory.fluid_state(number, 1.0, radius, container).inelastic(restitution)
    return DiskRatio(state.pressure * container.area / number, state.virial_ratio)


def scene_ratio(scene: Scene) -> DiskRatio:
    """PV/NT of the equal balls of a scene, exactly as many in its container."""
    balls = scene.number, float(scene.radii[0])
    return finite_ratio(*balls, scene.container, scene.restitution)


def haff_rate(scene: Scene) -> float:
    """Haff's α by Enskog's rates at the start of a scene, 1/s."""
    rates = enskog_rates(scene, starting_temperature(scene))
    return _haff_rate(scene, rates.ball_ball, rates.wall)


def finite_haff_rate(scene: Scene) -> float:
    """Haff's α at the start for exactly N balls in this container at fixed energy, 1/s.

    The rates are those of `Gas.finite_pair_rate`. A collision takes `theory.share_in_collision`
    instead of 1/N of the energy.
    """
    temperature = starting_temperature(scene)
    between = finite_pair_rate(scene, temperature)
    share = scene.number * theory.share_in_collision(2 * independent_velocities(scene))
    return share * _haff_rate(scene, between, wall_rate(scene, temperature))


def finite_pair_rate(scene: Scene, temperature: float = 1.0) -> float:
    """Ball-ball collisions of one ball for exactly N balls at fixed energy, 1/s."""
    ratio = fluid_state(scene, temperature).virial_ratio
    balls = float(scene.radii[0]), independent_velocities(scene), float(scene.masses[0])
    return theory.ball_ball_rate_from_virial(ratio, temperature, *balls)


def _haff_rate(scene: Scene, ball_ball: float, wall: float) -> float:
    losses = scene.restitution, ball_ball, scene.wall_restitution, wall
    return theory.haff_rate(theory.cooling_rate(*losses))


def walls_of(scene: Scene) -> list[tuple[Law, float]]:
    """The law and the length (m) of each wall, as the centres of the balls see them."""
    law, container = scene.wall_law, scene.container
    radius = float(np.mean(scene.radii))
    if not isinstance(law, Sides):
        return [(law, container.accessible(radius).edge)]
    sides = container.side_lengths(radius).items()
    return [(getattr(law, side), length) for side, length in sides]


def balance_temperature(scene: Scene) -> float:
    """T at which walls give what collisions take, J; see `theory.balance_temperature`."""
    balls = scene.number, float(scene.radii[0]), float(scene.masses[0]), scene.restitution
    return theory.balance_temperature(*balls, scene.container, walls_of(scene))


def species_ratio(scene: Scene) -> float:
    """T₁/T₂ of two species in the homogeneous cooling state.

    The balls' momentum is zero, see `two_temperatures.temperatures_at_rest`.
    """
    groups = structure.species(scene)
    numbers = np.array([float(len(balls)) for balls in groups])
    masses, radii = (
        np.array([column[balls[0]] for balls in groups]) for column in (scene.masses, scene.radii)
    )
    densities = numbers / scene.container.area
    ratio = two_temperatures.species_ratio(densities, masses, radii, scene.restitution)
    first, second = two_temperatures.temperatures_at_rest(np.array([ratio, 1.0]), numbers, masses)
    return float(first / second)


def heated_ratio(scene: Scene) -> float:
    """T_rot/T_tr of rough balls whose walls heat the motion alone."""
    assert scene.surface is not None
    return two_temperatures.heated_ratio(scene.surface.tangential_cor, scene.surface.inertia)


# Laws of the speeds: of a ball with m = 1 at T = 1/2, whose speed is v √(m/2T).

EDGES = np.linspace(0.0, (SPEED_BINS - 1) * SPEED_BIN, SPEED_BINS)
HEAT = 0.5


class SpeedLaw(NamedTuple):
    """A distribution of speeds: its kurtosis, and the share of speeds below each histogram bin."""

    kurtosis: float
    shares: Array


def maxwell_law(_scene: Scene) -> SpeedLaw:
    """Maxwell's law."""
    return SpeedLaw(2.0, theory.maxwell_speed_cdf(EDGES, HEAT))


def fixed_energy_law(scene: Scene) -> SpeedLaw:
    """The law of balls that share a fixed energy."""
    free = independent_velocities(scene)
    shares = theory.fixed_energy_speed_cdf(EDGES, free, HEAT)
    return SpeedLaw(theory.fixed_energy_kurtosis(free), shares)


def cooling_law(scene: Scene) -> SpeedLaw:
    """The law of a large gas that cools."""
    a2 = theory.sonine_coefficient(scene.restitution)
    return SpeedLaw(2.0 * (1 + a2), theory.sonine_speed_cdf(EDGES, HEAT, a2))


def finite_cooling_law(scene: Scene) -> SpeedLaw:
    """`cooling_law` with the kurtosis of balls that share the energy of the moment."""
    return cooling_law(scene)._replace(kurtosis=finite_cooling_kurtosis(scene))


def finite_cooling_kurtosis(scene: Scene) -> float:
    """⟨v⁴⟩/⟨v²⟩² of a gas that cools, of balls that share the energy of the moment."""
    a2 = theory.sonine_coefficient(scene.restitution)
    return theory.fixed_energy_kurtosis(independent_velocities(scene)) * (1 + a2)


# What repeats keep, and how warm they are over time.


def floors(measurement: Measurement) -> Array:
    """Energy that conservation laws keep in each repeat, over that at the start.

    A circle keeps the balls' angular momentum about its centre. This needs at least the energy of a
    rigid rotation, here with the places of the balls in the end. A periodic box keeps their
    momentum. nan where nothing is kept (a box, a light circle), and at rest.
    """
    scene, container = measurement.scene, measurement.scene.container
    kept = np.full_like(measurement.start_energy, math.nan)
    if not container.has_wall:
        kept = measurement.drift_energy
    elif container.keeps_rotation and is_heavy(scene):
        kept = measurement.rotation_energy
    with np.errstate(invalid="ignore"):
        return kept / measurement.start_energy


def is_heavy(scene: Scene) -> bool:
    """Whether the container is fixed, or too heavy to take much angular momentum."""
    return scene.container_mass >= HEAVY * float(np.sum(scene.masses))


def temperatures(measurement: Measurement) -> tuple[Array, Array]:
    """Collisions per ball at the rows of the curve, and T_tr and T_rot of rough balls there, J.

    (*repeats*, *rows*) and (2, *repeats*, *rows*). T_tr is that at which balls meet.
    """
    scene, curve, number = measurement.scene, measurement.curve, measurement.scene.number
    drift = measurement.drift_energy[:, np.newaxis]
    moving = observables.meeting_temperature(curve.kinetic_energy, scene, drift)
    collisions = observables.collisions_per_ball(curve.pair_events, number)
    return collisions, np.stack([moving, 2 * curve.spin_energy / number])


def cooling_spins(measurement: Measurement) -> Array:
    """What theory predicts for `temperatures`, from the first row on, J."""
    surface, cor = measurement.scene.surface, measurement.scene.restitution
    assert surface is not None
    collisions, both = temperatures(measurement)
    values = cor, surface.tangential_cor, surface.inertia
    courses = [
        two_temperatures.rough_temperatures(since, start, *values)
        for since, start in zip(collisions - collisions[:, :1], both[:, :, 0].T, strict=True)
    ]
    return np.stack(courses, axis=1)


def late_spins(scene: Scene, collisions: float) -> float:
    """T_rot/T_tr in the second half of the collisions of a ball, from a start by theory."""
    surface = scene.surface
    assert surface is not None
    start = np.array([starting_temperature(scene), 2 * scene.spin_energy / scene.number])
    each = np.linspace(0.0, collisions, LATE_PLACES)
    values = scene.restitution, surface.tangential_cor, surface.inertia
    both = two_temperatures.rough_temperatures(each, start, *values)
    return float(late_ratio(each[np.newaxis], both[:, np.newaxis])[0])


LATE_PLACES = 200  # places along the collisions of a ball, for a mean over them


def late_ratio(collisions: Array, both: Array) -> Array:
    """T_rot/T_tr in the second half of the collisions; (*repeats*,).

    collisions, both : as `temperatures` returns them

    It is the ratio of the mean shares. The mean of ratios would be too large.
    """
    return _mean_ratio(both, collisions >= collisions[:, -1:] / 2)


def late_quarters(measurement: Measurement) -> Array:
    """`late_ratio` in the quarters of the second half of the collisions, (*repeats*, 4)."""
    collisions, both = temperatures(measurement)
    edges = collisions[:, -1:] * np.linspace(0.5, 1.0, 5)
    edges[:, -1] = math.inf  # the last row counts
    since, until = edges[:, :-1, np.newaxis], edges[:, 1:, np.newaxis]
    rows = (since <= collisions[:, np.newaxis]) & (collisions[:, np.newaxis] < until)
    return np.stack([_mean_ratio(both, rows[:, place]) for place in range(4)], axis=1)


def _mean_ratio(both: Array, rows: NDArray[np.bool_]) -> Array:
    """T_rot/T_tr of repeats over some rows; nan without a row."""
    shares = np.where(rows, both[1] / both.sum(axis=0), 0.0)
    share = np.sum(shares, axis=1) / np.sum(rows, axis=1)
    return np.asarray(share / (1 - share))


def pooled_ratio(above: Array, below: Array) -> Array:
    """Values of repeats with the mean of `above` over that of `below`, and its standard error.

    The mean of single ratios would be biased by the fluctuations of a short repeat.
    """
    ratio = above.mean() / below.mean()
    return np.asarray(ratio + (above - ratio * below) / below.mean())


class Gas:
    """The repeats of a point, and what several theories need of them.

    repeats : the measurement, or a scene for values that need no more
    constants : the fitted constants of the repeats, 1/s, by quantity and law
    first_window : the window in which the steady part begins, of a gas that walls keep warm
    profile : density and temperature across the container in the steady part
    """

    def __init__(
        self,
        repeats: Measurement | Scene,
        constants: Mapping[tuple[str, str], Array] | None = None,
        first_window: int | None = None,
        profile: Profile | None = None,
    ) -> None:
        self._repeats = None if isinstance(repeats, Scene) else repeats
        self._profile = profile
        self.scene = repeats if isinstance(repeats, Scene) else repeats.scene
        self.constants, self.first_window = constants or {}, first_window
        self.number, self.container = self.scene.number, self.scene.container
        self.radius, self.mass = float(self.scene.radii[0]), float(self.scene.masses[0])
        self.density = self.number / self.container.area

    @property
    def measurement(self) -> Measurement:
        """The measurement of these repeats."""
        assert self._repeats is not None
        return self._repeats

    @property
    def profile(self) -> Profile:
        """The profile of these repeats."""
        assert self._profile is not None
        return self._profile

    @cached_property
    def conduction(self) -> Conduction:
        """The heat that this profile conducts."""
        return conduction(self.scene, self.profile)

    @cached_property
    def heat_through(self) -> Array:
        """The flux of heat through the walls at both ends of a profile; (*repeats*, 2), J/(m s).

        It is positive in the direction of x or y, and nan of a repeat without a steady part.
        """
        axis, sides = axis_across(self.scene), self.container.sides
        ends = [sides.index(side) for side in ENDS[self.container.across or "x"]]
        given = self.measurement.by_side[:, self.first_window :, ends].sum(axis=1)
        seconds = self.means.length[:, np.newaxis]
        return np.asarray(given * (1, -1) / (self.container.size[1 - axis] * seconds))

    @cached_property
    def means(self) -> Averages:
        """Means over the part after the relaxation, or over the steady part."""
        if self.first_window is None:
            return self.measurement.relaxed
        return self.measurement.windows.from_window(self.first_window)

    def mean_of_states(self, name: str) -> Array:
        """The mean of a quantity of single states over those of the same part; nan without any."""
        measured = self.measurement
        if name not in measured.observables:
            return np.full(len(measured.time), math.nan)
        values = measured.in_states[:, :, measured.observables.index(name)]
        begins = (self.first_window or 0) / WINDOWS * measured.time[:, np.newaxis]
        counted = np.isfinite(values) & (measured.state_times >= begins)
        total = np.where(counted, values, 0.0).sum(axis=1)
        return np.asarray(total / counted.sum(axis=1))

    def ratio(self, above: Array, below: Array) -> Array:
        """A ratio in each repeat; in a steady part the ratio of the means, see `pooled_ratio`."""
        return above / below if self.first_window is None else pooled_ratio(above, below)

    @property
    def temperature(self) -> Array:
        """The mean energy of a ball, J."""
        return self.means.kinetic_energy / self.number

    @property
    def root_temperature(self) -> Array:
        """The mean of √T, √J."""
        return self.means.root_energy / math.sqrt(self.number)

    @property
    def meeting_ratio(self) -> Array:
        """The temperature at which balls meet over that of all motion: 1 with walls."""
        return self.means.meeting / self.temperature

    @property
    def pressure(self) -> Array:
        """The pressure, Pa m."""
        return self.means.pressure(self.scene)

    @property
    def ideal_pressure(self) -> Array:
        """N T/V, Pa m."""
        return self.density * self.temperature

    @property
    def wall_rate(self) -> Array:
        """Hits of the wall by one ball, 1/s."""
        return self.means.wall_events / (self.number * self.means.length)

    @property
    def pair_rate(self) -> Array:
        """Collisions of one ball with others, 1/s."""
        return 2 * self.means.pair_events / (self.number * self.means.length)

    @property
    def fixed_speed(self) -> Array:
        """The mean speed of balls that share the energy of the moment, m/s."""
        free = independent_velocities(self.scene)
        return theory.fixed_energy_mean_speed(free, 1.0, self.mass) * self.root_temperature

    @property
    def starting_speed_ratio(self) -> Array:
        """√ of the temperature at which each repeat starts over that of the scene."""
        return np.sqrt(self.starting_heat / starting_temperature(self.scene))

    @property
    def starting_heat(self) -> Array:
        """The temperature at which balls meet at the start of each repeat, J."""
        return (self.measurement.start_energy - self.drift_energy) / (components(self.scene) / 2)

    @property
    def drift_energy(self) -> Array | float:
        """Energy of the balls' common motion without walls, which stays, J."""
        return 0.0 if self.container.has_wall else self.measurement.drift_energy

    def left_by_rates(self) -> Array:
        """Energy left at the end over that at the start where the CoR depends on the speed.

        At the wall ½mv² of the normal speed has the density that T s has between balls of 2m.
        """
        scene, enskog = self.scene, enskog_rates(self.scene)
        assert not isinstance(scene.wall_law, Sides)
        wall_law = scene.wall_law

        def rate(temperature: Array) -> Array:
            """ζ at temperatures."""
            between = (
                theory.mean_loss(scene.pair_law, temperature, self.mass) * enskog.ball_ball / 2
            )
            wall = theory.mean_loss(wall_law, temperature, 2 * self.mass) * enskog.wall
            return np.asarray((between + wall) * np.sqrt(temperature))

        first = self.starting_heat
        left = theory.cooled_temperature(first, self.measurement.time, rate) / first
        kept = self.drift_energy / self.measurement.first_energy
        return kept + (1 - kept) * left

    def left_by_count(self, fewer: int = 0) -> Array:
        """Energy left at the end over that at the start, by the number of collisions.

        fewer : components of the velocities that do not share it
        """
        scene, events = self.scene, self.measurement.calm_events.astype(np.float64)
        walls, pairs = events.T
        shares = scene.restitution, pairs, scene.wall_restitution, walls
        return theory.energy_ratio_by_events(components(scene) - fewer, *shares)

    def left_above_floor(self) -> Array:
        """`left_by_count` of the energy above that which conservation laws keep, see `floors`.

        In a circle one component less shares it. nan where nothing is kept, as in a light circle.
        """
        kept, above = floors(self.measurement), self.left_by_count(int(self.container.has_wall))
        return kept + (1 - kept) * above
