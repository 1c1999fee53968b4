"""``snooker bench physics``: gases beside known values of their pressure, rates and speeds.

Gases are simulated in threads. A mean over seeds, with its error, is beside each known value.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from snooker_cli import theory
from snooker_cli.analysis import quantities, theories
from snooker_cli.analysis.gas import pooled_ratio
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.containers import SHAPES
from snooker_cli.engine import series
from snooker_cli.laws import Viscoelastic
from snooker_cli.neighbours import Floats
from snooker_cli.trace import Trace
from snooker_cli.validation import spinning_gases
from snooker_cli.validation.gas_samples import (
    ALLOWED,
    DIRECT,
    GasSample,
    averages,
    known_value,
    settled_states,
)
from snooker_cli.validation.study import PLANS, Record, Step, Study

STATE, RATE = "equation of state", "collision rate"

VIRIALS = "Padé of ten virial coefficients, Clisby & McCoy 2006"
ENSKOG = "Enskog, contact value of that Padé"

PUBLISHED_PRECISION = 1e-4
"""Relative error of published simulated Z, and of the Padé above ``SERIES_EXACT``, where its last
coefficients matter."""

SERIES_EXACT = 0.4


def fluid_rows(gas: GasSample) -> Iterator[Record]:
    """Z beside published simulations, if there are any, and the Padé; the collision rate."""
    packing = gas.packing
    found = gas.samples(averages, summary=True)
    ratio, rate = (mean_and_error(found[name]) for name in ("Z", "rate"))
    precision = PUBLISHED_PRECISION if packing > SERIES_EXACT else 0.0
    sources = [(theory.compressibility(packing), precision, VIRIALS)]
    simulated = theory.published_ratio(packing)
    if simulated is not None:
        sources.insert(0, (simulated.ratio, PUBLISHED_PRECISION, simulated.source))
    for value, relative, source in sources:
        yield known_value(
            *(STATE, "Z = PV/NT", gas, ratio, value, source),
            expected_error=relative * value,
            known=-theory.missing_ratio(packing, gas.balls),
        )
    expected = gas.collision_rate
    yield known_value(
        *(RATE, "collisions of a ball, 1/s", gas, rate, expected, ENSKOG),
        expected_error=precision * expected,
        known=expected * (gas.met_share * theory.fixed_energy_factor(gas.free) - 1),
    )


HAFF, SHAPE = "Haff's law", "speeds of a cooling gas"

SONINE_RATE = 0.001
"""What a2 alone may leave out of the cooling rate, relative, by ``theory.sonine_coefficient``."""

SONINE_ERROR = 0.005  # error of a2 itself, from the same source, at a CoR of 0.5 and above

SONINE = "van Noije & Ernst 1998, linearised as by Montanero & Santos 2000"

DIRECT_A2: Mapping[float, list[float]] = PLANS["direct_a2"]
"""a2 and its standard error by CoR."""


def haff_rows(gas: GasSample, dilute: bool = False) -> Iterator[Record]:
    """Haff's rate beside theory; in a dilute gas also whether it is constant, and a2."""
    found = gas.samples(averages, summary=True)
    slope, a2 = (mean_and_error(found[name]) for name in ("slope", "a2"))
    alpha = theory.haff_rate(theory.cooling_rate(gas.cor, gas.collision_rate))
    systematic = SONINE_RATE + gas.packing
    haff = "Haff 1983, Enskog, a2 after van Noije & Ernst 1998"
    yield known_value(
        *(HAFF, "Haff's rate, 1/s", gas, slope, alpha, haff),
        # N balls collide less often, and at fixed energy.
        known=alpha * (gas.met_share * finite_loss(gas) - 1),
        systematic=systematic * alpha,
    )
    if not dilute:
        return
    even = mean_and_error(found["later slope"] / found["earlier slope"])
    quantity = "slope of √(E0/E), later over earlier half"
    yield known_value(HAFF, quantity, gas, even, 1.0, "Haff 1983", systematic=systematic)
    if gas.cor in DIRECT_A2:
        expected, error = DIRECT_A2[gas.cor]
        yield known_value(SHAPE, "a2", gas, a2, expected, DIRECT, expected_error=error)
    expected = theory.sonine_coefficient(gas.cor)
    yield known_value(SHAPE, "a2", gas, a2, expected, SONINE, systematic=SONINE_ERROR)


