"""Laws of collision: what a hit does to the speed along the line of centres.

A law is a ``NamedTuple`` of numbers, whose names are its config keys; at the wall these begin with
``wall_``. Kernels are compiled for the class of the law, so a law that a scene lacks costs nothing.

cor : every law's first number: the coefficient of restitution e, 0 to 1, of fast collisions
kick : a method that kernels compile, with ``+ - * / sqrt`` only, so that bits are the same
    everywhere. It gives the change of the normal speed, in the unit of ``normal``.
constant : whether e is the same at all speeds; theories, wall traps and slides need it
gains : whether a collision can give energy to the balls
"""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias


class Constant(NamedTuple):
    """One coefficient of restitution for all speeds."""

    cor: float

    @property
    def constant(self) -> bool:
        return True

    @property
    def gains(self) -> bool:
        return False

    def kick(self, normal: float, _length: float) -> float:
        """(1 + e) v_n, over a length.

        normal : the speed of approach v_n over ``length``; negative only by rounding
        length : m, of the vector along which it is measured; 1 if ``normal`` is a speed, m/s
        """
        return (1.0 + self.cor) * normal


Law: TypeAlias = Constant

LAWS: Mapping[str, type[Law]] = {"constant": Constant}
"""The laws by their word in files; the first is the default."""


def law_of(**keys: float | None) -> Law:
    """The law that has just these keys of a config; a key with the value ``None`` is not given."""
    given = {key: value for key, value in keys.items() if value is not None}
    return next(law for law in LAWS.values() if {*law._fields} == given.keys())(**given)


def word_of(law: Law) -> str:
    """The law's word in files."""
    return next(word for word, law_class in LAWS.items() if type(law) is law_class)
