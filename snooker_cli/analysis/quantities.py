"""Every quantity that is compared with theory, or that a report or a figure has as its result."""

import math
import reprlib
from collections.abc import Callable
from functools import partial
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from snooker_cli.analysis import gas as gas_numbers
from snooker_cli.analysis.gas import Array, Gas
from snooker_cli.analysis.measurement import WINDOWS
from snooker_cli.analysis.structure import Observable
from snooker_cli.facts import FACTS
from snooker_cli.laws import SIDES
from snooker_cli.plugins import PluginError, Table, check_function
from snooker_cli.scene import Scene

GasKind: TypeAlias = Literal["elastic", "cooling", "warm", "mixture", "rough", "clusters", "uneven"]
"""Types of gas. Collisions keep the energy (elastic), collisions take energy (cooling), or walls
give energy (warm). In addition, balls may be unequal (mixture) or rough, theory may expect clusters
(L/L_c is above 1), and walls may give the gas another temperature in each place (uneven)."""

Source: TypeAlias = Literal["means", "decay", "curve", "snapshots"]
"""What a quantity is measured from: means after the relaxation (of a gas that walls keep warm, over
its steady part), the decay from the start to the end, the course of a repeat, or stored states."""


class Quantity(NamedTuple):
    """A quantity of a gas, with a value in each repeat.

    name : in rows of ``snooker compare --json``, and in notes
    symbol : in sentences: ``α``
    unit : ``1`` of a ratio
    words : in tables of a terminal, without the unit
    key : its name in JSON of figures and findings, and for Python
    source : what it is measured from: ``means``, ``curve`` or ``snapshots`` (states) after the
        relaxation, or ``decay`` from the start to the end
    main_of : the gases that it says most about: ``elastic``, ``cooling``, ``warm``, ``mixture``,
        ``rough``, ``clusters``, ``uneven``
    measured : its value in each repeat; ``None`` if it has no value in each repeat
    unmeasured : why it has no value in any repeat [it could not be measured]; empty if it needs no
        reason
    alone : the facts of gases in which it is shown without a theory; ``None`` if it never is
    of_state : its value in one state, one number or nan, if it is a mean over states
    """

    name: str
    symbol: str
    unit: str
    words: str
    key: str
    source: Source
    main_of: tuple[GasKind, ...] = ()
    measured: Callable[[Gas], Array] | None = None
    unmeasured: str = "it could not be measured"
    alone: tuple[str, ...] | None = None
    of_state: Observable | None = None

    @property
    def has_values(self) -> bool:
        """Whether it has a value in each repeat."""
        return self.measured is not None or self.of_state is not None

    def values(self, gas: Gas) -> Array:
        """Its value in each repeat; nan where it has none.

        Raises ``PluginError`` if a package returns anything else.
        """
        if self.measured is None:
            return gas.mean_of_states(self.name)
        found, repeats = self.measured(gas), len(gas.means.length)
        if has_numbers(found, (repeats,)):
            return np.asarray(found, dtype=np.float64)
        needed = f"an array with a number for each repeat, here {repeats}"
        raise wrong_return("quantity", QUANTITIES, self.name, "measured", found, needed)

    def in_state(self, positions: Array, velocities: Array, scene: Scene) -> float:
        """Its value in one state. Raises ``PluginError`` if a package returns no number."""
        assert self.of_state is not None
        found = self.of_state(positions, velocities, scene)
        if has_numbers(found, ()):
            return float(np.asarray(found))
        needed = "one number for a state, nan without a value"
        raise wrong_return("quantity", QUANTITIES, self.name, "of_state", found, needed)

    @property
    def unit_text(self) -> str:
        """The unit after a value in a sentence; empty for a ratio."""
        return "" if self.unit == "1" else self.unit


# What functions of packages return.


def has_numbers(found: object, shape: tuple[int, ...]) -> bool:
    """Whether something is an array of real numbers of a shape; one number has the shape ()."""
    if not isinstance(found, float | int | np.generic | np.ndarray):
        return False
    numbers = np.asarray(found)
    return numbers.shape == shape and numbers.dtype.kind in "biuf"


