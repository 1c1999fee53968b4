"""A scene -> its fluid, rates and conserved energy; repeats -> measured and predicted values."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory, two_temperatures
from snooker_cli.analysis import observables, quantities, structure
from snooker_cli.analysis.decay import Note, reported_constants
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.observables import (
    NO_WALLS,
    collisions_per_ball,
    drift_energy,
    elastic,
)
from snooker_cli.analysis.stationarity import Change, change_of
from snooker_cli.containers import Container
from snooker_cli.formatting import listed
from snooker_cli.laws import Constant, Law, Sides, parts_of, word_of
from snooker_cli.scene import Scene
from snooker_cli.theory import FINITE, IDEAL, INFINITE
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

Array: TypeAlias = NDArray[np.float64]

Row: TypeAlias = tuple[str, str, Array, Array | float]
"""A quantity and a model; the measured and the predicted values of the repeats, or of all alike."""

EQUILIBRIUM = tuple(
    one.name
    for one in (
        *(quantities.PRESSURE, quantities.TEMPERATURE, quantities.RATIO, quantities.VIRIAL_RATIO),
        *(quantities.WALL_RATE, quantities.PAIR_RATE, quantities.FREE_PATH),
        *(quantities.MEAN_SPEED, quantities.KURTOSIS),
    )
)
"""The quantities that are measured after the relaxation."""

GIVEN, CHI_SQUARE = quantities.GIVEN.name, quantities.CHI_SQUARE.name
SPECIES_RATIO, SPIN_RATIO = quantities.SPECIES_RATIO.name, quantities.SPIN_RATIO.name

NO_THEORY = "no theory"
"""The model of a row that has a measured value only."""

ENSKOG_START = "Enskog rates at the start"
"""The model of Haff's α by Enskog's rates, `haff_rate`."""

LEFT = quantities.ENERGY_LEFT.name

EVENT_COUNT = "by event count"
"""The model of `theory.energy_ratio_by_events`."""

ABOVE_ROTATION, ABOVE_DRIFT = f"{EVENT_COUNT}, above L²/2I", f"{EVENT_COUNT}, above p²/2M"
"""The same for the energy above that which conservation laws keep, see `floors`."""

HEAVY = 1000.0
"""A free container this many times as heavy as the balls keeps their angular momentum."""


def fluid(
    number: float, temperature: float, radius: float, container: Container
) -> theory.FluidState | None:
    """The state of equal hard disks; ``None`` at rest, or if they are too dense to be a fluid."""
    packing = container.packing_fraction(number * radius**2)
    if temperature == 0.0 or packing > theory.DENSEST_FLUID:
        return None
    try:
        return theory.fluid_state(number, temperature, radius, container)
    except ValueError:
        return None


def scene_state(scene: Scene, temperature: float) -> theory.FluidState | None:
    """The state of a scene's balls; ``None`` without a theory.

    There is none for one ball, unequal ones, a dense packing, or N balls between walls along which
    they keep their momentum, as in a channel.
    """
    if scene.number < 2 or not scene.equal_balls or scene.container.keeps_drift():
        return None
    return fluid(scene.number, temperature, float(scene.radii[0]), scene.container)


class DiskRatio(NamedTuple):
    """PV/NT of equal hard disks by a theory: at the walls, and by the virial of the balls.

    Without walls T is the temperature at which balls meet, and the two are the same.
    """

    pressure: float
    virial: float


def disk_ratios(scene: Scene) -> dict[str, DiskRatio]:
    """PV/NT of equal balls with one CoR, by the name of the theory; empty without one.

    There is none for one ball, unequal ones, a CoR that depends on the speed, or a dense packing;
    N balls in a channel, and rough ones, have that of a very large gas only.
    """
    packing, law = scene.packing_fraction, scene.pair_law
    if scene.number < 2 or not scene.equal_balls or packing > theory.DENSEST_FLUID:
        return {}
    if not isinstance(law, Constant):
        return {}
    large = theory.granular_compressibility(packing, law.cor)
    balls = scene.number, float(scene.radii[0]), scene.container
    fixed = scene.surface is None and not scene.container.keeps_drift()
    finite = finite_ratio(*balls, law.cor) if fixed else None
    return {INFINITE: DiskRatio(large, large)} | ({FINITE: finite} if finite else {})


def finite_ratio(
    number: float, radius: float, container: Container, restitution: float
) -> DiskRatio | None:
    """PV/NT of N equal hard disks in a container; ``None`` if they are too dense to be a fluid."""
    if (state := fluid(number, 1.0, radius, container)) is None:
        return None
    state = state.inelastic(restitution)
    return DiskRatio(state.pressure * container.area / number, state.virial_ratio)


def scene_rates(scene: Scene, temperature: float) -> theory.CollisionRates | None:
    """Enskog's collision rates of a scene at a temperature (J); ``None`` as in `scene_state`."""
    if scene_state(scene, temperature) is None:
        return None
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    walls = scene.container, mass, scene.container_mass
    return theory.collision_rates(scene.number, temperature, radius, *walls)