def finite_loss(gas: GasSample) -> float:
    """Loss per second of N balls at fixed energy over that of Maxwell's speeds, as many balls meet.

    The mean relative speed has the factor c_N, and N collisions of (N E) `share_in_collision`.
    """
    share = gas.balls * theory.share_in_collision(2 * gas.free)
    return theory.fixed_energy_factor(gas.free) * share


# Speeds of few balls at fixed energy, which have the Beta law exactly

SPEEDS = "speeds at fixed energy"

BETA = "Beta law, exact"


def speed_rows(gas: GasSample) -> Iterator[Record]:
    """Mean speed and kurtosis of the speeds of a gas, and its pressure on walls."""
    found = gas.samples(averages, summary=True)
    expected, speed = theory.fixed_energy_mean_speed(gas.free, gas.energy), found["speed"]
    yield known_value(SPEEDS, "mean speed, m/s", gas, mean_and_error(speed), expected, BETA)
    expected, kurtosis = theory.fixed_energy_kurtosis(gas.free), found["kurtosis"]
    yield known_value(SPEEDS, "⟨v⁴⟩/⟨v²⟩²", gas, mean_and_error(kurtosis), expected, BETA)
    if SHAPES[gas.shape].has_wall:
        yield wall_pressure(ELASTIC, gas, found["pressure"], gas.energy)


ELASTIC = "pressure between elastic walls"

SCALED_PARTICLES = 0.01
"""Relative error of the pressure on walls by scaled particle theory, see ``theory.fluid_state``.

It was chosen from these results: between elastic walls, where nothing else is open, 37 balls in a
box at packing 0.2 have 0.43 % more than theory, and 7 balls 0.6 %.
"""


def wall_pressure(group: str, gas: GasSample, values: Floats, temperature: float) -> Record:
    """The row of the pressure on walls at a temperature (J), beside scaled particle theory."""
    container, measured = gas.start().container, mean_and_error(values)
    expected = theory.fluid_state(gas.balls, temperature, 1.0, container).pressure
    source = f"{theory.FINITE}; Helfand et al. 1961"
    names = group, "pressure, Pa m", gas, measured, expected, source
    return known_value(*names, systematic=SCALED_PARTICLES * expected)


# Gases whose walls give energy, and balls whose restitution depends on speed

WARM = "elastic balls and a thermal wall"


def thermal_rows(gas: GasSample) -> Iterator[Record]:
    """Temperature and kurtosis of balls between walls of one temperature, and their pressure."""
    walls = gas.keys["wall_temperature"]
    found = gas.samples(averages, summary=True)
    temperature, kurtosis = mean_and_error(found["energy"]), found["fourth"] / walls**2
    yield known_value(WARM, "temperature, J", gas, temperature, walls, "the wall's, canonical")
    source = "Maxwell's, canonical"
    yield known_value(WARM, "⟨v⁴⟩/⟨v²⟩²", gas, mean_and_error(kurtosis), 2.0, source)
    yield wall_pressure(WARM, gas, found["pressure"], walls)


DRIVEN = "a gas that its wall drives"


def driven_rows(gas: GasSample) -> Iterator[Record]:
    """The temperature of a dilute, nearly elastic gas whose wall is driven."""
    start = gas.start()
    expected = theories.value_of(start, quantities.TEMPERATURE, theories.BALANCE)
    assert expected is not None
    measured = mean_and_error(gas.samples(averages, summary=True)["energy"])
    yield known_value(
        *(DRIVEN, "temperature, J", gas, measured, expected),
        "balance of energy, Kumaran 1998",
        systematic=(1 - gas.cor**2) * expected,
    )


STEADY = "a channel that its walls drive"

SLABS = 12  # of equal width, across a channel

LOCAL_STATE = 0.01
"""Relative error of a pressure by the local density and temperature: collisions reach a diameter
far, and speeds are not Maxwell's. An estimate."""


def channel_rows(gas: GasSample) -> Iterator[Record]:
    """The pressure in slabs of a channel over that on its walls (Barrat & Trizac 2002).

    The stress across it is n [T_x + (1 + e) η χ T]. With T instead of its part T_x across, this is
    the equation of state; it holds as far as T is isotropic.
    """
    across, state, excess = gas.samples(slab_pressures).values()
    middle = np.arange(SLABS) // (SLABS // 3) == 1
    anisotropy = float(excess[:, middle].mean())
    for name, values, slabs, open_part in (
        ("pressure across, middle third over wall", across, middle, LOCAL_STATE),
        ("pressure across, outer thirds over wall", across, ~middle, LOCAL_STATE),
        ("nT[1 + (1 + e)ηχ], middle third over wall", state, middle, LOCAL_STATE + anisotropy),
    ):
        measured = mean_and_error(values[:, slabs].mean(axis=1))
        source = "Barrat & Trizac 2002"
        yield known_value(STEADY, name, gas, measured, 1.0, source, systematic=open_part)