def wrong_return(
    kind: str, table: Table[Any], name: str, function: str, found: object, needed: str
) -> PluginError:
    """The error if a function of an entry of a table returned something else than is needed."""
    origin, text = table.origin(name), reprlib.repr(found)
    source = f" of {origin.distribution} {origin.version}" if origin else ""
    if isinstance(found, np.ndarray):
        of_type = "" if found.dtype.kind in "biuf" else f" and type {found.dtype}"
        text = f"an array of the shape {found.shape}{of_type}"
    return PluginError(
        f"the {kind} {name}{source}: `{function}` returned {text}", f"it must return {needed}"
    )


# Measurements that are more than a mean.


def _virial_pressure(gas: Gas) -> Array:
    virial = gas.means.pair_virial / gas.means.length
    return gas.ideal_pressure + virial / (2 * gas.container.area)


def _virial_ratio(gas: Gas) -> Array:
    """1 + ΣJd/(2 N T t)."""
    virial = gas.means.pair_virial / gas.means.length
    return 1 + gas.ratio(virial, 2 * gas.means.kinetic_energy)


def _kurtosis(gas: Gas) -> Array:
    if gas.first_window is None:
        return gas.means.energy_moment
    energy = gas.means.kinetic_energy
    square = energy.mean() * (2 * energy - energy.mean())  # to first order, E² of the mean E
    return gas_numbers.pooled_ratio(gas.means.squares, square)


def _species_ratio(gas: Gas) -> Array:
    """After the relaxation, or in the quarters of that part that are in the steady part."""
    shares = gas.measurement.species_shares
    if gas.first_window is not None:
        first = math.ceil(4 * gas.first_window / WINDOWS)
        shares = gas.measurement.species_quarters[:, first:].mean(axis=1)
    first_species, second = shares.T
    return np.asarray(first_species / second)


def _spin_ratio(gas: Gas) -> Array:
    """In the second half of the collisions, or over the steady part."""
    if gas.first_window is None:
        return gas_numbers.late_ratio(*gas_numbers.temperatures(gas.measurement))
    return gas_numbers.pooled_ratio(2 * gas.means.spin_energy, gas.means.kinetic_energy)


def _given_by(side: str, gas: Gas) -> Array:
    """The power of a side; nan without it, or without events."""
    if side not in gas.container.sides:
        return np.full_like(gas.means.length, np.nan)
    given = gas.measurement.by_side[:, gas.first_window :, gas.container.sides.index(side)]
    return np.asarray(given.sum(axis=1) / gas.means.length)


def _across(gas: Gas) -> Array:
    across = gas.measurement.across[:, gas.first_window :].mean(axis=1)
    return gas.ratio(across, 1 - across)


def _energy_left(gas: Gas) -> Array:
    return gas.measurement.calm_energy / gas.measurement.first_energy


CLUSTER_SIZE = Quantity(
    *("balls in a ball's cluster", "N_c", "1", "mean number of balls in a ball's cluster"),
    *("cluster_size", "snapshots", ("clusters",)),
)
HEAT_FLUX = Quantity(
    *("heat flux", "q", "J/(m s)", "heat flux", "heat_flux", "snapshots", ("uneven",))
)
TEMPERATURE_JUMP = Quantity(
    *("jump of the temperature at a wall", "ΔT", "J", "jump of the temperature"),
    *("temperature_jump", "snapshots"),
)
"""Results of figures, as the one before."""

TEMPERATURE = Quantity(
    *("temperature", "T", "J", "temperature", "temperature", "means", ("warm",)),
    lambda g: g.temperature,
    alone=("warm_walls",),
)
HAFF_RATE = Quantity(
    *("Haff's α", "α", "1/s", "Haff's α", "alpha", "decay", ("cooling",)),
    lambda g: g.constants["kinetic_energy", "haff"],
)
RATIO = Quantity(
    *("PV/NT", "PV/NT", "1", "PV/NT", "ideal_gas_ratio", "means", ("elastic", "cooling", "warm")),
    lambda g: g.ratio(g.pressure, g.ideal_pressure),
)
SPECIES_RATIO = Quantity(
    *("T₁/T₂", "T₁/T₂", "1", "T₁/T₂", "species_ratio", "snapshots", ("mixture",)),
    _species_ratio,
    unmeasured="no state of the balls after the relaxation is stored; run the config with "
    "`record: events` or `snapshots`",
    alone=("cooling", "two_species"),
)
SPIN_RATIO = Quantity(
    *("T_rot/T_tr", "T_rot/T_tr", "1", "T_rot/T_tr", "spin_ratio", "curve", ("rough",)),
    _spin_ratio,
    alone=("rough",),
)
"""Twice the mean energy of a spin over that of a ball's motion."""

