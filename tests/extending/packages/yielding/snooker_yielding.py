"""Balls that yield: elastic up to a speed, and above it ever less (Johnson, Contact Mechanics)."""

import math

from snooker_cli.extending import LawSpeed, PackageLaw, Restitution, law


@law
class Yielding(PackageLaw):
    """e(v) = 1 up to the yield speed; above, (yield_speed/v)^¼, but no less than ``cor``.

    yield_speed : m/s
    """

    name = "yielding"

    cor: Restitution
    yield_speed: LawSpeed

    @staticmethod
    def restitution(speed: float, cor: float, yield_speed: float) -> float:
        """The coefficient of restitution at a normal speed, m/s."""
        if speed <= yield_speed:
            return 1.0
        return max(math.sqrt(math.sqrt(yield_speed / speed)), cor)