def haff_rate(scene: Scene) -> float | None:
    """Haff's α by Enskog's rates at the start of a scene, 1/s; ``None`` as in `scene_state`.

    Rough balls have none, because they begin with other shares of the energy than they keep.
    """
    if scene.surface is not None:
        return None
    rates = scene_rates(scene, observables.meeting_temperature(scene.kinetic_energy, scene))
    return None if rates is None else _haff_rate(scene, rates.ball_ball, rates.wall)


def _haff_rate(scene: Scene, ball_ball: float, wall: float) -> float:
    losses = scene.restitution, ball_ball, scene.wall_restitution, wall
    return theory.haff_rate(theory.cooling_rate(*losses))


def components(scene: Scene) -> int:
    """Components of the velocities that share the energy: momentum is kept along axes of images."""
    return 2 * scene.number - sum(scene.container.periodic)


def finite_haff_rate(scene: Scene) -> float | None:
    """Haff's α at the start for exactly N balls in this container at fixed energy, 1/s.

    The rates are those of `rates` below. A collision takes `theory.share_in_collision` instead of
    1/N of the energy. ``None`` as in `scene_state`.
    """
    warm = observables.meeting_temperature(scene.kinetic_energy, scene)
    state, enskog = scene_state(scene, warm), scene_rates(scene, warm)
    if state is None or enskog is None:
        return None
    radius, mass, free = float(scene.radii[0]), float(scene.masses[0]), components(scene) // 2
    between = theory.ball_ball_rate_from_virial(state.virial_ratio, warm, radius, free, mass)
    share = scene.number * theory.share_in_collision(2 * free)
    return share * _haff_rate(scene, between, enskog.wall)


def at_rest(scene: Scene) -> bool:
    """Whether the balls' centre of mass is at rest, but for rounding."""
    return drift_energy(scene) <= observables.ROUNDING * scene.kinetic_energy


def independent_velocities(scene: Scene) -> int | None:
    """Number of independent velocities at fixed energy; ``None`` where the law of speeds fails.

    With walls all of them. Without walls one less, because total momentum is kept, and only for
    balls of one mass whose centre of mass is at rest. A channel has half of one less. Walls
    that give energy, and spins, do not fix it.
    """
    if scene.container.keeps_drift() or scene.wall_law.gains or scene.surface is not None:
        return None
    if scene.container.has_wall:
        return scene.number
    known = scene.number > 2 and np.ptp(scene.masses) == 0 and at_rest(scene)
    return scene.number - 1 if known else None


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
    elif container.keeps_rotation and _heavy(scene):
        kept = measurement.rotation_energy
    with np.errstate(invalid="ignore"):
        return kept / measurement.start_energy


def _on_rings(scene: Scene) -> bool:
    """Whether two or more balls are on even rings, 6k on the k-th, as `balls.rings` places them."""
    rings = round((math.sqrt(12 * scene.number - 3) - 3) / 6)
    if rings < 1 or 1 + 3 * rings * (rings + 1) != scene.number:
        return False
    distances = np.sort(np.hypot(*(scene.positions - scene.container_position).T))
    ranks = np.repeat(np.arange(rings + 1), [1, *(6 * k for k in range(1, rings + 1))])
    return np.allclose(distances, distances[-1] * ranks / rings, rtol=observables.ROUNDING)


