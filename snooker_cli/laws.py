"""Laws of collision: what a hit does to the speed along the line of centres.

A law is a ``NamedTuple`` of numbers, whose names are its config keys; at the wall these begin with
``wall_``. What it does to the normal speed is in ``engine.restitution``.

cor : every law's first number: the coefficient of restitution e, 0 to 1, of fast collisions
gains : whether a collision can give energy to the balls
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias


class Constant(NamedTuple):
    """One coefficient of restitution for all speeds."""

    cor: float

    @property
    def gains(self) -> bool:
        return False


class Viscoelastic(NamedTuple):
    """Restitution that depends on the normal speed v: 1 - (1 - e) (v/v0)^(3/4) below v0, else e.

    Slow collisions are almost elastic (Bizon et al., Phys. Rev. Lett. 80, 57 (1998)).

    cor_speed : v0, m/s
    """

    cor: float
    cor_speed: float

    @property
    def gains(self) -> bool:
        return False


class Driven(NamedTuple):
    """A wall that moves inwards at a speed V whenever it is hit, and is always at the same place.

    This is saw-tooth driving of vanishing amplitude. A ball leaves with e v_n + (1 + e) V.

    speed : V, m/s, above 0
    """

    cor: float
    speed: float

    @property
    def gains(self) -> bool:
        return True


class Thermal(NamedTuple):
    """A wall with a temperature: a ball leaves it with a random velocity of Maxwell's flux.

    temperature : J, above 0
    """

    temperature: float

    @property
    def cor(self) -> float:
        """A ball keeps nothing of its normal speed."""
        return 0.0

    @property
    def gains(self) -> bool:
        return True


class Sides(NamedTuple):
    """The laws of straight walls, one for each side."""

    left: "Law"
    right: "Law"
    bottom: "Law"
    top: "Law"

    @property
    def cor(self) -> float:
        """The least of all sides."""
        return min(law.cor for law in self)

    @property
    def gains(self) -> bool:
        return any(law.gains for law in self)


class Surface(NamedTuple):
    """Rough balls: what a collision does along the tangent, see ``engine.surfaces``.

    inertia : q of the moment of inertia q m r², above 0, at most 1
    tangential_cor, wall_tangential_cor : β of slow slips, -1 (smooth) to 1, of two balls and at
        the wall
    friction, wall_friction : μ, the largest tangential impulse over the normal one; may be infinite
    """

    inertia: float
    tangential_cor: float
    friction: float
    wall_tangential_cor: float
    wall_friction: float

    @property
    def rubs_wall(self) -> bool:
        """Whether hits of the wall change anything along the tangent."""
        return self.wall_tangential_cor > -1.0 and self.wall_friction > 0.0

    @property
    def elastic_pairs(self) -> bool:
        """Whether no contact of two balls takes energy."""
        return _keeps_energy(self.tangential_cor, self.friction)

    @property
    def elastic_wall(self) -> bool:
        """Whether no hit of the wall takes energy."""
        return _keeps_energy(self.wall_tangential_cor, self.wall_friction)


def _keeps_energy(cor: float, friction: float) -> bool:
    """Whether surfaces are smooth, or turn each slip round."""
    return cor == -1 or friction == 0 or (cor == 1 and friction == math.inf)


Law: TypeAlias = Constant | Viscoelastic | Driven | Thermal
WallLaw: TypeAlias = Law | Sides

LAWS: Mapping[str, type[WallLaw]] = {
    "constant": Constant,
    "viscoelastic": Viscoelastic,
    "driven": Driven,
    "thermal": Thermal,
    "sides": Sides,
}
"""The laws by their word in files; the first is the default."""


class LawError(ValueError):
    """No law has just these keys.

    keys : these, in the order in which they were given
    """

    def __init__(self, keys: Sequence[str]) -> None:
        super().__init__(f"no law of collision in laws.py has the keys {', '.join(keys)}")
        self.keys = tuple(keys)


def law_of(keys: Mapping[str, float | None]) -> Any:
    """The law that has just these keys of a config; a key with the value ``None`` is not given.

    Raises ``LawError`` without such a law.
    """
    given: dict[str, Any] = {key: value for key, value in keys.items() if value is not None}
    for law in LAWS.values():
        if {*law._fields} == given.keys():
            return law(**given)
    raise LawError([*given])


def parts_of(law: WallLaw) -> tuple[Law, ...]:
    """The laws of the sides of a wall, or its only law."""
    return tuple(law) if isinstance(law, Sides) else (law,)


def is_random(law: WallLaw) -> bool:
    """Whether hits of a wall need random numbers."""
    return any(isinstance(part, Thermal) for part in parts_of(law))


def word_of(law: WallLaw) -> str:
    """The law's word in files."""
    return next(word for word, law_class in LAWS.items() if type(law) is law_class)
