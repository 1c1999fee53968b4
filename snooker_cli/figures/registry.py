"""The registry: every figure by name, the runs that can give it, and the function that makes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from snooker_cli.figures import cooling, distributions, gas_law, time_courses

if TYPE_CHECKING:
    from snooker_cli.figures.figure_data import FigureData
    from snooker_cli.figures.selection import Selection
    from snooker_cli.runs import Run


@dataclass(frozen=True)
class FigureSpec:
    """A figure that runs can give.

    needs : what a run must have, as a sentence
    make : a run and a selection of its points -> the figure; raises ``FigureError`` if the run
        cannot give it, ``StoreError`` if a repeat cannot be read
    report_figures : the source report's figures of this type
    each_point : whether a figure shows one point, so that several points make several figures
    """

    name: str
    title: str
    needs: str
    make: Callable[[Run, Selection], FigureData]
    report_figures: tuple[int, ...] = ()
    each_point: bool = False


_MOMENTUM = "A run with `record: events` and a finite container.mass, or a periodic box."
_LOSSES = "A point with cor or wall_cor below 1"
_RADII = "and over balls.radius if wanted."

_ALL = (
    FigureSpec(
        "central-distances",
        "distances of the balls from the container's centre",
        "A circle, with `record: events`.",
        partial(distributions.distances, distributions.CENTRAL),
        (1,),
    ),
    FigureSpec(
        "pair-distances",
        "distances between the balls",
        "Any run with `record: events`.",
        partial(distributions.distances, distributions.PAIRS),
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
        partial(time_courses.momentum_component, 0, "x"),
        (4,),
    ),
    FigureSpec(
        "momentum-y",
        "total momentum in y over that at the start",
        _MOMENTUM,
        partial(time_courses.momentum_component, 1, "y"),
        (5,),
    ),
    FigureSpec(
        "energy-fit",
        "decay of the energy with its fits",
        f"{_LOSSES}.",
        partial(cooling.fit_figure, "kinetic_energy"),
        (6, 7),
        each_point=True,
    ),
    FigureSpec(
        "temperature-fit",
        "decay of the temperature with its fits",
        f"{_LOSSES}.",
        partial(cooling.fit_figure, "temperature"),
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
        f"{_LOSSES} and more than 50 collisions.",
        partial(cooling.fit_figure, "pressure"),
        (11, 12),
        each_point=True,
    ),
    FigureSpec(
        "pressure-temperature",
        "pressure against temperature",
        f"Points at cor 1 with a sweep over balls.speed, {_RADII}",
        partial(gas_law.pressures, gas_law.TEMPERATURE),
        (13,),
    ),
    FigureSpec(
        "pressure-area",
        "pressure against the container's area",
        f"Points at cor 1 with a sweep over container.radius or width, {_RADII}",
        partial(gas_law.pressures, gas_law.AREA),
        (14,),
    ),
    FigureSpec(
        "pressure-number",
        "pressure against the number of balls",
        f"Points at cor 1 with a sweep over balls.rings or count, {_RADII}",
        partial(gas_law.pressures, gas_law.NUMBER),
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
        "simulated over ideal pressure, a marker for each repeat",
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

FIGURES: dict[str, FigureSpec] = {spec.name: spec for spec in _ALL}
"""Every figure by its name: the source report's in the order of its figures, then ours."""
