"""Typical lengths and times of a gas before it runs, each by the theory that holds for it.

A scale is a value of a theory of `theories.THEORIES`, or its inverse, for a gas that has only its
energy: that at the start, or in a warm gas that which theory expects. So a scale is shown where its
theory holds. No theory here gives the time of the first wall trap.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from snooker_cli import facts, theory
from snooker_cli.analysis import observables, theories
from snooker_cli.analysis import quantities as q
from snooker_cli.analysis.gas import Array, Gas
from snooker_cli.analysis.quantities import Quantity
from snooker_cli.analysis.theories import CRITICAL
from snooker_cli.analysis.time_series import Averages
from snooker_cli.facts import FACTS
from snooker_cli.formatting import least_to_most, listed, text_table
from snooker_cli.scene import Scene
from snooker_cli.theory import FINITE


class Scale(NamedTuple):
    """A typical length, time or ratio.

    words, symbol, unit : as tables have them
    quantity, models : its theories; the first that holds is used
    of : the scale, from the value of the theory and the scene
    """

    words: str
    symbol: str
    unit: str
    quantity: Quantity
    models: tuple[str, ...]
    of: Callable[[float, Scene], float]

    @property
    def title(self) -> str:
        """The name of its row."""
        return f"{self.words} {self.symbol}" + (f", {self.unit}" if self.unit != "1" else "")


def _itself(value: float, _scene: Scene) -> float:
    return value


def _inverse(value: float, _scene: Scene) -> float:
    return 1 / value if value else math.inf


def _critical_length(ratio: float, scene: Scene) -> float:
    return scene.container.longest_wave / ratio


_BETWEEN, _AT_WALL, _CRITICAL = (FINITE, theories.ENSKOG), (FINITE, "ideal gas"), (CRITICAL,)

SCALES: tuple[Scale, ...] = (
    Scale("mean free path", "λ", "m", q.FREE_PATH, _BETWEEN, _itself),
    Scale("time between collisions of a ball", "1/ω", "s", q.PAIR_RATE, _BETWEEN, _inverse),
    Scale("time between hits of the wall", "1/ν_w", "s", q.WALL_RATE, _AT_WALL, _inverse),
    Scale("time of cooling to T/4", "1/α", "s", q.HAFF_RATE, (FINITE,), _inverse),
    Scale("critical length", "L_c", "m", q.CRITICAL_RATIO, _CRITICAL, _critical_length),
    Scale("container over critical length", "L/L_c", "1", q.CRITICAL_RATIO, _CRITICAL, _itself),
)
"""Every scale, in the order of the table."""


class Expected(Gas):
    """A gas that is known by its energy alone, J; other means are nan."""

    def __init__(self, scene: Scene, energy: float) -> None:
        super().__init__(scene)
        self.energy = energy

    @cached_property
    def means(self) -> Averages:
        """Means of a gas that keeps its energy."""
        meeting = observables.meeting_temperature(self.energy, self.scene)
        known = {
            "kinetic_energy": self.energy,
            "root_energy": math.sqrt(self.energy),
            "meeting": meeting,
            "root_meeting": math.sqrt(meeting),
        }
        return Averages(*(np.array([known.get(name, math.nan)]) for name in Averages._fields))

    @property
    def starting_speed_ratio(self) -> Array:
        """It starts as the scene does."""
        return np.ones(1)


def expected_energy(scene: Scene) -> float:
    """The energy of the balls at the start; in a warm gas by theory, nan without one; J."""
    if not facts.hold(scene, "warm_walls"):
        return scene.kinetic_energy
    known = theories.values_of(scene, q.TEMPERATURE, theories.WALLS, theories.BALANCE)
    return scene.number * next(iter(known.values()), math.nan)


class ScaleOfPoint(NamedTuple):
    """A scale of a gas: its value and the name of its theory, or why there is none.

    absence : in words; empty if there is a value, or if gases of this type have no such scale
    """

    value: float
    model: str
    absence: str


def scales_of(scene: Scene) -> list[ScaleOfPoint]:
    """The scales of a gas, in the order of `SCALES`."""
    traits, gas = facts.traits_of(scene), Expected(scene, expected_energy(scene))
    holding = {(entry.quantity.name, entry.model): entry for entry in theories.holding(traits)}
    found = []
    for scale in SCALES:
        names = ((scale.quantity.name, model) for model in scale.models)
        entry = next((holding[name] for name in names if name in holding), None)
        if entry is None:
            found.append(ScaleOfPoint(math.nan, "", _absence(traits, scale.quantity)))
            continue
        value = scale.of(float(np.mean(entry.predicted(gas, 1))), scene)
        if math.isfinite(value):
            found.append(ScaleOfPoint(value, entry.model, ""))
        else:  # the temperature is not known, or nothing moves
            found.append(ScaleOfPoint(math.nan, "", _absence(traits, q.TEMPERATURE)))
    return found


def _absence(traits: facts.Traits, quantity: Quantity) -> str:
    """The words of the first need that fails, of the theories of this type of gas."""
    for entry in theories.every_theory():
        if entry.quantity == quantity:
            failing = [FACTS[name] for name in entry.needs if not FACTS[name].holds(traits)]
            if failing and not any(fact.of_type for fact in failing):
                return failing[0].words(traits)
    return ""


class TypicalScales:
    """The scales of the points of a run.

    scenes : one of each point
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self._points = [scales_of(scene) for scene in scenes]
        is_cold = all(facts.hold(scene, "cold") for scene in scenes)
        self._heading = "typical scale" + " at the start" * is_cold

    def _rows(self) -> Iterator[tuple[Scale, list[ScaleOfPoint]]]:
        for scale, row in zip(SCALES, zip(*self._points, strict=True), strict=True):
            yield scale, [*row]

    def as_json(self) -> list[dict[str, Any]]:
        """A record for each scale, with a value of each point, or null."""
        return [
            {
                "scale": scale.words,
                "symbol": scale.symbol,
                "unit": scale.unit,
                "values": [point.value if point.model else None for point in row],
                "models": [point.model or None for point in row],
                "absences": [point.absence or None for point in row],
            }
            for scale, row in self._rows()
            if any(point.model or point.absence for point in row)
        ]

    def texts(self) -> tuple[list[str], list[str]]:
        """The lines of a table; the sources of its theories, and why rows are missing."""
        cells, sources, lacking = list[list[str]](), dict[str, str](), dict[str, list[str]]()
        for scale, row in self._rows():
            for why in dict.fromkeys(point.absence for point in row if point.absence):
                lacking.setdefault(why, []).append(scale.words)
            known = [point for point in row if point.model]
            if not known:
                continue
            values = [point.value for point in known]
            texts = least_to_most(values)
            some = f" ({len(known)} of {len(row)} points)" if len(known) < len(row) else ""
            models = dict.fromkeys(point.model for point in known)
            cells.append([scale.title, texts + some, "; ".join(models)])
            for model in models:
                sources.setdefault(model, theories.source_of(scale.quantity, model))
        table = text_table([self._heading, ">value", "theory"], cells) if cells else []
        cited = "; ".join(f"{name}: {source}" for name, source in sources.items())
        notes = [f"Sources: {cited}."] if cells else []
        if CRITICAL in sources:
            notes.append(f"L/L_c: {theory.CRITICAL}.")
        for why, names in lacking.items():
            missing = "this scale is" if len(names) == 1 else "these scales are"
            notes.append(f"{why}, so {missing} missing: {listed(names)}.")
        return table, notes