def _heavy(scene: Scene) -> bool:
    """Whether the container is fixed, or too heavy to take much angular momentum."""
    return scene.container_mass >= HEAVY * float(np.sum(scene.masses))


# Repeats -> measured and predicted values: the rows of `snooker compare`, and notes for a reader.
# Pressures, rates and speeds are means over the time after the relaxation.


def pressures(measurement: Measurement) -> Iterator[Row]:
    """Pressures: of an ideal gas, and of equal hard disks."""
    scene, relaxed = measurement.scene, measurement.relaxed
    pressure, temperature = relaxed.pressure(scene), relaxed.kinetic_energy / scene.number
    ideal = theory.ideal_gas_pressure(scene.number, 1.0, scene.container.area)
    ratio = relaxed.ideal_gas_ratio(scene)
    yield "pressure", IDEAL, pressure, ideal * temperature
    yield "temperature", f"{IDEAL}, PV/N", temperature, pressure / ideal
    yield "PV/NT", IDEAL, ratio, 1.0
    if not scene.equal_balls:
        return
    walls, number, radius = scene.container.has_wall, scene.number, float(scene.radii[0])
    # Without walls balls meet at a temperature of their own; with them this is one.
    met = relaxed.meeting / temperature
    if walls:
        accessible = theory.accessible_wall_pressure(number, 1.0, radius, scene.container)
        yield "pressure", "accessible area", pressure, accessible * temperature
    disks = dict[str, DiskRatio]()
    if scene_state(scene, 1.0) is not None:
        disks = disk_ratios(scene)
        excluded = theory.van_der_waals_pressure(number, 1.0, scene.container.area, radius) / ideal
        corrected = 1 + (excluded - 1) * met
        yield "pressure", "van der Waals", pressure, corrected * ideal * temperature
    expected = {model: 1 + (one.pressure - 1) * met for model, one in disks.items()}
    for model, value in expected.items():
        yield "pressure", model, pressure, value * ideal * temperature
    for model, value in expected.items():
        yield "PV/NT", model, ratio, value
    for model, one in disks.items() if walls else ():
        yield "PV/NT by the virial", model, relaxed.virial_ratio, one.virial
    published = theory.published_ratio(scene.packing_fraction)
    if published is not None and elastic(scene) and not walls:
        yield "PV/NT", published.source, relaxed.virial_ratio, 1 + (published.ratio - 1) * met


def rates(measurement: Measurement) -> Iterator[Row]:
    """Collision rates and the mean free path of equal balls."""
    scene, relaxed = measurement.scene, measurement.relaxed
    free = components(scene) // 2
    if not scene.equal_balls or free == 0:  # of one ball in a channel
        return
    enskog, number, container = scene_rates(scene, 1.0), scene.number, scene.container
    radius, mass = float(scene.radii[0]), float(scene.masses[0])
    root = relaxed.root_energy / math.sqrt(number)
    speed = theory.fixed_energy_mean_speed(free, 1.0, mass) * root
    if container.has_wall:
        wall = relaxed.wall_events / (number * relaxed.length)
        relative = speed * theory.wall_speed_ratio(mass, scene.container_mass)
        ideal = theory.wall_rate(relative, container.accessible(radius))
        yield "wall rate of a ball", "ideal gas", wall, ideal
        if enskog is not None and scene.surface is None:
            yield "wall rate of a ball", FINITE, wall, enskog.wall * root
    state = scene_state(scene, 1.0)
    if enskog is None or state is None:
        return
    pairs = 2 * relaxed.pair_events / (number * relaxed.length)
    density, root = number / container.area, relaxed.root_meeting
    dilute = theory.ball_ball_rate(density, radius, 1.0, mass=mass)
    here = theory.ball_ball_rate_from_virial(state.virial_ratio, 1.0, radius, free, mass) * root
    yield "ball-ball rate of a ball", "Boltzmann", pairs, dilute * root
    yield "ball-ball rate of a ball", "Enskog", pairs, enskog.ball_ball * root
    if scene.surface is None:
        yield "ball-ball rate of a ball", FINITE, pairs, here
    path = relaxed.mean_speed / pairs
    source = theory.source_mean_free_path(density, radius)
    yield "mean free path", "Boltzmann", path, theory.mean_free_path(density, radius)
    yield "mean free path", "Enskog", path, enskog.mean_free_path
    # A drift adds to the path of each ball.
    if (container.has_wall or at_rest(scene)) and scene.surface is None:
        yield "mean free path", FINITE, path, speed / here
    yield "mean free path", "source report, 1/(√2 n 2πr)", path, source


