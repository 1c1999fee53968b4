"""The engine of the page has the program's bits: events, endings, final states, hashes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import test_bits
from javascript import JavaScript, answer_of, scene_of
from scenes import gas, report_scene

from snooker_cli.config import parse
from snooker_cli.engine import replay, simulate
from snooker_cli.engine.kernel_state import NO_PARTNER
from snooker_cli.laws import Surface
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.trace import SLIDE


@pytest.fixture(scope="module")
def engine() -> Iterator[JavaScript]:
    with JavaScript() as engine:
        yield engine


def is_simulated(case: test_bits.Case) -> bool:
    """Whether the page has this case: no summary, at most 200 balls."""
    return not case.summary and case.scene().number <= 200


SURFACE = Surface(0.4, 0.5, 0.3, 0.2, 0.8)
SMOOTH_WALL = Surface(0.5, 0.5, math.inf, -1.0, math.inf)


def rough(scene: Scene, surface: Surface = SURFACE) -> Scene:
    """The scene with rough balls, each with another spin."""
    return replace(scene, surface=surface, spins=np.linspace(-3.0, 5.0, scene.number))


ROUGH = {
    "fixed": lambda: rough(gas("circle", 60, 0.3, cor=0.9)),
    "free, mixture": lambda: rough(test_bits.light()),
    "sliding": lambda: rough(test_bits.sliding(), SMOOTH_WALL),
    "wall trap": lambda: rough(test_bits.trapped()),
    "sides": lambda: rough(test_bits.CASES["box, sides"].scene()),
    "channel": lambda: rough(gas("channel", 60, 0.3, cor=0.9, aspect=1.5)),
    "periodic": lambda: rough(test_bits.periodic()),
}


@pytest.mark.parametrize("name", ROUGH)
def test_rough_balls_have_the_same_collisions(engine, name):
    scene = ROUGH[name]()
    answer = engine.answer(f"simulated({scene_of(scene)}, {{ collisions: 2000 }})")
    assert answer == answer_of(simulate(scene, collisions=2000))


def test_balls_that_are_too_slow_end_alike(engine):
    text = "container: {shape: periodic, packing: 0.02}\ncor: 0\ncollisions: 500\nseed: 2\n"
    text += "balls: {count: 2, radius: 1, speed: 10, start: random}\n"
    scene = starting_scene(parse(text).config, 0)
    expected = answer_of(simulate(scene, collisions=500))
    assert expected["stop"]["reason"] == "rest"
    answer = engine.answer(f"simulated({scene_of(scene)}, {{ collisions: 500 }})")
    answer["stop"]["time"] = float(answer["stop"]["time"])  # a large one has no point in JavaScript
    assert answer == expected


def test_cold_balls_have_the_same_frame(engine):
    """They share a rounding, which a frame takes over; energies are those of the laboratory."""
    text = "container: {shape: periodic, width: 20}\ncor: 0.9\ncollisions: 60000\nseed: 1\n"
    scene = starting_scene(parse(text + "balls: {count: 10, radius: 1, speed: 10}\n").config, 0)
    answer = engine.answer(f"simulated({scene_of(scene)}, {{ collisions: 12000 }})")
    assert answer == answer_of(simulate(scene, collisions=12_000))
    cold = engine.answer(f"simulated({scene_of(scene)}, {{ collisions: 60000 }})")
    last = cold["stop"]["message"]
    assert "that all share" in last
    times = re.compile(r"at \S+ s")  # a large one has no point in JavaScript
    expected = simulate(scene, collisions=60_000).stop.message
    assert times.sub("", last) == times.sub("", expected)


@pytest.mark.parametrize("name", ROUGH)
def test_energies_and_angles_follow_from_the_events(engine, name):
    """After each event; and spins of the program, integrated from one event to the next.

    While a ball bounces until it slides, the page's sum leaves out what it loses.
    """
    scene = ROUGH[name]()
    trace = simulate(scene, collisions=500)
    events = trace.events
    last = np.append(np.diff(events.time) > 0, True)  # of those at one instant
    energies, angles = engine.answer(f"""
