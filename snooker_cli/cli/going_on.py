"""What to set in a config so that repeats go on past infinitely many collisions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from snooker_cli.trace import StopReason

if TYPE_CHECKING:
    from snooker_cli.config import Experiment
    from snooker_cli.results import Run
    from snooker_cli.runner import Outcome

SLIDE = "collapse: slide lets trapped balls slide along the wall, exactly, and the repeats go on"
SLIDE_IF_FIXED = (
    "collapse: {tc: 0.01} has repeats with trapped balls go on; exactly, in a fixed container, "
    "collapse: slide does"
)
TC = "collapse: {tc: 0.01} has repeats with collapsed balls go on"


def advice(run: Run, outcomes: list[Outcome]) -> list[str]:
    """A sentence for each way out of what some repeats ended in."""
    ends = {(each.point, each.stop.reason) for each in outcomes if each.stop}
    return list(
        dict.fromkeys(
            said
            for point, reason in sorted(ends)
            for said in _ways_on(run.points[point].experiment, reason)
        )
    )


def _ways_on(experiment: Experiment, reason: StopReason) -> Iterator[str]:
    """What has repeats go on that ended so, if the config asks for nothing of the kind."""
    if reason is StopReason.WALL_TRAP and experiment.collapse == "stop":
        yield SLIDE_IF_FIXED if math.isfinite(experiment.container.mass) else SLIDE
    lossy = min(experiment.cor, experiment.effective_wall_cor) < 1.0
    if reason is StopReason.COLLAPSE and experiment.collapse in ("stop", "slide") and lossy:
        yield TC
