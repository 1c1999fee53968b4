"""The engine against its slow twin, event by event, as far as chaos lets two programs agree.

Both make rounding errors, and collisions make them grow. By how much is measured on the scene
itself: a clumsy twin displaces every ball at every event by SHIFT, many times the rounding. What
that makes of an event's time and impulse, times rounding over SHIFT, is the event's tolerance.
From the event on at which a clumsy twin has other balls collide, the scene does not say what must
happen, and the comparison ends.
"""

import json
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import (
    EPSILON,
    NEIGHBOURS,
    Ball,
    displaced,
    gas,
    mixed_scene,
    scene_of,
    twin_collisions,
)

from snooker_cli.containers import SHAPES, Circle, Container, PeriodicBox
from snooker_cli.engine import simulate
from snooker_cli.engine.simulation import Simulation
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, StopReason

DATA = Path(__file__).parents[1] / "data"
SHIFT = 2e-14
CLUMSY_TWINS = 3
ROUNDINGS = 16
"""An event rounds the quadratic's coefficients and root, a clock, a place and a velocity: eight
times half of epsilon, in the engine and in the twin, and twice that for unlucky signs."""

GRAZING = 1e-5
"""Angle to the wall, rad, below which the twin cannot follow: its quadratic has the square of a
chord, of which SHIFT, which may be 1e-7 of a radian long, must be a small part."""


@dataclass(frozen=True)
class Comparison:
    """How many events could be compared, and the largest tolerance among them, s and kg m/s."""

    events: int
    time: float
    impulse: float


def clumsiness(scene: Scene, seed: int) -> Callable[[list[naive.Body], float], None]:
    """Displaces bodies by some SHIFT of the container's radius and of the way on the clock."""
    dice = random.Random(seed)

    def displace(bodies: list[naive.Body], now: float) -> None:
        for body in bodies:
            way = max(scene.container.size) / 2 + math.hypot(body.u, body.v) * now
            body.x += dice.gauss(0, SHIFT) * way
            body.y += dice.gauss(0, SHIFT) * way

    return displace


def compared(
    scene: Scene,
    count: int,
    until: float = math.inf,
    search: type[Simulation] | None = None,
) -> Comparison:
    """Assert that the first ``count`` events, or as many as can be compared, are the twin's.

    until : s; no events after that are asked for
    """
    trace = simulate(scene, collisions=count, time=until, search=search)
    twin = twin_collisions(scene, count, until=until)
    comparable = min(len(trace.events), before_grazing(scene, trace.events))
    partners, time, impulse = columns(twin)
    spread = np.zeros((2, len(twin)))
    for seed in range(CLUMSY_TWINS):
        other_partners, *others = columns(
            twin_collisions(scene, count, clumsiness(scene, seed), until)
        )
        common = min(len(twin), len(other_partners))
        differs = np.any(partners[:common] != other_partners[:common], axis=1)
        comparable = min(comparable, int(np.argmax(differs)) if differs.any() else common)
        for row, other, own in zip(spread, others, (time, impulse), strict=True):
            row[:common] = np.maximum(row[:common], abs(other[:common] - own[:common]))
    here = slice(comparable)
    spread = np.maximum.accumulate(spread[:, here], axis=1)
    # The clumsy twins' errors are random; those of rounding may all err to one side.
    one_sided = np.sqrt(np.arange(1, comparable + 1))
    itself = np.vstack([time[here], impulse[here]])
    tolerance = ROUNDINGS * EPSILON * one_sided * (spread / SHIFT + itself)
    if trace.stop.reason is StopReason.NOTHING_LEFT or (
        trace.stop.reason is StopReason.TIME and comparable == min(len(twin), len(trace.events))
    ):
        assert len(twin) == len(trace.events)
    assert np.array_equal(partners[here], np.column_stack([trace.events.i, trace.events.j])[here])
    assert np.all(abs(trace.events.time[here] - time[here]) <= tolerance[0])
    assert np.all(abs(trace.events.impulse[here] - impulse[here]) <= tolerance[1])
    return Comparison(comparable, *tolerance.max(axis=1, initial=0.0))


