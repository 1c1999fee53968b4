"""The engine of the page has the program's bits: events, endings, final states, hashes."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import test_bits
from javascript import JavaScript, answer_of, scene_of

from snooker_cli.config import load, to_json, validated
from snooker_cli.engine import simulate
from snooker_cli.engine.kernel_state import NO_PARTNER
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.trace import SLIDE

COLLISIONS = 1000

RINGS = {"rings": 3, "radius": 1.0, "speed": 10.0}
SIXTY = {"count": 60, "radius": 1.0, "speed": 10.0}
MIXTURE = [
    {"count": 20, "radius": 1.0, "speed": 5.0, "mass": 3.0, "speeds": "maxwell"},
    {"count": 40, "radius": 0.4, "speed": 10.0, "start": "random"},
]
CIRCLE = {"radius": 10.0}
PERIODIC, CHANNEL = (
    {"shape": shape, "width": 30.0, "height": 20.0} for shape in ("periodic", "channel")
)


def packed(shape: str, packing: float) -> dict[str, Any]:
    return {"shape": shape, "packing": packing}


def gas(container: dict[str, Any], balls: Any, cor: float, **more: Any) -> dict[str, Any]:
    return {"container": container, "balls": balls, "cor": cor, "collisions": COLLISIONS, **more}


GASES: dict[str, dict[str, Any]] = {
    "rings": gas(CIRCLE, RINGS, 1.0) | {"collisions": None, "time": 20.0},
    "free mixture": gas(packed("circle", 0.3) | {"mass": 20.0}, MIXTURE, 1.0),
    "slide": gas(CIRCLE, RINGS | {"radius": 0.1}, 0.8, collapse="slide"),
    "driven, no rotation": gas(
        packed("circle", 0.3), SIXTY | {"common_rotation": False}, 0.9, wall_speed=2.0
    ),
    "thermal": gas(packed("circle", 0.3), SIXTY, 0.9, wall_temperature=20.0, cor_speed=5.0),
    "box of a mixture": gas(packed("box", 0.4), MIXTURE, 1.0),
    "dense box": gas(packed("box", 0.7), SIXTY | {"count": 200, "start": "random"}, 1.0),
    "two temperatures": gas(CHANNEL, SIXTY, 0.9, wall_temperature={"left": 20.0, "right": 80.0}),
    "periodic": gas(PERIODIC, SIXTY, 0.95, collapse={"tc": 0.1}),
}
"""Configs of each kind of start: what the page writes of it, the program reads."""


@pytest.fixture(scope="module")
def engine() -> Iterator[JavaScript]:
    with JavaScript() as engine:
        yield engine


def check(engine: JavaScript, scene: Scene, call: str, limits: Any) -> None:
    """The page answers what the program does with a scene."""
    trace = simulate(scene, **limits)
    answer = engine.answer(f"simulated({call}, {json.dumps(limits)})")
    answer["stop"]["time"] = float(answer["stop"]["time"])  # a large one has no point in JavaScript
    assert answer == answer_of(trace)


@pytest.mark.parametrize("name", GASES)
def test_a_config_has_the_same_collisions(engine, name):
    """The program has those of the page from the config that the page writes of its start."""
    experiment = validated(GASES[name])
    limits = {"collisions": experiment.collisions, "time": experiment.time}
    start = f"startingScene({to_json(experiment)}, 1)"
    written = engine.answer(f"JSON.stringify(configOfStart({to_json(experiment)}, {start}))")
    check(engine, starting_scene(load(written).experiment, 0), start, limits)


def is_simulated(case: test_bits.Case) -> bool:
    """Whether the page has this case: no summary, at most 200 balls."""
    return not case.summary and case.scene().number <= 200


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long) if case.long else name
        for name, case in test_bits.CASES.items()
        if is_simulated(case)
    ],
)
def test_a_golden_scene_has_the_same_collisions(engine, name):
    case = test_bits.CASES[name]
    scene = case.scene()
    check(engine, scene, scene_of(scene), {"collisions": case.collisions})


def test_sums_are_those_of_the_events(engine):
    """The impulse on the wall, the virial, energy and momentum, seen from events and states."""
    experiment = validated(GASES["free mixture"] | {"collisions": 5000})
    scene = starting_scene(experiment, 0)
    trace = simulate(scene, collisions=5000)
    events, finish = trace.events, trace.finish
    answer = engine.answer(f"""
