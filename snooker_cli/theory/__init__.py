"""Closed formulas to compare simulations with, each with its source.

In two dimensions with k_B = 1, otherwise SI units: temperature in J, pressure in N/m (force over
the length of the wall, "Pa·m"), number density in m⁻², rates in s⁻¹.

========  ==========================================================================
symbol    meaning
========  ==========================================================================
N, m, r   number of balls, mass and radius of a ball; d = 2r
R, a      radius of a circular container, accessible radius a = R − r
w, h      width and height of a box
V         area of the container: πR², or w h
T         temperature, the mean kinetic energy of a ball; E = N T
n, η      number density N/V, packing fraction N πr²/V
Z, χ      compressibility factor P/(n T), contact value of the pair distribution
e, e_w    coefficient of restitution between balls, and at the wall
λ, ω, ν_w mean free path, ball-ball and wall collision rate of one ball
α, ζ, k   Haff's rate, cooling rate of the temperature, decay constant of the source report
========  ==========================================================================
"""

from snooker_cli.theory.collision_rates import (
    CollisionRates,
    ball_ball_rate,
    collision_rates,
    friction,
    mean_free_path,
    source_mean_free_path,
    wall_rate,
)
from snooker_cli.theory.cooling_laws import (
    SourceFactors,
    angular_momentum_floor,
    cooling_rate,
    critical_length,
    energy_ratio_by_events,
    haff_rate,
    haff_ratio,
    sonine_coefficient,
    source_decay_constant,
    source_factors,
)
from snooker_cli.theory.equation_of_state import (
    DENSEST_FLUID,
    FluidState,
    accessible_wall_pressure,
    compressibility,
    contact_value,
    fluid_state,
    ideal_gas_pressure,
    number_density,
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

__all__ = ["CollisionRates", "ball_ball_rate", "collision_rates", "mean_free_path"]
__all__ += ["friction", "source_mean_free_path", "wall_rate"]
__all__ += ["angular_momentum_floor", "cooling_rate", "critical_length", "haff_rate"]
__all__ += ["SourceFactors", "haff_ratio", "sonine_coefficient", "source_decay_constant"]
__all__ += ["energy_ratio_by_events", "source_factors"]
__all__ += ["DENSEST_FLUID", "FluidState", "accessible_wall_pressure", "compressibility"]
__all__ += [
    "contact_value",
    "fluid_state",
    "ideal_gas_pressure",
    "number_density",
    "published_ratio",
]
__all__ += ["van_der_waals_pressure"]
__all__ += ["fixed_energy_factor", "fixed_energy_kurtosis", "fixed_energy_mean_speed"]
__all__ += ["fixed_energy_speed_cdf", "fixed_energy_speed_density", "maxwell_mean_speed"]
__all__ += ["maxwell_speed_cdf", "maxwell_speed_density", "sonine_speed_cdf"]
