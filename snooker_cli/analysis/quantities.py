"""Every quantity that is compared with theory, or that a report or a figure has as its result."""

from collections.abc import Mapping
from typing import Literal, NamedTuple, TypeAlias

GasKind: TypeAlias = Literal["elastic", "cooling", "warm", "mixture", "rough"]
"""A gas whose collisions keep the energy, or take some, or whose walls give some; of unequal balls
and of rough ones in addition."""

Source: TypeAlias = Literal["means", "fits", "curve", "snapshots"]
"""What a quantity is measured from: means after the relaxation (of a gas that walls keep warm, over
its steady part), fits of the decay, the course of a repeat, or stored states of the balls."""


class Quantity(NamedTuple):
    """A quantity of a gas, with a value in each repeat.

    name : in rows of ``snooker compare --json``, and in notes
    symbol : in sentences: ``α``
    unit : ``1`` of a ratio
    words : in tables of a terminal, without the unit
    key : its name in JSON of figures and findings, and for Python
    source : what it is measured from
    main_of : the gases that it tells most about
    """

    name: str
    symbol: str
    unit: str
    words: str
    key: str
    source: Source
    main_of: tuple[GasKind, ...] = ()

    @property
    def unit_text(self) -> str:
        """The unit after a value in a sentence; empty for a ratio."""
        return "" if self.unit == "1" else self.unit


TEMPERATURE = Quantity("temperature", "T", "J", "temperature", "temperature", "means", ("warm",))
HAFF_RATE = Quantity("Haff's α", "α", "1/s", "Haff's α", "alpha", "fits", ("cooling",))
RATIO = Quantity(
    "PV/NT", "PV/NT", "1", "PV/NT", "ideal_gas_ratio", "means", ("elastic", "cooling", "warm")
)
SPECIES_RATIO = Quantity("T₁/T₂", "T₁/T₂", "1", "T₁/T₂", "species_ratio", "snapshots", ("mixture",))
SPIN_RATIO = Quantity(
    "T_rot/T_tr", "T_rot/T_tr", "1", "T_rot/T_tr", "spin_ratio", "curve", ("rough",)
)
"""Twice the mean energy of a spin over that of a ball's motion."""

PRESSURE = Quantity("pressure", "P", "Pa m", "pressure", "pressure", "means")
VIRIAL_PRESSURE = Quantity(
    "pressure by the virial", "P", "Pa m", "pressure by the virial", "virial_pressure", "means"
)
VIRIAL_RATIO = Quantity(
    "PV/NT by the virial", "PV/NT", "1", "PV/NT by the virial", "virial_ratio", "means"
)
WALL_RATE = Quantity("wall rate of a ball", "ν_w", "1/s", "wall rate", "wall_rate", "means")
PAIR_RATE = Quantity("ball-ball rate of a ball", "ω", "1/s", "ball-ball rate", "pair_rate", "means")
FREE_PATH = Quantity("mean free path", "λ", "m", "mean free path", "mean_free_path", "means")
MEAN_SPEED = Quantity("mean speed", "⟨v⟩", "m/s", "mean speed", "mean_speed", "means")
KURTOSIS = Quantity(
    "kurtosis of speeds", "⟨v⁴⟩/⟨v²⟩²", "1", "kurtosis ⟨v⁴⟩/⟨v²⟩²", "speed_kurtosis", "means"
)
CHI_SQUARE = Quantity(
    *("χ² of the speed distribution, per degree of freedom", "χ²/dof", "1"),
    *("χ²/dof of speeds", "speed_chi_square", "means"),
)
ENERGY_DECAY = Quantity(
    "decay constant of energy", "k", "1/s", "decay constant of energy", "k", "fits"
)
PRESSURE_DECAY = Quantity(
    "decay constant of pressure", "k_P", "1/s", "decay constant of pressure", "pressure_k", "fits"
)
ENERGY_LEFT = Quantity("energy left at the end", "E/E₀", "1", "energy left", "energy_left", "curve")
CRITICAL_RATIO = Quantity("L/L_c", "L/L_c", "1", "L/L_c", "critical_ratio", "curve")
GIVEN = Quantity(
    "energy from the walls", "dE/dt", "J/s", "energy from the walls", "given_power", "means"
)
"""The power of the walls; in a steady gas collisions take as much."""

SIDES_GIVEN = {
    side: Quantity(
        f"energy from the {side} wall",
        "dE/dt",
        "J/s",
        f"energy from the {side} wall",
        f"{side}_given_power",
        "means",
    )
    for side in ("left", "right", "bottom", "top")
}
COLLISION_LOSS = Quantity(
    *("energy taken by a collision", "ΔE", "J", "energy taken by a collision"),
    *("collision_loss", "means"),
)
ACROSS = Quantity(
    "T across/T along", "T across/T along", "1", "T across/T along", "across_ratio", "snapshots"
)

OF_FIGURES = (
    Quantity("largest overlap", "δ", "m", "largest overlap", "largest_overlap", "curve"),
    Quantity(
        *("change of the momentum", "|Δp|/p", "1", "largest change of the momentum"),
        *("momentum_change", "curve"),
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
    Quantity(
        *("diffusion coefficient", "D", "m²/s", "diffusion coefficient"),
        *("diffusion_coefficient", "curve"),
    ),
    Quantity(
        *("pair correlation at contact", "g(σ⁺)", "1", "pair correlation at contact"),
        *("contact_value", "snapshots"),
    ),
    Quantity("hexatic order", "|ψ₆|", "1", "hexatic order", "hexatic_order", "snapshots"),
    Quantity("a₂", "a₂", "1", "a₂", "sonine_coefficient", "curve"),
    Quantity(
        *("energy without the flow", "E_th/E", "1", "share of the energy without the flow"),
        *("thermal_share", "snapshots"),
    ),
    Quantity("heat flux", "q", "J/(m s)", "heat flux", "heat_flux", "means"),
    Quantity(
        *("structure factor", "S", "1", "structure factor of the longest waves"),
        *("structure_factor", "snapshots"),
    ),
    Quantity(
        *("balls in a ball's cluster", "N_c", "1", "mean number of balls in a ball's cluster"),
        *("cluster_size", "snapshots"),
    ),
    Quantity(
        *("variance over mean in cells", "Var(n)/⟨n⟩", "1", "variance over mean in a cell"),
        *("density_fluctuation", "snapshots"),
    ),
)
"""The results of figures that no table has."""

QUANTITIES: Mapping[str, Quantity] = {
    one.name: one
    for one in (
        *(SPECIES_RATIO, SPIN_RATIO, TEMPERATURE, HAFF_RATE, RATIO, PRESSURE, VIRIAL_PRESSURE),
        *(VIRIAL_RATIO, WALL_RATE, PAIR_RATE, FREE_PATH, MEAN_SPEED, KURTOSIS, CHI_SQUARE),
        *(ENERGY_DECAY, PRESSURE_DECAY, ENERGY_LEFT, CRITICAL_RATIO, GIVEN, *SIDES_GIVEN.values()),
        *(COLLISION_LOSS, ACROSS, *OF_FIGURES),
    )
}
"""Every quantity by its name; main ones first, in the order in which sentences have them."""


def main_quantities(*kinds: GasKind) -> list[Quantity]:
    """The quantities that tell most about a gas, in the order in which sentences have them."""
    return [one for one in QUANTITIES.values() if {*one.main_of} & {*kinds}]
