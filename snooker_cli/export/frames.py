"""A trace and times -> the states then, a batch at a time, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.engine import replay, times_within

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.engine import States
    from snooker_cli.trace import Trace

MOST = 1 << 22
"""Balls times frames in a batch: 32 bytes each, and as much again twice while it is made."""


def frames(trace: Trace, times: NDArray[np.float64], most: int = MOST) -> Iterator[States]:
    """The states at ``times`` (s), some at a time.

    Each batch is replayed from the start, as only so its bits are those of the simulation.

    Raises ``ValueError`` for times that are not ascending within 0 and the trace's end.
    """
    times = times_within(trace, times)  # now, and not when the first of them are asked for
    at_once = max(1, most // trace.start.number)
    firsts = range(0, len(times), at_once)
    return (replay(trace, times[first : first + at_once]) for first in firsts)
