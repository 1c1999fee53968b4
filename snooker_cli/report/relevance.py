"""The figures that a report shows by itself, the most telling first, and why it omits others."""

from collections.abc import Sequence

from snooker_cli.config import Point
from snooker_cli.figures.selection import elastic
from snooker_cli.runs.plan import critical_ratio
from snooker_cli.scene import Scene

ORDER = (
    *("decay-against-cor", "energy-fit", "haff-time", "event-decay", "energy"),
    *("pressure-number", "pressure-area", "pressure-temperature", "temperature-ratio"),
    *("van-der-waals", "mean-squared-displacement", "velocity-autocorrelation", "tagged-path"),
    *("species-temperature", "local-energy", "pressure", "speeds", "hexatic-order"),
    *("pair-correlation", "a2"),
)
"""Figures by relevance. The key figures of a run are the first two of these that it has."""

KEY_FIGURES = 2

DENSE = 0.5  # packing from which neighbours have an order that a figure shows

_CHECK = "it checks rounding, which snooker verify does too"
_SOURCE = "it is for comparison with the source report"
_NOT_TAGGED = "no ball is given by its place"
_DILUTE = f"a gas of a packing below {DENSE:g} has no such order"

_ALWAYS = {
    **dict.fromkeys(("central-distances", "pair-distances", "momentum-x", "momentum-y"), _CHECK),
    **dict.fromkeys(("temperature-fit", "pressure-fit", "ideal-ratio"), _SOURCE),
    "pressure-area-linear": "pressure-area shows the same points",
}
"""Figures that say nothing on the physics of a run beyond others, and why."""


def trivial(points: Sequence[Point], starts: Sequence[Scene]) -> dict[str, str]:
    """Figures that a report leaves out unless they are asked for, with the reason.

    points, starts : of a run; starts of its points, or of some
    """
    found = dict(_ALWAYS)
    kept = {elastic(point) for point in points}
    if kept == {True}:
        found["energy"] = "elastic collisions keep the energy"
        found["a2"] = "speeds shows the same for an elastic gas"
    elif kept == {False}:
        found["pressure"] = "without an elastic point it falls like the temperature"
    given = (one.experiment.placed or getattr(one.experiment.balls, "list", ()) for one in points)
    if not any(given):
        tagged = "mean-squared-displacement", "velocity-autocorrelation", "tagged-path"
        found |= dict.fromkeys(tagged, _NOT_TAGGED)
    if all(scene.packing_fraction < DENSE for scene in starts):
        found |= dict.fromkeys(("hexatic-order", "pair-correlation"), _DILUTE)
    ratios = [critical_ratio(scene, scene.restitution) for scene in starts]
    if kept == {True} or all(ratio is not None and ratio <= 1 for ratio in ratios):
        found["local-energy"] = "no vortices grow where L/L_c is below 1"
    return found