def slab_pressures(gas: GasSample, trace: Trace) -> dict[str, Floats]:
    """Pressure across and by the equation of state, over that on the walls, and (T_x − T)/T.

    Each is an array of the slabs.
    """
    settled, states = settled_states(gas, trace, trace.start.container.size[0] / 10)
    (width, height), e = trace.start.container.size, gas.cor
    edges = np.linspace(1 - width / 2, width / 2 - 1, SLABS + 1)
    x, (u, v) = states.positions[:, :, 0].ravel(), states.velocities.reshape(-1, 2).T
    balls = np.histogram(x, edges)[0]
    along_x, along_y = (np.histogram(x, edges, weights=part**2)[0] / balls for part in (u, v))
    temperature = (along_x + along_y) / 2
    density = balls / (len(states.time) * height * np.diff(edges))
    collisional = (1 + e) * math.pi * density * theory.contact_value(math.pi * density)
    events = trace.events
    assert events is not None
    push = float(np.sum(events.impulse[events.at_wall & (events.time > settled)]))
    pressure = push / (trace.start.container.wall_length * (trace.stop.time - settled))
    relative = density / pressure
    return {
        "across": relative * (along_x + collisional * temperature),
        "state": relative * temperature * (1 + collisional),
        "anisotropy": along_x / temperature - 1,
    }


SOFTER = "cooling with e(v)"


def viscoelastic_rows(gas: GasSample) -> Iterator[Record]:
    """The time to cool beside the integral over the temperature of the cooling rate."""
    found = gas.samples(averages, summary=True)
    ends = zip(found["hot"], found["cold"], strict=True)
    ratio = mean_and_error(
        found["time"] / [cooling_time(gas, *temperatures) for temperatures in ends]
    )
    # What follows from the measured speeds: how much the measured a2 changes the integral.
    hot, cold, a2 = (float(found[name].mean()) for name in ("hot", "cold", "a2"))
    slower = cooling_time(gas, hot, cold, a2) / cooling_time(gas, hot, cold)
    yield known_value(
        *(SOFTER, "time to cool, over Maxwell's", gas, ratio, 1.0, "e(v) of Bizon et al. 1998"),
        known=slower / (gas.met_share * finite_loss(gas)) - 1,
        systematic=SONINE_RATE + gas.packing,
    )


def cooling_time(gas: GasSample, hot: float, cold: float, a2: float = 0.0) -> float:
    """∫ dT/(ζ T) between two temperatures, s, with the cooling rate ζ of Enskog's collisions."""
    law = Viscoelastic(gas.cor, gas.keys["cor_speed"])
    temperatures = np.geomspace(hot, cold, 201)
    losses = theory.mean_loss(law, temperatures, a2=a2)
    rates = gas.collision_rate * np.sqrt(temperatures / gas.temperature) * losses / 2
    return -float(np.trapezoid(1 / rates, np.log(temperatures)))


HEAT = "heat conduction of elastic balls"

MAXWELLS_JUMP = 0.25
"""Relative error of Maxwell's jump of temperature, see ``theory.temperature_jump``."""

MIDDLE = 0.5  # of the way from the middle to the walls: there the gradient of T is measured


def conduction_rows(gas: GasSample) -> Iterator[Record]:
    """Flux of heat, conductivity and jump of temperature between walls of two temperatures."""
    fluxes, slopes, temperature, packing = gas.samples(conduction).values()
    state = float(packing.mean()), 1.0, float(temperature.mean())
    expected, jump = theory.thermal_conductivity(*state), theory.temperature_jump(*state)
    walls = gas.keys["wall_temperature"]
    difference = walls["right"] - walls["left"]
    width = gas.start().container.size[0] - 2
    open_part, whole = MAXWELLS_JUMP * jump, width + 2 * jump
    yield known_value(
        *(HEAT, "flux of heat, J/(m s)", gas, mean_and_error(fluxes)),
        *(expected * difference / whole, "Enskog and Maxwell's jump"),
        systematic=expected * difference / whole * 2 * open_part / whole,
    )
    conductivity = mean_and_error(pooled_ratio(fluxes, slopes))
    yield known_value(
        *(HEAT, "conductivity, 1/s", gas, conductivity, expected, "Enskog, Gass 1971"),
        systematic=float(packing.mean()) * expected,
    )
    across, error = mean_and_error(pooled_ratio(np.full(gas.seeds, difference), slopes))
    jumps = (across - width) / 2, error / 2
    name = "jump over gradient, m"
    yield known_value(HEAT, name, gas, jumps, jump, "Maxwell 1879", systematic=open_part)