def cooling(measurement: Measurement, constants: Mapping[tuple[str, str], Array]) -> Iterator[Row]:
    """Decay constants and the energy that is left, where a gas of equal balls loses energy.

    constants : the fitted constants of the repeats, 1/s, by quantity and law
    """
    scene = measurement.scene
    if elastic(scene) or scene.number == 1 or not scene.equal_balls or scene.surface is not None:
        return
    if not scene.constant_laws:
        yield from _slower_cooling(measurement)
        return
    reported = reported_constants(measurement)
    k, alpha = constants["kinetic_energy", "exponential"], constants["kinetic_energy", "haff"]
    yield "decay constant of energy", "source report, −2 ln e/τ", k, reported
    k = constants["pressure", "exponential"]
    yield "decay constant of pressure", "source report, −ln e/τ", k, reported / 2
    drift = 0.0 if scene.container.has_wall else measurement.drift_energy
    heat = (measurement.start_energy - drift) / (components(scene) / 2)
    root = np.sqrt(heat / observables.meeting_temperature(scene.kinetic_energy, scene))
    if (expected := haff_rate(scene)) is not None:
        yield "Haff's α", ENSKOG_START, alpha, expected * root
    if (expected := finite_haff_rate(scene)) is not None:
        yield "Haff's α", FINITE, alpha, expected * root
    left = measurement.calm_energy / measurement.first_energy
    walls, pairs = (events.astype(np.float64) for events in measurement.calm_events.T)
    shares = scene.restitution, pairs, scene.wall_restitution, walls
    by_events = theory.energy_ratio_by_events(components(scene), *shares)
    yield LEFT, EVENT_COUNT, left, by_events
    kept, walls_too = floors(measurement), scene.container.has_wall
    if walls_too or not at_rest(scene):
        above = theory.energy_ratio_by_events(components(scene) - walls_too, *shares)
        yield LEFT, ABOVE_ROTATION if walls_too else ABOVE_DRIFT, left, kept + (1 - kept) * above


def _slower_cooling(measurement: Measurement) -> Iterator[Row]:
    """The energy that is left where the restitution depends on speed, see `theory.mean_loss`.

    At the wall ½mv² of the normal speed has the density that T s has between balls of 2m.
    """
    scene, mass = measurement.scene, float(measurement.scene.masses[0])
    pair_law, wall_law = scene.pair_law, scene.wall_law
    if (enskog := scene_rates(scene, 1.0)) is None or isinstance(wall_law, Sides):
        return
    if _unknown_loss(scene) is not None:
        return

    def rate(warm: Array) -> Array:
        """ζ at temperatures."""
        between = theory.mean_loss(pair_law, warm, mass) * enskog.ball_ball / 2
        wall = theory.mean_loss(wall_law, warm, 2 * mass) * enskog.wall
        return np.asarray((between + wall) * np.sqrt(warm))

    drift = 0.0 if scene.container.has_wall else measurement.drift_energy
    first = (measurement.start_energy - drift) / (components(scene) / 2)
    left = theory.cooled_temperature(first, measurement.time, rate) / first
    kept = drift / measurement.first_energy
    ratio = measurement.calm_energy / measurement.first_energy
    yield LEFT, "Enskog rates, e(v)", ratio, kept + (1 - kept) * left


def _unknown_loss(scene: Scene) -> Law | None:
    """The first law of a scene whose losses theory does not know, see `theory.mean_loss`."""
    laws = scene.pair_law, *(parts_of(scene.wall_law) if scene.container.has_wall else ())
    return next((law for law in laws if not (law.gains or theory.has_mean_loss(law))), None)


class SpeedLaw(NamedTuple):
    """A distribution of speeds: its kurtosis, and the share of speeds below each histogram bin."""

    model: str
    kurtosis: float
    shares: NDArray[np.float64]


