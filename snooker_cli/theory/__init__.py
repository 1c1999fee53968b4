"""Closed forms that the simulation can be held to: gas, fluid, collisions, cooling, speeds, limits.

Two dimensions, the Boltzmann constant is 1, SI units otherwise: temperature in J, pressure in
N/m (force over perimeter, "Pa·m"), number density in m⁻², rates in s⁻¹.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
N, m, r   number of balls, mass of a ball, radius of a ball; d = 2r
R, a      radius of a circular container, accessible radius a = R − r
w, h      width and height of a box
V         area of the container: πR², or w h
T         temperature, the mean kinetic energy of a ball; E = N T
n, η      number density N/V, packing fraction N πr²/V
Z, χ      compressibility factor P/(n T), contact value of the pair distribution
e, e_w    coefficient of restitution between balls, and at the wall
λ, ω, ν_w mean free path, ball-ball and wall collision rate of one ball
α, ζ, k   Haff's rate, cooling rate of the temperature, the report's decay constant
========  ==========================================================================
"""

from snooker_cli.theory.collision_rates import (
    CollisionRates,
    ball_ball_rate,
    boltzmann_mean_free_path,
    collision_rates,
    enskog_mean_free_path,
    report_mean_free_path,
    wall_rate,
    wall_rate_from_pressure,
)
from snooker_cli.theory.cooling_laws import (
    angular_momentum_floor,
    cooling_rate,
    energy_ratio_by_events,
    haff_rate,
    haff_ratio,
    report_decay_constant,
    report_pressure_decay_constant,
    sonine_coefficient,
    wall_trap,
)
from snooker_cli.theory.equation_of_state import (
    FluidState,
    accessible_wall_pressure,
    bulk_pressure,
    compressibility,
    contact_value,
    fluid_state,
    ideal_gas_pressure,
    ideal_gas_temperature,
    number_density,
    packing_fraction,
    published_ratio,
    van_der_waals_pressure,
)
from snooker_cli.theory.speed_distributions import (
    fixed_energy_factor,
    fixed_energy_kurtosis,
    fixed_energy_mean_speed,
    fixed_energy_speed_cdf,
    fixed_energy_speed_density,
    maxwell_mean_speed,
    maxwell_speed_cdf,
    maxwell_speed_density,
    sonine_speed_cdf,
)

__all__ = [
    "CollisionRates",
    "FluidState",
    "accessible_wall_pressure",
    "angular_momentum_floor",
    "ball_ball_rate",
    "boltzmann_mean_free_path",
    "bulk_pressure",
    "collision_rates",
    "compressibility",
    "contact_value",
    "cooling_rate",
    "energy_ratio_by_events",
    "enskog_mean_free_path",
    "fixed_energy_factor",
    "fixed_energy_kurtosis",
    "fixed_energy_mean_speed",
    "fixed_energy_speed_cdf",
    "fixed_energy_speed_density",
    "fluid_state",
    "haff_rate",
    "haff_ratio",
    "ideal_gas_pressure",
    "ideal_gas_temperature",
    "maxwell_mean_speed",
    "maxwell_speed_cdf",
    "maxwell_speed_density",
    "number_density",
    "packing_fraction",
    "published_ratio",
    "report_decay_constant",
    "report_mean_free_path",
    "report_pressure_decay_constant",
    "sonine_coefficient",
    "sonine_speed_cdf",
    "van_der_waals_pressure",
    "wall_rate",
    "wall_rate_from_pressure",
    "wall_trap",
]
