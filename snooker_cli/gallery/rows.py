"""A repeat's rows that are worth showing."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.observables import INSTANT, instants, series
from snooker_cli.trace import SERIES_UNITS, StopReason

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.gallery.picture import Array
    from snooker_cli.trace import Series, Trace

MOST_VERTICES = 1000


def thinned(time: Array, most: int = MOST_VERTICES) -> NDArray[np.intp]:
    """At most so many rows, an instant each, evenly, with the last and, but for ties, the first."""
    rows = instants(time)
    return np.asarray(rows[np.linspace(0, len(rows) - 1, min(len(rows), most)).astype(np.intp)])


def until_collapse(trace: Trace) -> Series:
    """A repeat's series without the collisions of a collapse at the instant where time stops."""
    found = series(trace)
    if trace.stop.reason is not StopReason.COLLAPSE:
        return found
    before = found.time < (1 - INSTANT) * trace.stop.time
    return replace(found, **{name: getattr(found, name)[before] for name in SERIES_UNITS})