def speed_laws(scene: Scene) -> list[SpeedLaw]:
    """The laws that the balls' speeds may follow; none for one ball, or where none applies."""
    if scene.number < 2 or not (scene.equal_balls or elastic(scene)):
        return []
    # The reduced speed v √(m/2T) is the speed of a ball with m = 1 at T = 1/2.
    edges = np.linspace(0.0, (SPEED_BINS - 1) * SPEED_BIN, SPEED_BINS)
    heat, free = 0.5, independent_velocities(scene)
    laws = [SpeedLaw("Maxwell-Boltzmann", 2.0, theory.maxwell_speed_cdf(edges, heat))]
    if free is not None:
        shares = theory.fixed_energy_speed_cdf(edges, free, heat)
        laws.append(SpeedLaw("fixed energy", theory.fixed_energy_kurtosis(free), shares))
    if scene.constant_laws and 0 < scene.restitution < 1:
        a2 = theory.sonine_coefficient(scene.restitution)
        shares = theory.sonine_speed_cdf(edges, heat, a2)
        kurtosis = 2.0 if free is None else theory.fixed_energy_kurtosis(free)
        laws.append(SpeedLaw("homogeneous cooling, a2", kurtosis * (1 + a2), shares))
    return laws


def speeds(measurement: Measurement) -> Iterator[Row]:
    """The mean speed of balls of one mass, and the kurtosis of speeds."""
    scene, relaxed = measurement.scene, measurement.relaxed
    laws, free = speed_laws(scene), independent_velocities(scene)
    if laws and np.ptp(scene.masses) == 0:
        mass, root = float(scene.masses[0]), relaxed.root_energy / math.sqrt(scene.number)
        maxwell = theory.maxwell_mean_speed(1.0, mass) * root
        yield "mean speed", "Maxwell-Boltzmann", relaxed.mean_speed, maxwell
        if free is not None:
            fixed = theory.fixed_energy_mean_speed(free, 1.0, mass) * root
            yield "mean speed", "fixed energy", relaxed.mean_speed, fixed
    for law in laws:
        yield "kurtosis of speeds", law.model, relaxed.energy_moment, law.kurtosis


def species_ratio(scene: Scene) -> float | None:
    """T₁/T₂ of these balls in the homogeneous cooling state; ``None`` without a theory.

    There is one for two species in a periodic box at rest, with one CoR at all speeds. The balls'
    momentum is zero, see `two_temperatures.temperatures_at_rest`.
    """
    walls = scene.container.has_wall or scene.contact_duration > 0 or scene.elastic_below > 0
    if walls or not structure.is_binary(scene) or not (scene.constant_laws and at_rest(scene)):
        return None
    if scene.packing_fraction > theory.DENSEST_FLUID or scene.kinetic_energy == 0:
        return None
    groups = structure.species(scene)
    numbers = np.array([float(len(balls)) for balls in groups])
    masses, radii = (
        np.array([column[balls[0]] for balls in groups]) for column in (scene.masses, scene.radii)
    )
    densities = numbers / scene.container.area
    ratio = two_temperatures.species_ratio(densities, masses, radii, scene.restitution)
    first, second = two_temperatures.temperatures_at_rest(np.array([ratio, 1.0]), numbers, masses)
    return float(first / second)


UNMEASURED = {
    SPECIES_RATIO: "no state of the balls after the relaxation is stored; run the config with "
    "`record: events` or `snapshots`",
}
"""Why a quantity has no measured value in any repeat, where it needs more than a summary."""


def mixtures(measurement: Measurement) -> Iterator[Row]:
    """The ratio of the temperatures of two species; theory is without walls."""
    scene = measurement.scene
    if not has_two_temperatures(scene):
        return
    expected, (first, second) = species_ratio(scene), measurement.species_shares.T
    if expected is None:
        yield SPECIES_RATIO, NO_THEORY, first / second, math.nan
    else:
        yield SPECIES_RATIO, two_temperatures.EQUAL_RATES, first / second, expected