(() => {{
  const simulation = new Simulation({scene_of(scene)}, {{}}), energies = [];
  while (simulation.collisions < {len(events)}) {{
    simulation.advance({len(events)} - simulation.collisions);
    for (let row = 0; row < simulation.eventCount; row += 1) {{
      const begin = row * FOLLOWED.FOLLOWED_SUMS, sums = simulation.eventSums;
      energies.push([sums[begin + FOLLOWED.ENERGY], sums[begin + FOLLOWED.SPIN_ENERGY]]);
    }}
  }}
  const {{ spins, time }} = simulation;
  return JSON.stringify([
    [...energies, [simulation.kineticEnergy(), simulation.spinEnergy()]],
    Array.from(spins, (_, ball) => simulation.angleOf(ball, time + 1)),
  ]);
}})()""")
    states = replay(trace, events.time)
    moving = np.sum(scene.masses * np.sum(states.velocities**2, axis=2), axis=1) / 2
    moments = scene.surface.inertia * scene.masses * scene.radii**2
    expected = np.column_stack([moving, np.sum(moments * states.spins**2, axis=1) / 2])
    near = 1e-5 if scene.slides else 1e-12
    assert np.array(energies[:-1])[last] == pytest.approx(expected[last], rel=near)
    assert energies[-1] == pytest.approx(energies[-2], rel=1e-12)
    lasts = np.diff(np.concatenate([[0.0], events.time, events.time[-1:] + 1.0]))
    turned = lasts @ np.vstack([scene.spins, states.spins])
    assert angles == pytest.approx(turned, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long) if case.long else name
        for name, case in test_bits.CASES.items()
        if is_simulated(case)
    ],
)
def test_a_golden_scene_has_the_same_collisions(engine, name):
    scene, collisions = test_bits.CASES[name].scene(), test_bits.CASES[name].collisions
    answer = engine.answer(f"simulated({scene_of(scene)}, {{ collisions: {collisions} }})")
    answer["stop"]["time"] = float(answer["stop"]["time"])  # a large one has no point in JavaScript
    assert answer == answer_of(simulate(scene, collisions=collisions))


def test_sums_are_those_of_the_events(engine):
    """The impulse on the wall, the virial, energy and momentum, seen from events and states."""
    scene = gas("circle", 60, 0.3, mixed=True, container_mass=20.0)
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


def test_a_ball_that_slides_after_a_trap_keeps_its_spin_and_angle(engine):
    scene = scene_of(rough(test_bits.trapped(), SMOOTH_WALL))
    reason, before, after, turned = engine.answer(f"""
(() => {{
  const simulation = new Simulation({scene}, {{}}), {{ number }} = simulation;
  const spinsAndAngles = (time) => Array.from({{ length: number }}, (_, ball) =>
    [simulation.spins[ball], simulation.angleOf(ball, time)]);
  for (let call = 0; call < 1000 && !simulation.stop; call += 1) simulation.advance(100);
  const {{ reason }} = simulation.stop, {{ time }} = simulation, before = spinsAndAngles(time);
  simulation.continueWith({{ slides: true }});
  const after = spinsAndAngles(time);
  simulation.advance(100);
  return JSON.stringify([reason, before, after, spinsAndAngles(simulation.time)]);
}})()""")
    assert reason == "wall_trap"
    assert after == before
    assert turned != before


def test_laws_may_change_while_a_ball_settles(engine):
    """It bounces on, but now loses no energy and does not slide; a wall may become thermal, too."""
    scene = scene_of(replace(report_scene(1, radius=0.1, cor=0.8), slides=True))
    settling, kinds, before, after, energy = engine.answer(f"""
(() => {{
  const simulation = new Simulation({scene}, {{}}), elastic = {{ name: "constant", cor: 1 }};
  const settling = () => simulation.motions.indexOf(BigInt(SETTLES));
  for (let event = 0; event < 100000 && settling() < 0; event += 1) simulation.advance(1);
  const ball = settling(), kinds = [];
  simulation.setLaws(elastic, elastic);
  const before = simulation.kineticEnergy();
  for (let event = 0; event < 100; event += 1) {{
    simulation.advance(1);
    if (simulation.eventI(0) === ball) kinds.push(simulation.eventJ(0));
  }}
  const after = simulation.kineticEnergy();
  simulation.setLaws(elastic, {{ name: "thermal", temperature: 50 }});
  for (let call = 0; call < 30; call += 1) simulation.advance(100);
  return JSON.stringify([ball, kinds, before, after, simulation.kineticEnergy()]);
}})()""")
    assert settling >= 0
    assert NO_PARTNER in kinds
    assert SLIDE not in kinds
    assert after == pytest.approx(before, rel=1e-13)
    # 37 balls of 50 J, with a standard error of a sixth.
    assert energy == pytest.approx(37 * 50.0, rel=0.7)


@pytest.mark.parametrize("digits", [4, 17])
def test_sentences_have_numbers_as_python_writes_them(engine, digits):
    values = [0.0, 1.0, 0.1, 123456789.5, 12345678.25, 12345678.75, 1e-5, 1.5e-7, 1e16, 1e22, 0.5]
    values += [2.0**k for k in range(-60, 60, 7)] + [2.0**k / 3 for k in range(-60, 60, 7)]
    text = engine.answer(f"JSON.stringify({values}.map((value) => general(value, {digits})))")
    assert text == [f"{value:.{digits}g}" for value in values]
