"""Rough surfaces: what a contact does along the tangent, and how balls spin.

A kernel of smooth balls has none of this code.
"""

import math
from collections import namedtuple
from dataclasses import fields
from typing import Any, NamedTuple, cast

from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.frames import laboratory_velocity
from snooker_cli.engine.jit import called_by_kernels, inlined
from snooker_cli.engine.kernel_state import Floats, Part, State
from snooker_cli.laws import Surface

LAST = 0
"""Of ``Rough.given``: the tangential impulse of an event until it is recorded, kg m/s."""


@called_by_kernels
class BallSurface(Part):
    """The surface of balls. It is smooth, unless a method says otherwise."""

    def rub_pair(
        self,
        i: int,
        j: int,
        x: float,
        y: float,
        u: float,
        v: float,
        normal: float,
        state: State,
    ) -> None:
        """Exchange the tangential impulse of balls i and j, which are (x, y) apart.

        u, v : the velocity of i less that of j before the collision, m/s
        normal : the impulse along the line of centres, kg m/s
        """

    def rub_wall(
        self, i: int, x: float, y: float, u: float, v: float, normal: float, state: State
    ) -> None:
        """Exchange the tangential impulse of ball i and a fixed wall, which is towards (x, y).

        u, v : the velocity of the ball before the collision, m/s
        normal : the impulse on the wall, kg m/s
        """

    def rub_free_wall(
        self,
        i: int,
        x: float,
        y: float,
        u: float,
        v: float,
        normal: float,
        state: State,
        wall: float,
        motion: Floats,
    ) -> None:
        """As ``rub_wall``, of a free container with a mass (kg), whose motion changes too."""

    def record_rub(self, event: Any) -> None:
        """Write the tangential impulse of an event into its record."""

    def show(self, i: int, column: Floats) -> None:
        """Write what ball i, of the scene's order, has beside its motion; see `fields.MOVING`."""

    def twice_spin_energy(self, i: int, state: State) -> float:
        """Twice the energy of rotation of ball i over its mass, m²/s²."""
        return 0.0

    def measure_spins(self, row: Floats, state: State) -> None:
        """Write the energy of rotation into a row."""

    def rubs_wall(self) -> bool:
        """Whether hits of the wall change anything along the tangent."""
        return False

    def slowest_along(
        self, i: int, along: float, changes: float, mass: float, state: State
    ) -> float:
        """The least tangential speed of ball i in infinitely many hits of the wall, or less, m/s.

        along : the present one to the left, m/s
        changes : of its normal speed in all these hits, m/s
        mass : its ``bouncing_mass``, kg
        """
        return abs(along)


class Smooth(BallSurface, NamedTuple("Smooth", [("law", None)])):
    """Balls that do not spin."""


@inlined
def tangential(slip: float, cor: float, friction: float, mass: float, normal: float) -> float:
    """The tangential impulse that changes a slip (m/s) to -cor times itself, kg m/s.

    mass : what moves along the tangent: 1/mass = (1 + 1/q) (1/m_i + 1/m_j), kg
    friction : the largest tangential impulse over the normal one; infinite without a limit

    Walton & Braun, J. Rheol. 30, 949 (1986); Luding, Phys. Rev. E 52, 4442 (1995).
    """
    sticks = mass * (1.0 + cor) * slip
    most = friction * normal
    return math.copysign(most, sticks) if abs(sticks) > most else sticks


SurfaceNumbers = cast(Any, namedtuple("SurfaceNumbers", [field.name for field in fields(Surface)]))
"""A ``Surface`` in a kernel: floats."""