def has_two_temperatures(scene: Scene) -> bool:
    """Whether T₁/T₂ is a result: theory has it, or two species cool."""
    return species_ratio(scene) is not None or (structure.is_binary(scene) and not elastic(scene))


def temperatures(measurement: Measurement) -> tuple[Array, Array]:
    """Collisions per ball at the rows of the curve, and T_tr and T_rot of rough balls there, J.

    (*repeats*, *rows*) and (2, *repeats*, *rows*). T_tr is that at which balls meet.
    """
    scene, curve, number = measurement.scene, measurement.curve, measurement.scene.number
    drift = measurement.drift_energy[:, np.newaxis]
    moving = observables.meeting_temperature(curve.kinetic_energy, scene, drift)
    return collisions_per_ball(curve.pair_events, number), np.stack(
        [moving, 2 * curve.spin_energy / number]
    )


def cooling_spins(measurement: Measurement) -> Array | None:
    """What theory has for `temperatures`, from the first row on, J; ``None`` without a theory.

    There is one for equal balls of one CoR, without friction, whose walls keep their energy.
    """
    scene, surface, law = measurement.scene, measurement.scene.surface, measurement.scene.pair_law
    if surface is None or not (scene.equal_balls and isinstance(law, Constant)):
        return None
    if math.isfinite(surface.friction) or scene.number < 2:
        return None
    if scene.contact_duration > 0 or scene.elastic_below > 0:
        return None
    if scene.container.has_wall and (scene.wall_law != Constant(1.0) or surface.rubs_wall):
        return None
    collisions, both = temperatures(measurement)
    values = law.cor, surface.tangential_cor, surface.inertia
    courses = [
        two_temperatures.rough_temperatures(since, start, *values)
        for since, start in zip(collisions - collisions[:, :1], both[:, :, 0].T, strict=True)
    ]
    return np.stack(courses, axis=1)


def rotation(measurement: Measurement) -> Iterator[Row]:
    """T_rot/T_tr in the second half of the collisions."""
    if measurement.scene.surface is None:
        return
    collisions, both = temperatures(measurement)
    late = collisions >= collisions[:, -1:] / 2
    ratio = _spin_ratio(both, late)
    if (expected := cooling_spins(measurement)) is None:
        yield SPIN_RATIO, NO_THEORY, ratio, math.nan
    else:
        yield SPIN_RATIO, two_temperatures.MEAN_FIELD, ratio, _spin_ratio(expected, late)


