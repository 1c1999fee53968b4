"""Rows of ``snooker bench physics`` of balls that spin."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from snooker_cli import two_temperatures
from snooker_cli.analysis.gas import pooled_ratio
from snooker_cli.analysis.observables import mean_and_error, total_angular_momentum, total_energy
from snooker_cli.engine import series, simulate
from snooker_cli.neighbours import Floats
from snooker_cli.scene import EPSILON
from snooker_cli.trace import Trace
from snooker_cli.validation.gas_samples import DIRECT, GasSample, known_value
from snooker_cli.validation.study import PLANS, Record

ROUGH = "balls that spin"

DISK = 0.5
"""The inertia q of these balls."""

CONTACT_ROUNDING = 64 * EPSILON
"""Relative error of what few contacts change."""


def equal_parts_rows(gas: GasSample) -> Iterator[Record]:
    """Elastic rough balls share the energy evenly, and keep it."""
    found = gas.samples(rotation, summary=True)
    ratio = mean_and_error(pooled_ratio(found["turning"], found["moving"]))
    yield known_value(ROUGH, "T_rot/T_tr", gas, ratio, 1.0, "equal parts, microcanonical")
    yield from kept_rows(gas, "energy", found["energy"])


def rotating_rows(gas: GasSample) -> Iterator[Record]:
    """Rough balls keep the energy and, in a smooth circle, the angular momentum with spins."""
    found = gas.samples(rotation, summary=True)
    yield from kept_rows(gas, "energy", found["energy"])
    yield from kept_rows(gas, "angular momentum", found["rotation"])


def kept_rows(gas: GasSample, name: str, changes: Floats) -> Iterator[Record]:
    """The largest relative change of all seeds beside zero.

    As error it has the sum of as many independent roundings as there are collisions.
    """
    rounding = EPSILON * math.sqrt(gas.settling_events + gas.measured_events)
    yield exact_row(gas, f"largest relative change of {name}", changes, "conserved", rounding)


def exact_row(
    gas: GasSample, quantity: str, deviations: Floats, source: str, rounding: float
) -> Record:
    """The row of the largest of deviations, which are zero but for rounding."""
    largest = float(np.max(np.abs(deviations))), 0.0
    return known_value(ROUGH, quantity, gas, largest, 0.0, source, expected_error=rounding)


def rotation(gas: GasSample, trace: Trace) -> dict[str, Any]:
    """Temperatures of motion and rotation, J, and relative changes of what may be conserved."""
    columns = series(trace)
    settled, spins = columns.pair_events >= gas.settling_events, columns.spin_energy
    assert spins is not None
    start, finish = trace.start, trace.finish
    reach = float(np.max(np.hypot(*start.positions.T)))
    speed = math.sqrt(2 * start.kinetic_energy * gas.balls)  # N times the root mean square
    change = total_angular_momentum(finish) - total_angular_momentum(start)
    return {
        "moving": float(np.mean(columns.kinetic_energy[settled])) / gas.free,
        "turning": 2 * float(np.mean(spins[settled])) / gas.balls,
        "energy": total_energy(finish) / total_energy(start) - 1,
        "rotation": change / (reach * speed),
    }


DIRECT_ROUGH: Mapping[float, Record] = PLANS["direct_rough"]
"""T_rot/T_tr of cooling rough disks at CoR 0.9, and T_tr and T_rot after `cooled_after` collisions
over T_tr at the start, with standard errors, by tangential CoR."""

LEFT_AT_END = 0.01  # of the temperature of motion: the integrated equations cover two decades


def rough_cooling_rows(gas: GasSample) -> Iterator[Record]:
    """T_rot/T_tr of a cooling gas, and both temperatures beside the integrated equations.

    Mean-field theory has independent velocities and spins with Maxwell's law. What is open in its
    values is how far direct simulation, which has no correlations in space, is from them.
    """
    beta, source = gas.keys["tangential_cor"], "mean field, Luding et al. 1998"
    direct, values = DIRECT_ROUGH[beta], (gas.cor, beta, DISK)
    collisions = cooled_after(gas.cor, beta)
    found = gas.samples(partial(cooled_temperatures, at=collisions), summary=True)
    ratio = mean_and_error(pooled_ratio(found["late turning"], found["late moving"]))
    expected, error = direct["ratio"]
    limit = two_temperatures.rough_ratio(*values)
    names = ROUGH, "T_rot/T_tr", gas, ratio
    yield known_value(*names, expected, DIRECT, expected_error=error)
    yield known_value(*names, limit, source, systematic=abs(expected - limit))
    start, after = np.array([1.0, 0.0]), np.array([collisions])
    theory = two_temperatures.rough_temperatures(after, start, *values)[:, 0].tolist()
    for name, value in zip(("T_tr", "T_rot"), theory, strict=True):
        quantity = f"{name} over theory after {collisions:.1f} collisions of a ball"
        measured, (simulated, _) = mean_and_error(found[name] / value), direct[name]
        open_part = abs(simulated / value - 1)
        yield known_value(ROUGH, quantity, gas, measured, 1.0, source, systematic=open_part)


def cooled_after(cor: float, tangential_cor: float) -> float:
    """Collisions of a disk after which theory has ``LEFT_AT_END`` of T_tr; none spins before."""
    many, start = np.linspace(0, 400, 40001), np.array([1.0, 0.0])
    moving, _ = two_temperatures.rough_temperatures(many, start, cor, tangential_cor, DISK)
    return float(np.interp(-LEFT_AT_END, -moving, many))


def cooled_temperatures(gas: GasSample, trace: Trace, at: float) -> dict[str, float]:
    """T_tr and T_rot over T_tr at the start after collisions of a ball, and after settling."""
    columns = series(trace)
    assert columns.spin_energy is not None
    collisions = 2 * columns.pair_events / gas.balls
    last = float(collisions[-1])
    places = np.append(at, np.linspace(gas.settling, last, 100))
    moving, turning = (
        np.interp(places, collisions, energies / parts)
        for energies, parts in (
            (columns.kinetic_energy, gas.free),
            (2 * columns.spin_energy, gas.balls),
        )
    )
    both, first = moving + turning, float(columns.kinetic_energy[0]) / gas.free
    return {
        "T_tr": float(moving[0] / first),
        "T_rot": float(turning[0] / first),
        "late moving": float(np.mean((moving / both)[1:])),
        "late turning": float(np.mean((turning / both)[1:])),
    }


def contact_rows(gas: GasSample) -> Iterator[Record]:
    """The tangential CoR of one collision of two balls, of each seed at another angle."""
    found = gas.samples(contact)
    law = gas.cor, gas.keys["tangential_cor"], gas.keys["friction"], DISK
    expected = two_temperatures.sliding_tangential_cor(found["slope"], *law)
    source = "−1 + μ(1 + e)(1 + 1/q) cot γ up to β₀, Foerster et al. 1994"
    # Slips may be small differences of velocities.
    rounding = CONTACT_ROUNDING * float(np.max(found["slope"]) + 1)
    quantity = "largest deviation of β from its law"
    yield exact_row(gas, quantity, found["beta"] - expected, source, rounding)


def contact(_gas: GasSample, trace: Trace) -> dict[str, float]:
    """cot γ and the tangential CoR of the first collision of two balls."""
    before, after = trace.start, trace.finish
    assert after.spins is not None
    normal = after.container.nearest_image(after.positions[1] - after.positions[0])
    normal /= np.hypot(*normal)
    across = np.array([-normal[1], normal[0]])
    (first, second), ends = before.velocities, after.velocities
    slip = float((first - second) @ across)  # the balls do not spin before
    left = float((ends[0] - ends[1]) @ across + after.radii @ after.spins)
    return {"slope": float((first - second) @ normal) / abs(slip), "beta": -left / slip}


def bouncing_rows(gas: GasSample) -> Iterator[Record]:
    """Velocity along two rough walls and spin of one ball, beside products of a matrix."""
    errors = np.array([bouncing(gas, seed) for seed in range(gas.seeds)])
    for name, values in zip(("velocity along walls", "spin"), errors.T, strict=True):
        quantity = f"largest error of {name}, relative"
        yield exact_row(gas, quantity, values, "product of one bounce, exact", CONTACT_ROUNDING)


def bouncing(gas: GasSample, seed: int) -> Floats:
    """Errors over the speed: of the velocity along the walls, and of spin times radius; (2,)."""
    across, along, spin = gas.speed * np.random.default_rng(seed).uniform(0.5, 1.0, 3)
    velocities, hits = np.array([[across, along]]), 2 * gas.measured_events
    start = replace(gas.start(), velocities=velocities, spins=np.array([spin]))
    finish = simulate(start, collisions=hits).finish
    share = (1 + gas.keys["tangential_cor"]) / 3  # of the slip, for a disk
    state, side = np.array([along, spin]), 1.0
    for _ in range(hits):
        slip = side * state[0] + state[1]
        state -= np.array([side, 2.0]) * share * slip
        side = -side
    assert finish.spins is not None
    ends = np.array([finish.velocities[0, 1], finish.spins[0]])
    return np.asarray((ends - state) / gas.speed)


def heated_rows(gas: GasSample) -> Iterator[Record]:
    """T_rot/T_tr of rough balls between smooth walls of one temperature."""
    found = gas.samples(rotation, summary=True)
    ratio = mean_and_error(pooled_ratio(found["turning"], found["moving"]))
    expected = two_temperatures.heated_ratio(gas.keys["tangential_cor"], DISK)
    source = "balance of rotation, mean field"
    names = ROUGH, "T_rot/T_tr", gas, ratio, expected, source
    yield known_value(*names, systematic=(1 - gas.cor**2) * expected)


ROWS: Mapping[str, Callable[[GasSample], Iterator[Record]]] = {
    "rough_equal_parts": equal_parts_rows,
    "rough_rotating": rotating_rows,
    "rough_cooling": rough_cooling_rows,
    "rough_contact": contact_rows,
    "rough_bouncing": bouncing_rows,
    "rough_heated": heated_rows,
}
"""As in ``physics_study``."""
