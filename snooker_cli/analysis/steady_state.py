"""A point whose walls give energy: what it measures when it is stationary, beside theory.

Walls that give energy keep a gas warm. After some time its means stop changing. Theories of cooling
and of a fixed energy do not hold there.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from snooker_cli import theory, two_temperatures
from snooker_cli.analysis import observables, predictions
from snooker_cli.analysis.decay import Note
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.predictions import GIVEN, NO_THEORY, Row
from snooker_cli.formatting import with_error
from snooker_cli.laws import Constant, Driven, Law, Sides, Thermal
from snooker_cli.scene import Scene
from snooker_cli.theory import FINITE, IDEAL

Array = NDArray[np.float64]

WALLS, BALANCE = "temperature of the wall", "balance of energy"

MOST_ROTATION = 0.01
"""Share of the energy in a common rotation above which a note says how to start without it."""


def pooled_ratio(above: Array, below: Array) -> Array:
    """Values of repeats with the mean of `above` over that of `below`, and its standard error.

    The mean of single ratios would be biased by the fluctuations of a short repeat.
    """
    ratio = above.mean() / below.mean()
    return np.asarray(ratio + (above - ratio * below) / below.mean())


def wall_temperature(scene: Scene) -> float | None:
    """The temperature of all walls that change the energy, J; ``None`` if they have no one.

    A rough wall that takes energy has none.
    """
    if scene.surface is not None and not scene.surface.elastic_wall:
        return None
    laws = [law for law, _ in _walls(scene) if law.gains or law.cor < 1]
    warm = {law.temperature if isinstance(law, Thermal) else None for law in laws}
    return warm.pop() if len(warm) == 1 else None


def _walls(scene: Scene) -> list[tuple[Law, float]]:
    """The law and the length (m) of each wall, as the centres of the balls see them."""
    law, container = scene.wall_law, scene.container
    radius = float(np.mean(scene.radii))
    if not isinstance(law, Sides):
        return [(law, container.accessible(radius).edge)]
    sides = container.side_lengths(radius).items()
    return [(getattr(law, side), length) for side, length in sides]


def expected_temperatures(scene: Scene) -> dict[str, float]:
    """The temperature that theory gives, J, by the name of the theory; empty without one.

    Walls that give energy must have one law: between two temperatures the gas is not uniform.
    """
    wall = wall_temperature(scene)
    if wall is not None and observables.elastic_pairs(scene):
        return {WALLS: wall}
    walls, radius, mass = _walls(scene), float(scene.radii[0]), float(scene.masses[0])
    if not (_have_one_law(scene) and _is_fluid(scene) and _is_smooth(scene)):
        return {}
    balls = scene.number, radius, mass, scene.restitution
    try:
        warm = theory.balance_temperature(*balls, scene.container, walls)
    except ValueError:
        return {}
    return {BALANCE: warm} if math.isfinite(warm) else {}


def _have_one_law(scene: Scene) -> bool:
    """Whether all walls that give energy have one law."""
    return len({law for law, _ in _walls(scene) if law.gains}) == 1


def _heated_spins(scene: Scene) -> dict[str, float]:
    """T_rot/T_tr that theory gives smooth walls, by the name of the theory; empty without one.

    Walls are as in `expected_temperatures`.
    """
    surface = scene.surface
    if surface is None or surface.rubs_wall or not scene.equal_balls or not _have_one_law(scene):
        return {}
    if math.isfinite(surface.friction) or surface.tangential_cor == -1:
        return {}
    ratio = two_temperatures.heated_ratio(surface.tangential_cor, surface.inertia)
    return {two_temperatures.MEAN_FIELD: ratio}


def _is_smooth(scene: Scene) -> bool:
    """Whether collisions between smooth balls have one CoR at all speeds."""
    return isinstance(scene.pair_law, Constant) and scene.surface is None


def _is_fluid(scene: Scene) -> bool:
    """Whether the balls are equal, two or more, and no denser than a fluid."""
    fluid = scene.number > 1 and scene.packing_fraction <= theory.DENSEST_FLUID
    return fluid and scene.equal_balls


def rows(measurement: Measurement, first: int) -> Iterator[Row]:
    """Means over the stationary part of complete repeats, beside theory.

    Theory is that of a uniform gas with Maxwell's speeds. Elastic balls in walls of one temperature
    are in equilibrium. Then theory also has the rate of hits for N balls in the container.
    """
    scene, steady = measurement.scene, measurement.windows.from_window(first)
    number, container, radius = scene.number, scene.container, float(scene.radii[0])
    density, mass, equal = number / container.area, float(scene.masses[0]), scene.equal_balls
    temperatures, fluid = expected_temperatures(scene), _is_fluid(scene)
    wall = temperatures.get(WALLS)
    finite = None if wall is None else predictions.scene_state(scene, 1.0)
    energy, length = steady.kinetic_energy, steady.length
    warm, root = energy / number, steady.root_energy / math.sqrt(number)  # √T is also a mean

    # What theories say: PV/NT at the walls and by the virial, χ of rates, and hits at T = 1 J.
    speed, disks = theory.maxwell_mean_speed(1.0, mass), predictions.disk_ratios(scene)
    ratios = {IDEAL: 1.0} | {model: one.pressure for model, one in disks.items()}
    virials = {model: one.virial for model, one in disks.items()}
    contacts = {"Boltzmann": 1.0} if equal else {}
    hits = {"ideal gas": theory.wall_rate(speed, container.accessible(radius))} if equal else {}
    if fluid:
        contacts["Enskog"] = theory.contact_value(scene.packing_fraction)
    if finite is not None:
        walls = finite.pressure, 1.0, container.wall_length, mass
        hits[FINITE] = theory.wall_rate_from_pressure(number, *walls)

    pressure, ideal, virial = steady.pressure(scene), density * warm, steady.pair_virial / length
    yield from _beside("temperature", warm, temperatures)
    yield from _beside("pressure", pressure, ratios, ideal)
    if number > 1:
        by_virial = ideal + virial / (2 * container.area)
        yield from _beside("pressure by the virial", by_virial, virials, ideal)
        yield from _beside("PV/NT by the virial", 1 + pooled_ratio(virial, 2 * energy), virials)
    yield from _beside("PV/NT", pooled_ratio(pressure, ideal), ratios)
    yield from _beside("wall rate of a ball", steady.wall_events / (number * length), hits, root)
    if number > 1:
        pairs = 2 * steady.pair_events / (number * length)
        dilute = theory.ball_ball_rate(density, radius, 1.0, mass=mass)
        paths = {m: theory.mean_free_path(density, radius, c) for m, c in contacts.items()}
        yield from _beside("ball-ball rate of a ball", pairs, contacts, dilute * root)
        yield from _beside("mean free path", pooled_ratio(steady.mean_speed, pairs), paths)
    if scene.surface is not None:
        ratio = pooled_ratio(2 * steady.spin_energy, energy)
        yield from _beside(predictions.SPIN_RATIO, ratio, _heated_spins(scene))
    if number > 1 and not observables.elastic_pairs(scene):
        given, taken = steady.wall_energy / length, steady.lost_energy / length
        yield GIVEN, "taken by collisions", given, taken
        losses = {}
        if equal and scene.surface is None and theory.has_mean_loss(scene.pair_law):
            share = theory.mean_loss(scene.pair_law, float(warm.mean()), mass)
            losses = {"Maxwell-Boltzmann": share}
        loss = pooled_ratio(steady.lost_energy, steady.pair_events)
        yield from _beside("energy taken by a collision", loss, losses, warm)
    if np.ptp(scene.masses) == 0:
        maxwell = speed * np.sqrt(warm if wall is None else wall)
        yield "mean speed", "Maxwell-Boltzmann", steady.mean_speed, maxwell
        square = energy.mean() * (2 * energy - energy.mean())  # to first order, E² of the mean E
        kurtosis = pooled_ratio(steady.squares, square)
        yield "kurtosis of speeds", "Maxwell-Boltzmann", kurtosis, 2.0
    for side, given in zip(container.sides, np.moveaxis(measurement.by_side, 2, 0), strict=True):
        if np.all(np.isfinite(given)):
            gains = given[:, first:].sum(axis=1) / length
            yield f"energy from the {side} wall", NO_THEORY, gains, math.nan
    across = measurement.across[:, first:].mean(axis=1)
    if np.all(np.isfinite(across)):
        yield "T across/T along", "equal parts", pooled_ratio(across, 1 - across), 1.0


def _beside(
    quantity: str, measured: Array, models: Mapping[str, float], scale: Array | float = 1.0
) -> Iterator[Row]:
    """A row for each model, with its value times the scale, or a row without theory."""
    for model, value in (models or {NO_THEORY: math.nan}).items():
        yield quantity, model, measured, value * scale


def notes(measurement: Measurement, first: int) -> Iterator[Note]:
    """What a reader of the rows from a window on has to know."""
    scene, parts = measurement.scene, "T across/T along"
    yield Note("the kurtosis of speeds is 2 (1 + a2)", "kurtosis of speeds")
    if np.all(np.isfinite(measurement.across)):
        across = "the radius" if scene.container.across == "radius" else scene.container.across
        yield Note(f"{parts}: motion along {across}, over the rest", parts)
    elif scene.container.across is None:
        title = scene.container.title
        yield Note(f"{parts} is missing: containers.py has no `across` of a {title}", parts)
    else:
        yield Note(f"{parts} is missing: it needs `record: events`", parts)
    yield from predictions.impulse_notes(scene)
    if BALANCE in expected_temperatures(scene):
        text = f"{BALANCE}: for a uniform gas that loses little on the way across"
        yield Note(text, "temperature", BALANCE)
    if isinstance(scene.wall_law, Driven) and np.all(np.isfinite(measurement.rotation_energy)):
        yield Note(_rotation(measurement, first))


def _rotation(measurement: Measurement, first: int) -> str:
    """A sentence on the share of the energy that a smooth driven circle keeps in a rotation."""
    energy = measurement.windows.from_window(first).kinetic_energy
    share, error = observables.mean_and_error(measurement.rotation_energy / energy)
    if share < observables.ROUNDING:
        return "common rotation: none, and a smooth circle adds none"
    part = f"{with_error(100 * share, 100 * error)} % of the energy"
    if share <= MOST_ROTATION:
        return f"common rotation: {part}; a smooth circle keeps it"
    why = "a smooth circle keeps it, so T depends on the start"
    return f"common rotation: {part}; {why} (`common_rotation: false` starts without it)"
