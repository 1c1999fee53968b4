"""What a figure needs of a point's config, so that no repeat must be read to refuse the point.

Each condition gives the reason why a figure cannot show a point, or an empty text.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from snooker_cli.config import Point
from snooker_cli.containers import ENDS
from snooker_cli.figures.selection import gas
from snooker_cli.laws import Sides

Condition = Callable[[Point], str]

MOST_SPECIES = 6  # that one figure can show

MANY_BALLS = 500  # some 25 cells of 20 balls, of which a circle holds nine or more

REFUSED = {
    "cooling": "nothing decays where all collisions are elastic; take cor below 1",
    "elastic": "it is about the equilibrium of elastic balls; run it at cor 1",
    "warm": "it is about walls that give energy; set wall_speed or wall_temperature",
}
"""Why a figure of these gases does not show the points."""

WARM = "walls give energy, so the gas neither cools nor keeps its energy; see `stationary`"


def shows_gas(*gases: str) -> Condition:
    """That a point's gas is one of these."""

    def reason(point: Point) -> str:
        if (found := gas(point)) in gases:
            return ""
        return WARM if found == "warm" else REFUSED[gases[0]]

    return reason


def _events(point: Point) -> str:
    kept = point.experiment.keeps_events
    return "" if kept else "it needs the balls' states; run the config with `record: events`"


def _many(point: Point) -> str:
    many = point.experiment.number >= MANY_BALLS
    return "" if many else f"its cells need {MANY_BALLS} balls or more"


def _states(point: Point) -> str:
    if point.experiment.keeps_events or point.experiment.stored_times:
        return ""
    return "it needs the balls' states; run the config with `record: events` or `snapshots`"


def _repeats_somewhere(point: Point) -> str:
    repeats = any(point.experiment.container.shape_class.periodic)
    return "" if repeats else "walls change it; it needs a periodic box or a channel"


def _several(point: Point) -> str:
    several = point.experiment.number > 1
    return "" if several else "one ball is alone; it needs two or more"


def _moves(point: Point) -> str:
    balls: Any = point.experiment.balls
    groups = balls if isinstance(balls, tuple) else getattr(balls, "list", [balls])
    moves = any(
        getattr(group, "speed", 0) or any(getattr(group, "velocity", ())) for group in groups
    )
    return "" if moves else "nothing moves at the start, so there is no ratio to it"


def _circle(point: Point) -> str:
    shape = point.experiment.container.shape_class
    distant = "only the wall of a circle is at one distance from the centre"
    return "" if shape.across == "radius" else distant


def _keeps_momentum(point: Point) -> str:
    case = point.experiment
    if case.container.shape_class.has_wall:
        fixed = case.container.mass == math.inf
        return "fixed walls take momentum; give a circle a finite container.mass" if fixed else ""
    at_rest = case.species and not case.placed
    return "the momentum is zero at the start, so it has no ratio to it" if at_rest else ""


def _walls(point: Point) -> str:
    shape = point.experiment.container.shape_class
    if shape.has_wall and shape.across is None:
        return f"a {shape.title} has no direction across; state `across` in containers.py"
    return "" if shape.has_wall else "it shows the gas between walls; set another container.shape"


def _hot_sides(point: Point) -> str:
    law, shape = point.experiment.wall_law, point.experiment.container.shape_class
    pair = ENDS.get(shape.across or "", ())
    if not isinstance(law, Sides) or not any(getattr(law, side).gains for side in pair):
        first, second = pair or ENDS["x"]
        return f"it needs a box or a channel whose {first} or {second} wall alone gives energy"
    return "the conductivity is that of equal balls" if len(_species(point)) > 1 else ""


def _rough(point: Point) -> str:
    rough = point.experiment.surface is not None
    return "" if rough else "smooth balls do not spin; give tangential_cor"


def _smooth(point: Point) -> str:
    smooth = point.experiment.surface is None
    return "" if smooth else "its theory is of smooth balls; remove tangential_cor"


def _few_species(point: Point) -> str:
    number = len(_species(point))
    needed = f"it needs 2 to {MOST_SPECIES} species of balls, not {number}"
    return "" if 1 < number <= MOST_SPECIES else needed


def _not_many_species(point: Point) -> str:
    number = len(_species(point))
    return (
        "" if number <= MOST_SPECIES else f"it shows {MOST_SPECIES} species at most, not {number}"
    )


def _two_species(point: Point) -> str:
    number = len(_species(point))
    return "" if number == 2 else f"it needs 2 species of balls, not {number}"


def _states_of_mixture(point: Point) -> str:
    if len(_species(point)) == 1:
        return ""
    if (reason := _few_species(point)) or not _states(point):
        return reason
    return "a2 of a mixture needs the balls' states; run it with `record: events` or `snapshots`"


def _species(point: Point) -> set[tuple[float | None, float]]:
    """The radii (m; ``None`` for all if packing gives them) and masses (kg) of the balls."""
    balls: Any = point.experiment.balls
    groups = balls if isinstance(balls, tuple) else getattr(balls, "list", [balls])
    return {(group.radius, group.mass) for group in groups}


CONDITIONS: Mapping[str, Condition] = {
    "circle": _circle,
    "events": _events,
    "few_species": _few_species,
    "hot_sides": _hot_sides,
    "images": _repeats_somewhere,
    "keeps_momentum": _keeps_momentum,
    "many": _many,
    "moves": _moves,
    "not_many_species": _not_many_species,
    "rough": _rough,
    "several": _several,
    "smooth": _smooth,
    "states": _states,
    "states_of_mixture": _states_of_mixture,
    "two_species": _two_species,
    "walls": _walls,
}
"""The conditions by their names in ``requires`` of registry.yaml."""