(() => {{
  const simulation = new Simulation({scene_of(scene)}, {{}});
  while (simulation.collisions < 5000) simulation.advance(5000 - simulation.collisions);
  return JSON.stringify([
    simulation.wallImpulse, simulation.pairVirial, simulation.kineticEnergy(),
    ...simulation.momentum(), simulation.angularMomentum(),
  ]);
}})()""")
    pairs = ~events.at_wall
    distances = scene.radii[events.i[pairs]] + scene.radii[events.j[pairs]]
    momentum = finish.masses @ finish.velocities + 20.0 * finish.container_velocity
    moments = finish.masses * np.linalg.det(np.stack([finish.positions, finish.velocities], 2))
    of_wall = np.linalg.det(np.stack([finish.container_position, finish.container_velocity]))
    expected = [
        math.fsum(events.impulse[events.at_wall]),
        math.fsum(events.impulse[pairs] * distances),
        finish.kinetic_energy,
        *momentum,
        np.sum(moments) + 20.0 * of_wall,
    ]
    assert answer == pytest.approx(expected, rel=1e-12, abs=1e-9)


def test_other_laws_hold_from_now_on(engine):
    """A slider makes an elastic gas lose energy."""
    scene = f"startingScene({to_json(validated(GASES['rings']))}, 0)"
    before, after = engine.answer(f"""
(() => {{
  const simulation = new Simulation({scene}, {{}}), energies = [];
  for (let call = 0; call < 10; call += 1) simulation.advance(100);
  energies.push(simulation.kineticEnergy());
  simulation.setLaws({{ word: "constant", cor: 0.9 }}, {{ word: "driven", cor: 1, speed: 0 }});
  for (let call = 0; call < 10; call += 1) simulation.advance(100);
  energies.push(simulation.kineticEnergy());
  return JSON.stringify(energies);
}})()""")
    assert before == pytest.approx(1850.0, rel=1e-12)
    # Two thirds or more of the 1,000 hits lose (1 - e^2)/2 of the mean energy of a ball and more.
    assert after < before * math.exp(-(1 - 0.9**2) * 600 / 37 / 2)


def test_laws_may_change_while_a_ball_settles(engine):
    """It bounces on, but now loses no energy and does not slide; a wall may become thermal, too."""
    scene = scene_of(starting_scene(validated(GASES["slide"]), 1))
    settling, kinds, before, after, energy = engine.answer(f"""
(() => {{
  const simulation = new Simulation({scene}, {{}}), elastic = {{ word: "constant", cor: 1 }};
  const settling = () => simulation.motions.indexOf(BigInt(SETTLES));
  for (let event = 0; event < 100000 && settling() < 0; event += 1) simulation.advance(1);
  const ball = settling(), kinds = [];
  simulation.setLaws(elastic, elastic);
  const before = simulation.kineticEnergy();
  for (let event = 0; event < 100; event += 1) {{
    simulation.advance(1);
    if (simulation.eventI[0] === ball) kinds.push(simulation.eventJ[0]);
  }}
  const after = simulation.kineticEnergy();
  simulation.setLaws(elastic, {{ word: "thermal", temperature: 50 }});
  for (let call = 0; call < 30; call += 1) simulation.advance(100);
  return JSON.stringify([ball, kinds, before, after, simulation.kineticEnergy()]);
}})()""")
    assert settling >= 0
    assert NO_PARTNER in kinds
    assert SLIDE not in kinds
    assert after == pytest.approx(before, rel=1e-13)
    # 37 balls of 50 J, with a standard error of a sixth.
    assert energy == pytest.approx(37 * 50.0, rel=0.7)


@pytest.mark.parametrize("digits", [4, 6, 9, 17])
def test_sentences_have_numbers_as_python_writes_them(engine, digits):
    values = [0.0, 1.0, 0.1, 123456789.5, 12345678.25, 12345678.75, 1e-5, 1.5e-7, 1e16, 1e22, 0.5]
    values += [2.0**k for k in range(-60, 60, 7)] + [2.0**k / 3 for k in range(-60, 60, 7)]
    text = engine.answer(f"JSON.stringify({values}.map((value) => general(value, {digits})))")
    assert text == [f"{value:.{digits}g}" for value in values]
