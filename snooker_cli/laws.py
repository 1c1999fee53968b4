"""Laws of collision: what a hit does to the speed along the line of centres.

A law is a ``NamedTuple`` of numbers, whose names are its config keys; at the wall these begin with
``wall_``. Kernels are compiled for the class of the law, so a law that a scene lacks costs nothing.

cor : every law's first number: the coefficient of restitution e, 0 to 1, of fast collisions
kick : a method that kernels compile, with ``+ - * / sqrt`` only, so that bits are the same
    everywhere. It gives the change of the normal speed, in the unit of ``normal``.
gains : whether a collision can give energy to the balls
bounce_sums : a method of laws whose every hit takes a share of the normal speed, so that infinitely
    many hits of a circular wall may follow each other in finite time
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias


class Constant(NamedTuple):
    """One coefficient of restitution for all speeds."""

    cor: float

    @property
    def gains(self) -> bool:
        return False

    def kick(self, normal: float, _length: float) -> float:
        """(1 + e) v_n, over a length.

        normal : the speed of approach v_n over ``length``; negative only by rounding
        length : m, of the vector along which it is measured; 1 if ``normal`` is a speed, m/s
        """
        return (1.0 + self.cor) * normal

    def recoil(self, normal: float, _length: float, elastic: bool) -> float:
        return (1.0 - (1.0 if elastic else self.cor)) * normal

    def bounce_sums(self, _normal: float, _length: float) -> tuple[float, float]:
        return 1.0 - self.cor, (1.0 + self.cor) / (1.0 - self.cor)


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

    def kick(self, normal: float, length: float) -> float:
        root = math.sqrt(min(abs(normal) * length / self.cor_speed, 1.0))
        return (2.0 - (1.0 - self.cor) * (root * math.sqrt(root))) * normal

    def bounce_sums(self, normal: float, length: float) -> tuple[float, float]:
        """The speeds add up to at most G(v) = 4 v0/(1 - e) (v/v0)^(1/4).

        Above v0 it is (v + 3 v0)/(1 - e). G is concave, and its derivative times what a hit takes
        is v. So a hit lowers it by v or more.
        """
        part = normal * length / self.cor_speed
        if part == 0.0:
            return 1.0, 2.0
        root = math.sqrt(min(part, 1.0))
        share = 0.25 * root * math.sqrt(root) if part < 1.0 else part / (3.0 + part)
        loss = (1.0 - self.cor) * share
        return loss, 2.0 / loss

    def is_endless(self, bounces: int) -> bool:
        """After 2^20: speeds fall as k^(-4/3) in k bounces, and the time left only as k^(-1/3)."""
        return bounces >= 1 << 20


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

    def kick(self, normal: float, length: float) -> float:
        return (1.0 + self.cor) * (normal + self.speed / length)

    def elastic_kick(self, normal: float, length: float) -> float:
        return (1.0 + self.cor) * (normal + self.speed / length)


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


def law_of(**keys: Any) -> Any:
    """The law that has just these keys of a config; a key with the value ``None`` is not given."""
    given = {key: value for key, value in keys.items() if value is not None}
    return next(law for law in LAWS.values() if {*law._fields} == given.keys())(**given)


def is_random(law: WallLaw) -> bool:
    """Whether hits of a wall need random numbers."""
    laws = law if isinstance(law, Sides) else (law,)
    return any(isinstance(part, Thermal) for part in laws)


def word_of(law: WallLaw) -> str:
    """The law's word in files."""
    return next(word for word, law_class in LAWS.items() if type(law) is law_class)