PRESSURE = Quantity(
    *("pressure", "P", "Pa m", "pressure", "pressure", "means"), (), lambda g: g.pressure
)
VIRIAL_PRESSURE = Quantity(
    *("pressure by the virial", "P", "Pa m", "pressure by the virial", "virial_pressure"),
    *("means", (), _virial_pressure),
    alone=(
        "warm_walls",
        "several",
    ),
)
VIRIAL_RATIO = Quantity(
    *("PV/NT by the virial", "PV/NT", "1", "PV/NT by the virial", "virial_ratio"),
    *("means", (), _virial_ratio),
    alone=(
        "warm_walls",
        "several",
    ),
)
WALL_RATE = Quantity(
    *("wall rate of a ball", "ν_w", "1/s", "wall rate", "wall_rate", "means", ()),
    lambda g: g.wall_rate,
    alone=("warm_walls",),
)
PAIR_RATE = Quantity(
    *("ball-ball rate of a ball", "ω", "1/s", "ball-ball rate", "pair_rate", "means", ()),
    lambda g: g.pair_rate,
    alone=(
        "warm_walls",
        "several",
    ),
)
FREE_PATH = Quantity(
    *("mean free path", "λ", "m", "mean free path", "mean_free_path", "means", ()),
    lambda g: g.ratio(g.means.mean_speed, g.pair_rate),
    alone=(
        "warm_walls",
        "several",
    ),
)
MEAN_SPEED = Quantity(
    *("mean speed", "⟨v⟩", "m/s", "mean speed", "mean_speed", "means", ()),
    lambda g: g.means.mean_speed,
)
KURTOSIS = Quantity(
    *("kurtosis of speeds", "⟨v⁴⟩/⟨v²⟩²", "1", "kurtosis ⟨v⁴⟩/⟨v²⟩²", "speed_kurtosis"),
    *("means", (), _kurtosis),
)
CHI_SQUARE = Quantity(
    *("χ² of the speed distribution, per degree of freedom", "χ²/dof", "1"),
    *("χ²/dof of speeds", "speed_chi_square", "means"),
)
ENERGY_DECAY = Quantity(
    *("decay constant of energy", "k", "1/s", "decay constant of energy", "k", "decay", ()),
    lambda g: g.constants["kinetic_energy", "exponential"],
)
PRESSURE_DECAY = Quantity(
    *("decay constant of pressure", "k_P", "1/s", "decay constant of pressure", "pressure_k"),
    *("decay", ()),
    lambda g: g.constants["pressure", "exponential"],
)
ENERGY_LEFT = Quantity(
    *("energy left at the end", "E/E₀", "1", "energy left", "energy_left", "decay", ()),
    _energy_left,
)
CRITICAL_RATIO = Quantity("L/L_c", "L/L_c", "1", "L/L_c", "critical_ratio", "decay")
GIVEN = Quantity(
    *("energy from the walls", "dE/dt", "W", "energy from the walls", "given_power"),
    *("means", ()),
    lambda g: g.means.wall_energy / g.means.length,
)
"""The power of the walls; in a steady gas collisions take as much."""

SIDES_GIVEN = {
    side: Quantity(
        *(f"energy from the {side} wall", "dE/dt", "W", f"energy from the {side} wall"),
        *(f"{side}_given_power", "means", (), partial(_given_by, side)),
        unmeasured="",
        alone=("warm_walls", "different_walls"),
    )
    for side in SIDES
}
COLLISION_LOSS = Quantity(
    *("energy taken by a collision", "ΔE", "J", "energy taken by a collision"),
    *("collision_loss", "means", ()),
    lambda g: g.ratio(g.means.lost_energy, g.means.pair_events),
    alone=(
        "warm_walls",
        "several",
        "lossy_pairs",
    ),
)
ACROSS = Quantity(
    *("T across/T along", "T across/T along", "1", "T across/T along", "across_ratio"),
    *("snapshots", (), _across),
    unmeasured="it needs `record: events`",
)

# Results of figures that no table has.

