"""How a film's time passes while it is shown: evenly, or one collision after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.animation.film import Film

Pace = Literal["time", "events"]


@dataclass(frozen=True)
class Reel:
    """A film's time at each moment of showing.

    Moments run from 0 to 1. With the pace "events" each collision takes the same part of them,
    and so does what is after the last.

    knots : (*n* + 2,) s: the start, the collisions, the end
    """

    pace: Pace
    knots: NDArray[np.float64]

    def time(self, moments: NDArray[np.float64]) -> NDArray[np.float64]:
        """The film's time at moments, s."""
        return np.interp(moments, self._moments(), self.knots)

    def collision_moments(self) -> NDArray[np.float64]:
        """(*n*,) the moments of the collisions."""
        return self._moments()[1:-1]

    def _moments(self) -> NDArray[np.float64]:
        """(*n* + 2,) the moments of the knots."""
        if self.pace == "events":
            return np.linspace(0.0, 1.0, len(self.knots))
        start, end = self.knots[0], self.knots[-1]
        return np.asarray((self.knots - start) / (end - start))


def reel(film: Film, pace: Pace) -> Reel:
    """A film's reel at a pace."""
    return Reel(pace, np.concatenate([[film.start], film.time, [film.end]]))
