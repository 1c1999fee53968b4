"""A repeat's rows that are worth showing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.observables import instants

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.gallery.picture import Array

MOST_VERTICES = 1000


def thinned(time: Array, most: int = MOST_VERTICES) -> NDArray[np.intp]:
    """At most so many rows, an instant each, evenly, with the last and, but for ties, the first."""
    rows = instants(time)
    return np.asarray(rows[np.linspace(0, len(rows) - 1, min(len(rows), most)).astype(np.intp)])
