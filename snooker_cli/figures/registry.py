"""The registry: every kind of picture by name, what it needs, and who makes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from snooker_cli.figures import cooling, distributions, gas_law, time_courses

if TYPE_CHECKING:
    from snooker_cli.figures.figure_data import FigureData
    from snooker_cli.figures.selection import Selection
    from snooker_cli.runs import Run


_STATES = "Any run with `record: events`."
_MOMENTUM = "A run with `record: events` and a finite container.mass, or a periodic box."


@dataclass(frozen=True)
class FigureSpec:
    """A kind of picture.

    needs : what a run must have, as a sentence
    make : a run and a selection of its points -> the picture; raises ``FigureError`` if the run
        cannot give it, ``StoreError`` if a repeat cannot be read
    report_figures : the source report's figures of this kind
    each_point : whether a picture shows one point, so that several points make several pictures
    """

    name: str
    title: str
    needs: str
    make: Callable[[Run, Selection], FigureData]
    report_figures: tuple[int, ...] = ()
    each_point: bool = False


_ALL = (
    FigureSpec(
        "central-distances",
        "distances of the balls from the container's centre",
        "A circle, with `record: events`.",
        distributions.central_distances_picture,
        (1,),
    ),
    FigureSpec(
        "pair-distances",
        "distances between the balls",
        _STATES,
        distributions.pair_distances_picture,
        (2,),
    ),
    FigureSpec(
        "energy",
        "kinetic energy of balls and container over time",
        "Any run.",
        time_courses.energy,
        (3,),
    ),
    FigureSpec(
        "momentum-x",
        "total momentum in x over that at the start",
        _MOMENTUM,
        time_courses.momentum_x,
        (4,),
    ),
    FigureSpec(
        "momentum-y",
        "total momentum in y over that at the start",
        _MOMENTUM,
        time_courses.momentum_y,
        (5,),
    ),
    FigureSpec(
        "energy-fit",
        "decay of the energy with its fits",
        "A point with cor or wall_cor below 1.",
        cooling.energy_fit,
        (6, 7),
        each_point=True,
    ),
    FigureSpec(
        "temperature-fit",
        "decay of the temperature with its fits",
        "A point with cor or wall_cor below 1.",
        cooling.temperature_fit,
        (8, 9),
        each_point=True,
    ),
    FigureSpec(
        "pressure",
        "mean pressure since the start over time",
        "Any run with collisions.",
        time_courses.pressure,
        (10,),
    ),
    FigureSpec(
        "pressure-fit",
        "decay of the mean pressure with its fits",
        "A point with cor or wall_cor below 1 and more than 50 collisions.",
        cooling.pressure_fit,
        (11, 12),
        each_point=True,
    ),
    FigureSpec(
        "pressure-temperature",
        "pressure against temperature",
        "Points at cor 1 with a sweep over balls.speed, and over balls.radius if wanted.",
        gas_law.pressure_temperature,
        (13,),
    ),
    FigureSpec(
        "pressure-area",
        "pressure against the container's area",
        "Points at cor 1 with a sweep over container.radius or width, and over balls.radius if "
        "wanted.",
        gas_law.pressure_area,
        (14,),
    ),
    FigureSpec(
        "pressure-number",
        "pressure against the number of balls",
        "Points at cor 1 with a sweep over balls.rings or count, and over balls.radius if wanted.",
        gas_law.pressure_number,
        (15,),
    ),
    FigureSpec(
        "temperature-ratio",
        "temperature by equipartition over that of the ideal gas law",
        "Points at cor 1 with a sweep over balls.radius.",
        gas_law.temperature_ratio,
        (16,),
    ),
    FigureSpec(
        "ideal-ratio",
        "simulated over ideal pressure, a point for each repeat",
        "Any run with collisions; small balls show the effect of the cor alone.",
        gas_law.ideal_ratio,
        (17,),
    ),
    FigureSpec(
        "speeds",
        "distribution of speeds beside Maxwell-Boltzmann",
        "A run with five or more collisions of a ball with others.",
        distributions.speeds,
        (18,),
    ),
    FigureSpec(
        "decay-against-cor",
        "decay constants of the energy against the cor",
        "A sweep over cor, two or more below 1.",
        cooling.decay_against_cor,
    ),
    FigureSpec(
        "haff-time",
        "how the decay rate falls with time",
        "Points with cor or wall_cor below 1, and ten collisions in each window of time.",
        cooling.haff_time,
    ),
    FigureSpec(
        "event-decay",
        "energy against collisions",
        "Points with cor or wall_cor below 1, and two or more balls.",
        cooling.event_decay,
    ),
)

FIGURES: dict[str, FigureSpec] = {kind.name: kind for kind in _ALL}
"""Every kind of picture by its name: the report's in the order of its figures, then ours."""