def conduction(gas: GasSample, trace: Trace) -> dict[str, float]:
    """Flux of heat to the left, gradient of T, T and packing; the last three in the middle."""
    assert trace.events is not None
    events, size = trace.events, trace.start.container.size
    reach = size[0] / 2 - 1
    # Between two states no ball crosses half of the channel, so its side is that of its next hit.
    settled, states = settled_states(gas, trace, reach / 6)
    duration = trace.stop.time - settled
    x = states.positions[:, :, 0]
    hits = np.flatnonzero(events.at_wall & (events.time > settled))
    right = x[np.searchsorted(states.time, events.time[hits]) - 1, events.i[hits]] > 0
    given = np.diff(series(trace).kinetic_energy)[hits]
    flux = (given[right].sum() - given[~right].sum()) / (2 * size[1] * duration)
    middle = abs(x) < MIDDLE * reach
    energies = np.sum(states.velocities**2, axis=2)[middle] / 2
    slope = np.polyfit(x[middle], energies, 1)[0]
    packing = gas.balls * middle.mean() * math.pi / (2 * MIDDLE * reach * size[1])
    return {
        "flux": float(flux),
        "gradient": float(slope),
        "temperature": float(energies.mean()),
        "packing": float(packing),
    }


ROWS: Mapping[str, Callable[[GasSample], Iterator[Record]]] = {
    "fluids": fluid_rows,
    "cooling": partial(haff_rows, dilute=True),
    "cooling_denser": haff_rows,
    "speeds": speed_rows,
    "thermal": thermal_rows,
    "driven": driven_rows,
    "driven_channel": channel_rows,
    "viscoelastic": viscoelastic_rows,
    "conduction": conduction_rows,
    **spinning_gases.ROWS,
}
"""The rows of a gas, by what the gas is measured for."""


def steps(plan: Record) -> Iterator[Step]:
    """The gases to measure, by what they are measured for; see plans.yaml."""
    for purpose, gases in plan["gases"].items():
        for known in gases:
            gas, words = GasSample(**known), purpose.replace("_", ", ")
            label = f"{words}: {gas.balls} balls, packing {gas.packing:.4g}, CoR {gas.cor:g}"
            yield Step(label, "rows", partial(ROWS[purpose], gas))


def conclude(record: Record) -> Record:
    """The rows, first those whose expected value leaves nothing open, and notes on them."""
    rows = record["rows"]
    groups = list(dict.fromkeys(row["group"] for row in rows))
    rows = sorted(rows, key=lambda row: (row["systematic"] > 0, groups.index(row["group"])))
    chance = {"allowed_errors": ALLOWED, "by_chance": by_chance(rows)}
    return chance | {"notes": PLANS["legends"]["physics"], "rows": rows}


def none_disagrees(record: Record) -> bool:
    """Whether all values agree, at least with what is open."""
    return all(row["agreement"] != "no" for row in record["rows"])


PHYSICS = Study("physics", ("numpy", "numba"), steps, conclude, passed=none_disagrees)


def by_chance(rows: list[Record]) -> float:
    """How many rows without an open part would deviate by more than ``ALLOWED`` by chance alone.

    By Student's t of the seeds: rows of few seeds have uncertain errors.
    """
    from scipy.stats import t  # takes time to load

    seeds = [row["setting"]["seeds"] for row in rows if not row["systematic"]]
    return float(sum(2 * t.sf(ALLOWED, number - 1) for number in seeds))


def walls(setting: Record) -> str:
    """The shape of a gas with its walls, and a CoR that depends on the speed."""
    parts = [str(setting["shape"])]
    for key, value in setting["keys"].items():
        sides = value.values() if isinstance(value, Mapping) else (value,)
        amount = " and ".join(f"{side:g}" for side in sides)
        texts = {"wall_temperature": f"{amount} J", "wall_speed": f"driven, {amount} m/s"}
        texts |= {"cor_speed": f"e(v) up to {amount} m/s"}
        texts |= {"tangential_cor": f"β = {amount}", "friction": f"μ = {amount}"}
        parts += [texts[key]] if key in texts else []
    return ", ".join(parts)