class Rough(BallSurface, NamedTuple("Rough", [("law", Any), ("given", Floats), ("spins", Floats)])):
    """Balls that spin. A turn to the left is positive, rad/s.

    The tangent t is the normal n from ball i to j turned to the left. Surfaces slip at
    g_t = (v_i - v_j) t + r_i w_i + r_j w_j, and the impulse J_t along t slows i, speeds j up, and
    slows both spins::

                 t
                 |
           ( i )-+-( j )   n ->
           w_i       w_j

    law : ``SurfaceNumbers``
    given : (1,), see ``LAST``
    spins : (*N*,), rad/s, in the scene's order; it and what may follow are `fields.carried_fields`

    Stacked, the arrays have one axis more, the first.
    """

    def of_repeat(self, repeat: int) -> "Rough":
        return Rough(self.law, self.given[repeat], self.spins[repeat])

    def rub_pair(
        self, i: int, j: int, x: float, y: float, u: float, v: float, normal: float, state: State
    ) -> None:
        law = self.law
        if law.friction == 0.0:
            return  # all bits stay, as smooth scenes of a page need it
        balls, sizes, length = state.balls, state.sizes, math.sqrt(x * x + y * y)
        a, b = ks.label_of(i, state.labels), ks.label_of(j, state.labels)
        r, s = sizes.radius_of(i), sizes.radius_of(j)
        m, n = sizes.mass_of(i), sizes.mass_of(j)
        slip = (x * v - y * u) / length + r * self.spins[a] + s * self.spins[b]
        mass = law.inertia / (1.0 + law.inertia) * (m * (n / (m + n)))
        given = tangential(slip, law.tangential_cor, law.friction, mass, normal)
        x, y, first, second = x / length, y / length, given / m, given / n
        balls[ks.U, i] += first * y
        balls[ks.V, i] -= first * x
        balls[ks.U, j] -= second * y
        balls[ks.V, j] += second * x
        self.spins[a] -= first / (law.inertia * r)
        self.spins[b] -= second / (law.inertia * s)
        self.given[LAST] = given

    def rub_wall(
        self, i: int, x: float, y: float, u: float, v: float, normal: float, state: State
    ) -> None:
        u, v = laboratory_velocity(u, v, state)
        rub(self, i, x, y, u, v, normal, math.inf, state)

    def rub_free_wall(
        self,
        i: int,
        x: float,
        y: float,
        u: float,
        v: float,
        normal: float,
        state: State,
        wall: float,
        motion: Floats,
    ) -> None:
        along_x, along_y = rub(self, i, x, y, u, v, normal, wall, state)
        motion[ks.U] += along_x / wall
        motion[ks.V] += along_y / wall

    def record_rub(self, event: Any) -> None:
        event["tangential"] = self.given[LAST]
        self.given[LAST] = 0.0  # the next event may rub nothing

    def show(self, i: int, column: Floats) -> None:
        column[0] = self.spins[i]

    def twice_spin_energy(self, i: int, state: State) -> float:
        way = state.sizes.radius_of(i) * self.spins[ks.label_of(i, state.labels)]
        return float(self.law.inertia * way * way)

    def measure_spins(self, row: Floats, state: State) -> None:
        energy = 0.0
        for i in range(state.balls.shape[1]):
            energy += state.sizes.mass_of(i) * self.twice_spin_energy(i, state)
        row[-1] = 0.5 * energy

    def rubs_wall(self) -> bool:
        return bool(self.law.wall_tangential_cor > -1.0 and self.law.wall_friction > 0.0)

    def slowest_along(
        self, i: int, along: float, changes: float, mass: float, state: State
    ) -> float:
        # An impulse J changes the speed by J/mu and the slip by J (1/mu + 1/(q m)), so the speed
        # changes in proportion to the slip, however many hits there are. A hit leaves the slip g
        # between g and -beta g, so all later ones are between g and -max(beta, 0) g. Only a slip
        # along the speed lowers it. And all J add up to at most the friction times all normal
        # impulses. With beta = 1 and no limit, g and -g alternate, and so do two speeds.
        speed, spin = abs(along), self.spins[ks.label_of(i, state.labels)]
        slip = math.copysign(1.0, along) * (along + state.sizes.radius_of(i) * spin)
        moment = self.law.inertia * state.sizes.mass_of(i)  # over r²
        cor = self.law.wall_tangential_cor
        lowered = moment / (moment + mass) * (1.0 + max(cor, 0.0)) * max(slip, 0.0)
        if cor == 1.0 and self.law.wall_friction == math.inf:
            return float(min(speed, abs(speed - lowered)))
        if self.law.wall_friction < math.inf:
            lowered = min(lowered, self.law.wall_friction * changes)
        return float(max(speed - lowered, 0.0))


@inlined
def rub(
    surface: Rough,
    i: int,
    x: float,
    y: float,
    u: float,
    v: float,
    normal: float,
    wall: float,
    state: State,
) -> tuple[float, float]:
    """Rub ball i on a wall with a mass (kg) towards (x, y); the impulse on the wall, kg m/s."""
    law = surface.law
    if law.wall_friction == 0.0:
        return 0.0, 0.0
    balls, length = state.balls, math.sqrt(x * x + y * y)
    a, r, m = ks.label_of(i, state.labels), state.sizes.radius_of(i), state.sizes.mass_of(i)
    slip = (x * v - y * u) / length + r * surface.spins[a]
    mass = m / (1.0 + 1.0 / law.inertia + m / wall)
    given = tangential(slip, law.wall_tangential_cor, law.wall_friction, mass, normal)
    x, y, first = x / length, y / length, given / m
    balls[ks.U, i] += first * y
    balls[ks.V, i] -= first * x
    surface.spins[a] -= first / (law.inertia * r)
    surface.given[LAST] = given
    return -given * y, given * x
