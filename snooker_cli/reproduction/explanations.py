"""Six settings of scene and fits, and what each gives for the printed decay constants.

The source report states none of these changes. The list is short on purpose: a search through many
combinations finds one that agrees by chance.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from snooker_cli import Run
from snooker_cli.reproduction.run_results import NumbersOfRun, complete_repeats, decays, estimate
from snooker_cli.reproduction.source_values import (
    COEFFICIENTS,
    SOURCE_VALUES,
    TARGETS,
    OurValue,
)

FACTOR = 10.0
"""The printed mean free path over that of the stated balls; the claims of the text test it."""

FIRST = 200  # collisions from the start, in the rows that fit only these


@dataclass(frozen=True)
class Setting:
    """What differs from the scene and the fits that the source report states.

    small : balls of a tenth of the radius are behind the fits; speeds and pressure keep theirs
    elastic_wall : the wall's CoR is 1
    first : the fits end at the mean time of collision ``FIRST``
    slip : the time axis of the fits is ``FACTOR`` times too long
    """

    small: bool = False
    elastic_wall: bool = False
    first: bool = False
    slip: bool = False


SETTINGS = {
    "as stated": Setting(),
    "time axis of the fits × 10": Setting(slip=True),
    "balls of 0.1 m in the fits": Setting(small=True),
    "elastic wall": Setting(elastic_wall=True),
    "first 200 collisions": Setting(first=True),
    "time axis × 10, elastic wall": Setting(slip=True, elastic_wall=True),
}
"""The rows of the table; the last has the two changes that agree with most numbers together."""


@dataclass(frozen=True)
class Explanation:
    """A setting with its values.

    values : by the name of a printed number
    complete, repeats : repeats behind the fits
    """

    name: str
    values: Mapping[str, OurValue]
    complete: int
    repeats: int
    agreeing: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        agree = [n for n, value in self.values.items() if value.agrees(SOURCE_VALUES[n])]
        object.__setattr__(self, "agreeing", tuple(agree))


def explain(run: Run, pressure: NumbersOfRun) -> dict[str, Any]:
    """The explanations by name, as JSON, from the run ``audit`` and the pressure at CoR 1.

    Raises ``RunError``, ``FigureError`` or ``StoreError``.
    """
    return {name: asdict(_explanation(run, name, pressure)) for name in SETTINGS}


def _explanation(run: Run, name: str, pressure: NumbersOfRun) -> Explanation:
    setting, radii = SETTINGS[name], sorted({p.as_json()["balls.radius"] for p in run.points})
    values = {"pressure": OurValue(pressure["value"], pressure["deviation"])}
    complete = repeats = 0
    for cor in COEFFICIENTS:
        where = {"cor": cor, "wall_cor": 1.0 if setting.elastic_wall else None}
        stated = where | {"balls.radius": radii[-1]}
        fitted = where | {"balls.radius": radii[0 if setting.small else -1]}
        rows = decays(run, until=_end(run, fitted) if setting.first else np.inf, **fitted)
        scale = FACTOR if setting.slip else 1.0
        for target, quantity in (("energy", "kinetic_energy"), ("pressure", "pressure")):
            row = rows[quantity]["exponential"]
            values[f"{target}_mean_{cor}"] = OurValue(row["value"] / scale, row["error"] / scale)
        complete, repeats = complete + row["complete"], repeats + row["requested"]
        courses = [repeat.series() for repeat in complete_repeats(run, **stated)]
        speed = estimate(course.mean_speed[1:].mean() for course in courses)
        values[f"speed_{cor}"] = OurValue(speed["value"], speed["error"])
    ordered = {number.name: values[number.name] for number in TARGETS}
    return Explanation(name, ordered, complete, repeats)


def _end(run: Run, where: Mapping[str, Any]) -> float:
    """The mean time of collision ``FIRST`` over the repeats that have it, s."""
    (point,) = run.matching(**where)
    courses = (repeat.series() for repeat in run.repeats(point.index))
    return float(np.mean([c.time[FIRST] for c in courses if len(c.time) > FIRST]))