def _spin_ratio(both: Array, rows: NDArray[np.bool_]) -> Array:
    """T_rot/T_tr of repeats over some rows, of their mean shares: the mean of ratios is too large.

    both : (2, *repeats*, *rows*) as of `temperatures`
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        sums = np.sum(rows, axis=1)
        share = np.sum(np.where(rows, both[1] / both.sum(axis=0), 0.0), axis=1) / sums
    return np.asarray(share / (1 - share))


def ratio_changes(measurement: Measurement) -> dict[str, Change]:
    """Whether T₁/T₂ and T_rot/T_tr change within the part that their means are over, by name."""
    complete, changes = measurement.chosen(measurement.complete), dict[str, Change]()
    if measurement.scene.wall_law.gains:
        return changes
    if measurement.scene.surface is not None:
        collisions, both = temperatures(complete)
        edges = collisions[:, -1:] * np.linspace(0.5, 1.0, 5)
        edges[:, -1] += 1.0  # the last row counts
        quarters = [
            _spin_ratio(
                both, (low[:, np.newaxis] <= collisions) & (collisions < high[:, np.newaxis])
            )
            for low, high in zip(edges.T[:-1], edges.T[1:], strict=True)
        ]
        changes[SPIN_RATIO] = change_of(np.array(quarters).T)
    if has_two_temperatures(measurement.scene):
        first, second = np.moveaxis(complete.species_quarters, 2, 0)
        changes[SPECIES_RATIO] = change_of(first / second)
    return changes


TURNING = (
    f"{FINITE}: the angular momenta are those of equilibrium; rings have others "
    "(7 balls: rates 4 % off)"
)
"""What a reader of the theory for N balls in a circle has to know."""


def impulse_notes(scene: Scene) -> Iterator[Note]:
    """What a reader of PV/NT of hard disks has to know if collisions between them lose energy."""
    disks, about = (
        disk_ratios(scene),
        "pressure, PV/NT, PV/NT by the virial, pressure by the virial",
    )
    if disks and scene.restitution < 1:
        text = "hard disks: an impulse between balls is (1 + CoR)/2 of an elastic one; uniform gas"
        yield Note(text, about, ", ".join(disks))
    elif scene.number > 1 and scene.equal_balls and not isinstance(scene.pair_law, Constant):
        text = (
            "PV/NT of hard disks is missing: the theory needs one CoR between balls at all speeds"
        )
        yield Note(text, about)


EQUAL_SPEEDS = (
    "Haff's α: theory is for mixed speeds; equal speeds lose less at first "
    "(`start: random` and `speeds: maxwell` start mixed)"
)


def notes(scene: Scene) -> Iterator[Note]:
    """What walls and their absence change; which rows are missing for these balls, and why."""
    in_circle = scene.container.keeps_rotation and scene.number > 1
    if in_circle and _heavy(scene) and _on_rings(scene):
        yield Note(TURNING, model=FINITE)
    if not scene.container.has_wall:
        yield Note(NO_WALLS, "pressure, temperature, PV/NT by the virial")
        if scene.number > 1 and scene.surface is None and independent_velocities(scene) is None:
            why = "two balls have one speed" if scene.number == 2 else "the balls' masses differ"
            if not at_rest(scene):
                why = "the balls' centre of mass moves on for ever"
            missing = f"the law of speeds at fixed energy is missing, because {why}"
            yield Note(missing, "mean speed, kurtosis of speeds, mean free path")
    yield from impulse_notes(scene)
    if has_two_temperatures(scene):
        first, second = structure.species_names(scene)
        text = f"T₁/T₂: 1 is {first}, 2 is {second}"
        if species_ratio(scene) is not None:
            text += (
                "; a uniform gas with Maxwell's velocities, which fails at a small CoR and in "
                "clusters"
            )
        yield Note(text, SPECIES_RATIO)
    if scene.surface is not None:
        text = (
            f"{SPIN_RATIO}: mean over the second half of the collisions; the theory is for equal "
            "balls without friction, whose velocities and spins are independent"
        )
        yield Note(text, SPIN_RATIO)
        missing = "theory of N balls and laws at fixed energy are missing"
        about = "pressure, PV/NT, wall rate of a ball, ball-ball rate of a ball, mean speed"
        yield Note(f"{missing}: spins take a part of the energy", about)
        if not elastic(scene):
            rows = f"decay constants and {LEFT}"
            yield Note(f"the theory needs smooth balls, so these rows are missing: {rows}")
    if scene.equal_balls and (law := _unknown_loss(scene)) is not None:
        text = f"{LEFT} is missing: theory.py has no mean_loss of the {word_of(law)} law"
        yield Note(text)
    speeds = np.linalg.norm(scene.velocities, axis=1)
    cools = scene.number > 1 and scene.surface is None and not elastic(scene)
    if cools and np.ptp(speeds) <= 1e-9 * np.max(speeds):
        yield Note(EQUAL_SPEEDS, "Haff's α")
    absent = ["equations of state", "collision rates", "mean free path"]
    cooling = ["decay constants", "energy left"]
    if scene.number == 1:
        why, others = "one ball meets no other", ["distribution of speeds", *cooling]
    elif not scene.equal_balls:
        why, others = "the theory needs equal balls", ["distribution of speeds", *cooling]
        if elastic(scene):
            others = ["mean speed"] if np.ptp(scene.masses) > 0 else []
    elif scene.container.keeps_drift():
        why = f"there is no theory for N balls in a {scene.container.title}"
        others = [] if elastic(scene) else ["Haff's α"]
    elif scene_state(scene, 1.0) is None:
        filled = f"the balls fill {scene.packing_fraction:.2f} of the area"
        why = f"the theory needs a fluid, and {filled}"
        others = [] if elastic(scene) else ["Haff's α"]
    else:
        return
    names = listed([*absent, *others])
    yield Note(f"{why}, so these rows are missing: {names}", f"{names}, {', '.join(EQUILIBRIUM)}")