CONTACT = Quantity(
    *("pair correlation at contact", "g(σ⁺)", "1", "pair correlation at contact"),
    *("contact_value", "snapshots"),
)
SONINE = Quantity("a₂", "a₂", "1", "a₂", "sonine_coefficient", "curve")
STRUCTURE = Quantity(
    *("structure factor", "S", "1", "structure factor of the longest waves"),
    *("structure_factor", "snapshots"),
)
NEIGHBOURS = Quantity(
    *("velocity correlation of neighbours", "C", "1"),
    *("longitudinal velocity correlation of the nearest balls", "neighbour_correlation"),
    "snapshots",
)
DIFFUSION = Quantity(
    *("diffusion coefficient", "D", "m²/s", "diffusion coefficient"),
    *("diffusion_coefficient", "curve"),
)
OF_FIGURES = (
    Quantity(
        *("share of fast velocities", "w", "1", "share of fast velocities over that of the law"),
        *("fast_share", "snapshots"),
    ),
    Quantity("energy over that at the start", "E/E₀", "1", "energy", "energy_ratio", "curve"),
    Quantity("largest overlap", "δ", "m", "largest overlap", "largest_overlap", "curve"),
    Quantity(
        *("change of the momentum", "|Δp|/p", "1", "largest change of the momentum"),
        *("momentum_change", "curve"),
    ),
    Quantity(
        *("change of the energy", "|ΔE|/E", "1", "largest change of the energy"),
        *("energy_change", "curve"),
    ),
    Quantity("NT/PV", "NT/PV", "1", "NT/PV", "inverse_ideal_gas_ratio", "means"),
    Quantity(
        *("van der Waals' b", "b", "areas of a disk", "van der Waals' constant"),
        *("excluded_disks", "means"),
    ),
    Quantity(
        *("distance from the law of speeds", "D", "1", "largest difference of cumulative shares"),
        *("distance_from_law", "means"),
    ),
    Quantity(
        "length of the way", "d", "m", "distance from the start to the end", "distance", "curve"
    ),
    Quantity("hexatic order", "|⟨ψ₆⟩|", "1", "hexatic order", "hexatic_order", "snapshots"),
)
"""Further results of figures, which no theory and no table has."""

OWN = {
    quantity.name: quantity
    for quantity in (
        *(CLUSTER_SIZE, HEAT_FLUX, TEMPERATURE_JUMP, SPECIES_RATIO, SPIN_RATIO, TEMPERATURE),
        *(HAFF_RATE, RATIO),
        *(PRESSURE, VIRIAL_PRESSURE),
        *(VIRIAL_RATIO, WALL_RATE, PAIR_RATE, FREE_PATH, MEAN_SPEED, KURTOSIS, CHI_SQUARE),
        *(ENERGY_DECAY, PRESSURE_DECAY, ENERGY_LEFT, CRITICAL_RATIO, GIVEN, *SIDES_GIVEN.values()),
        *(COLLISION_LOSS, ACROSS, CONTACT, SONINE, STRUCTURE, NEIGHBOURS, DIFFUSION, *OF_FIGURES),
    )
}
"""The quantities of snooker by their names; main ones first, in the order of the sentences."""


def _taken(thing: object) -> tuple[str, Quantity]:
    """What a distribution adds to ``QUANTITIES``. Raises ``PluginError``."""
    if not isinstance(thing, Quantity):
        raise PluginError("it is no Quantity", "name an object of this class")
    check_function(thing.measured, "measured", "gas")
    check_function(thing.of_state, "of_state", "positions", "velocities", "scene")
    if thing.source not in get_args(Source):
        raise PluginError(
            f"its source is {thing.source!r}", f"give one of {', '.join(get_args(Source))}"
        )
    if (thing.main_of or thing.alone is not None) and not thing.has_values:
        raise PluginError("it has no value in a repeat", "give it `measured` or `of_state`")
    for name in thing.alone or ():
        if name not in FACTS:
            raise PluginError(f"there is no fact {name} that `alone` may name")
    same = [own.name for own in OWN.values() if own.key == thing.key]
    if same and thing.name not in OWN:
        raise PluginError(f"its key {thing.key} is that of {same[0]}", "give it another key")
    return thing.name, thing


QUANTITIES = Table("snooker.quantities", OWN, _taken)
"""Every quantity by its name."""


def main_quantities(*kinds: GasKind) -> list[Quantity]:
    """The quantities that say most about a gas, in the order of the sentences.

    kinds : of the gas; without any, the quantities of all kinds
    """
    main = (quantity for quantity in QUANTITIES.values() if quantity.main_of)
    return [quantity for quantity in main if not kinds or {*quantity.main_of} & {*kinds}]