def columns(events: list[naive.Event]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Who, when and how hard."""
    partners = np.array([(event.i, event.j) for event in events]).reshape(-1, 2)
    return partners, np.array([k.time for k in events]), np.array([k.impulse for k in events])


def before_grazing(scene: Scene, events: Events) -> int:
    """How many events there are before a ball grazes the wall."""
    speed = np.sqrt(2 * scene.kinetic_energy / scene.masses.min())
    grazes = events.at_wall & (events.impulse < GRAZING * scene.masses[events.i] * speed)
    return int(np.argmax(grazes)) if grazes.any() else len(events)


@pytest.mark.parametrize("same", [None, "radii", "masses"])
@pytest.mark.parametrize("container_mass", [20.0, math.inf])
def test_different_radii_and_masses_in_a_light_and_a_fixed_container(container_mass, same):
    scene = mixed_scene(container_mass, 0.9)
    if same is not None:
        scene = replace(scene, **{same: np.full(scene.number, 0.9)})
    assert compared(scene, 200).events == 200


# --- gases in cells -----------------------------------------------------------------------------

CONTAINERS = {
    "circle": {"shape": "circle"},
    "light circle": {"shape": "circle", "container_mass": 20.0},
    "box": {"shape": "box", "aspect": 1.3},
    "periodic": {"shape": "periodic", "aspect": 1.3},
}
RARE = pytest.mark.long
"""A type of scene that would be compiled for this alone."""


@pytest.mark.parametrize(
    ("packing", "number", "count", "out"), [(0.3, 24, 80, 1e-6), (0.002, 30, 15, math.inf)]
)
@pytest.mark.parametrize(
    ("container", "mixed", "cor"),
    [
        *(("circle", False, cor) for cor in (0.8, 1.0)),  # with 0.5 it is soon in a wall trap
        *(("light circle", True, cor) for cor in (0.5, 1.0)),
        *(("box", True, cor) for cor in (0.5, 1.0)),
        ("box", False, 0.9),
        *(("periodic", False, cor) for cor in (0.8, 1.0)),
        pytest.param("circle", True, 0.9, marks=RARE),
        pytest.param("light circle", False, 0.9, marks=RARE),
        pytest.param("periodic", True, 0.9, marks=RARE),
    ],
)
def test_a_gas_in_cells(container, mixed, cor, packing, number, count, out):
    """Packed; and so dilute that balls cross many cells between two events."""
    scene = gas(number=number, packing=packing, cor=cor, mixed=mixed, **CONTAINERS[container])
    result = compared(scene, count, search=NEIGHBOURS)
    assert result.events == count
    assert result.time < out


# --- collisions that become elastic -------------------------------------------------------------

SOFT = [{"elastic_below": 4.0}, {"contact_duration": 0.3}]
"""A part of the collisions, not all and not few, becomes elastic in a gas at 10 m/s."""


@pytest.mark.parametrize("rule", SOFT, ids=str)
@pytest.mark.parametrize("name", ["all pairs", "light circle", "box", "periodic"])
def test_slow_collisions_or_those_in_contact_are_elastic(name, rule):
    scene, count = mixed_scene(20.0 if name == "light circle" else math.inf, 0.6), 80
    if name in ("box", "periodic"):
        scene, count = gas(name, 24, 0.3, cor=0.6), 60
    soft = replace(scene, **rule)
    result = compared(soft, count, search=NEIGHBOURS if name != "all pairs" else None)
    assert result.events == count
    assert result.time < 1e-6
    with_it, without = (simulate(gas_scene, collisions=40).events for gas_scene in (soft, scene))
    assert not np.allclose(with_it.impulse, without.impulse)  # the rule has been applied


# --- random scenes ------------------------------------------------------------------------------

Type = tuple[str, bool]
"""A container, and whether all balls are equal."""

IN_CIRCLES = [(name, equal) for name in ("circle", "light circle") for equal in (True, False)]
IN_BOXES = [(name, equal) for name in ("box", "periodic") for equal in (True, False)]
COMPILED_FOR_CELLS = [("circle", True), ("light circle", False), *IN_BOXES[:3]]
"""Types that other tests compile too."""


@st.composite
def scenes(draw: st.DrawFn, types: list[Type], least: int = 1) -> Scene:
    """Up to 8 balls that do not touch. What is continuous is thrown, so that ties and grazing
    contacts, where rounding decides who collides, have no probability."""
    dice = random.Random(draw(st.integers(0, 2**32)))
    number = 8 - draw(st.integers(0, 8 - least))
    name, equal = draw(st.sampled_from(types))
    container, largest = Circle(6.0), 1.5
    if name in ("box", "periodic"):
        size = dice.uniform(6.0, 15.0), dice.uniform(6.0, 15.0)
        container = SHAPES[name](*size)
        largest = min(size) / 10.1
    radius, mass = dice.uniform(0.05, largest), 10 ** dice.uniform(-1, 1)
    balls: list[Ball] = []
    for _ in range(number):
        if not equal:
            radius, mass = dice.uniform(0.05, largest), 10 ** dice.uniform(-1, 1)
        darts = (
            np.array([dice.uniform(-side, side) / 2 for side in container.size]) for _ in range(200)
        )
        place = next((dart for dart in darts if fits(dart, radius, balls, container)), None)
        if place is not None:  # else the container is full
            speed = dice.choice([0.0, *[dice.uniform(0.1, 10.0)] * 4])
            turn = dice.uniform(0.0, 2 * math.pi)
            velocity = speed * math.cos(turn), speed * math.sin(turn)
            balls.append((*place.tolist(), *velocity, radius, mass))
    free = name == "light circle"
    scene = scene_of(
        balls,
        container=container,
        container_mass=10 ** dice.uniform(0, 7) if free else math.inf,
        container_velocity=(dice.uniform(-1, 1), dice.uniform(-1, 1)) if free else (0.0, 0.0),
        restitution=draw(st.floats(0.1, 1.0)),
        wall_restitution=draw(st.floats(0.1, 1.0)),
    )
    return displaced(scene, by=(dice.uniform(-5, 5), dice.uniform(-5, 5)), drift=(0.0, 0.0))


def fits(place: np.ndarray, radius: float, balls: list[Ball], container: Container) -> bool:
    """Whether a ball has its place to itself, by a thousandth of a metre."""
    if container.has_wall and container.wall_gaps(place[np.newaxis], np.array([radius]))[0] < 1e-3:
        return False
    table = np.array(balls).reshape(-1, 6)
    gaps = np.hypot(*container.nearest_image(table[:, :2] - place).T) - table[:, 4] - radius
    return bool(np.all(gaps > 1e-3))


def crossings(scene: Scene) -> float:
    """The time of 20 crossings: in a periodic box it may take for ever until balls meet."""
    fastest = float(np.max(np.hypot(*scene.velocities.T)))
    return 20 * min(scene.container.size) / fastest if fastest > 0 else 1.0


@given(scene=scenes(IN_CIRCLES))
@settings(derandomize=True, deadline=None, max_examples=90)
def test_random_scenes_with_all_pairs(scene):
    """What goes wrong in a scene of 20 is found here with 99 %."""
    compared(scene, 30)


@given(scene=scenes(COMPILED_FOR_CELLS, least=2))
@settings(derandomize=True, deadline=None, max_examples=110)
def test_random_scenes_in_cells(scene):
    compared(scene, 25, crossings(scene), search=NEIGHBOURS)


def test_a_pair_that_has_parted_meets_again_through_a_side():
    """Of a periodic box, without another collision of either ball in between."""
    saved = json.loads((DATA / "meets-again.json").read_text(encoding="utf-8"))
    box = PeriodicBox(saved.pop("width"), saved.pop("height"))
    scene = scene_of(saved.pop("balls"), container=box, **saved)
    assert compared(scene, 25, search=NEIGHBOURS).events == 25
    events = [event for event in twin_collisions(scene, 25) if {1, 6} & {event.i, event.j}]
    (first,) = (k for k, event in enumerate(events) if 4.5 < event.time < 4.6)
    assert all((event.i, event.j) == (1, 6) for event in events[first : first + 2])
    assert [event.time for event in events[first : first + 2]] == pytest.approx(
        [4.56, 5.51], abs=0.01
    )


# --- other ways to the same events --------------------------------------------------------------
