"""The page's facts and theories are those of the program, on every type of gas."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import pytest
from gas_kinds import KINDS, scene_of
from live_scripts import LiveScripts
from scenes import gas

from snooker_cli import facts, theory
from snooker_cli.analysis import observables
from snooker_cli.live_page.javascript import camel
from snooker_cli.live_page.page import stored_start
from snooker_cli.live_page.page_theories import (
    TYPE_FACTS,
    drawn,
    theories_source,
)
from snooker_cli.scene import Scene

SCENES = {
    **{kind: scene_of(kind) for kind in KINDS},
    **{
        f"{shape} {packing} {cor}": gas(shape, number, packing, cor=cor, wall_cor=wall_cor)
        for number, packing in ((2, 1e-4), (37, 0.01), (200, 0.4))
        for shape in ("circle", "box", "periodic")
        for cor, wall_cor in ((0.5, 0.7), (0.8, 1.0))
    },
    "light": gas("circle", 20, 0.2, cor=0.9, container_mass=50.0),
}
"""Scenes that pages and the program compare with theory."""

ASKED = """(() => {
  const start = storedScene(scene), traits = traitsOf(start), balls = equalBallsOf(start);
  const gas = gasOf(balls, temperature), speeds = [0, 0.3, 1, 2.5];
  const given = {
    speeds: (value) => speeds.map((v) => value(balls, v)),
    energy: (value) => value(traits),
  };
  const valueOf = (quantity, theory) => {
    if (!applies(theory, traits)) return null;
    return (given[quantity] ?? ((value) => value(gas)))(theory.value);
  };
  const values = (quantity) => Object.entries(THEORIES[quantity])
    .map(([name, theory]) => [name, theory.model ?? "", valueOf(quantity, theory)]);
  const holds = Object.entries(FACTS).map(([name, holds]) => [name, holds(traits)]);
  return [traits, Object.fromEntries(holds),
    Object.fromEntries(Object.keys(THEORIES).map((quantity) => [quantity, values(quantity)]))];
})()"""


def asked_traits() -> set[str]:
    """The traits that the page's facts ask for, in the spelling of JavaScript."""
    source = theories_source()
    names = map(camel, facts.Traits._fields)
    return {name for name in names if re.search(rf"\.{name}\b", source)}


@pytest.mark.parametrize("name", SCENES)
def test_a_page_knows_what_the_program_knows_of_a_gas(name: str, javascript: LiveScripts) -> None:
    """Values to 10⁻¹², a thousand roundings of 10⁻¹⁶."""
    scene = SCENES[name]
    heat = 0.7 * scene.kinetic_energy / scene.number
    traits, holds, values = javascript.value(ASKED, scene=stored_start(scene), temperature=heat)
    known = facts.traits_of(scene)
    expected = {camel(trait): value for trait, value in known._asdict().items()}
    assert traits.keys() == asked_traits()
    for trait, value in traits.items():
        is_number = isinstance(value, float | int)
        assert value == (close(expected[trait]) if is_number else expected[trait]), trait
    assert holds == {fact: facts.FACTS[fact].holds(known) for fact in TYPE_FACTS}
    for quantity, models in drawn().items():
        there = [
            (short, entry.model, _value(quantity, entry.value, scene, heat))
            if facts.hold(known, *entry.needs)
            else (short, entry.model, None)
            for short, entry in models.items()
        ]
        assert values[quantity] == [
            [short, model, value if value is None else close(value)]
            for short, model, value in there
        ]


def close(value: Any) -> Any:
    """Equal but for rounding."""
    return pytest.approx(value, rel=1e-12, abs=1e-14)


def _value(quantity: str, value: Any, scene: Scene, temperature: float) -> Any:
    """The program's value of a theory."""
    if quantity == "energy":
        return value(facts.traits_of(scene))
    if quantity == "speeds":
        return [value(scene, speed) for speed in (0.0, 0.3, 1.0, 2.5)]
    energy = scene.number * temperature
    met = observables.meeting_temperature(energy, scene)
    means = SimpleNamespace(
        scene=scene,
        ideal_pressure=energy / scene.container.area,
        meeting_ratio=met / temperature,
        starting_speed_ratio=1.0,
    )
    return value(means)


def test_the_law_that_a_page_fits(javascript: LiveScripts) -> None:
    times = [0.0, 0.5, 30.0]
    found = javascript.value("times.map((t) => FORMULAS.haffRatio(t, 0.7))", times=times)
    assert found == [close(theory.haff_ratio(time, 0.7)) for time in times]


def test_the_logarithm_of_the_gamma_function(javascript: LiveScripts) -> None:
    """To a few roundings, up to twice the most balls of a page."""
    given = [0.5, 1, 1.5, 2, 3.5, 11.5, 12, 37.5, 2000.5, 4000]
    found = javascript.value("given.map(lgamma)", given=given)
    assert found == [pytest.approx(math.lgamma(x), rel=1e-14, abs=3e-14) for x in given]


def loops(gas: facts.Traits) -> bool:
    while gas.rough:
        return False
    return True


def lists(gas: facts.Traits) -> bool:
    return not [gas.rough]


def jumps(gas: facts.Traits) -> bool:
    return hasattr(gas, name="rough")


def is_large(gas: facts.Traits) -> bool:
    return gas.number in (1, 2)


@pytest.mark.parametrize("function", [loops, lists, jumps, is_large])
def test_what_javascript_does_not_have_is_refused(
    function: facts.Holds, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(facts.FACTS, "smooth", facts.FACTS["smooth"]._replace(holds=function))
    with pytest.raises(ValueError, match="pages have it in JavaScript too"):
        theories_source()
