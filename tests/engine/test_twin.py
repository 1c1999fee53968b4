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
from scenes import EPSILON, Ball, gas, is_wall, mixed_scene, report_scene, scene_of, twin_collisions

from snooker_cli.containers import Box, Circle, Container, PeriodicBox
from snooker_cli.engine import simulate
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
    scene: Scene, count: int, until: float = math.inf, engine: str | None = None
) -> Comparison:
    """Assert that the first ``count`` events, or as many as can be compared, are the twin's.

    until : s; no events after that are asked for
    """
    trace = simulate(scene, collisions=count, time=until, engine=engine)
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
    grazes = is_wall(events) & (events.impulse < GRAZING * scene.masses[events.i] * speed)
    return int(np.argmax(grazes)) if grazes.any() else len(events)


@pytest.mark.parametrize("cor", [0.8, 0.9, 1.0])
@pytest.mark.parametrize("repeat", [0, pytest.param(1, marks=pytest.mark.long)])
def test_the_reports_scene_for_300_events(cor, repeat):
    result = compared(report_scene(repeat, cor=cor, container_mass=1e7), 300)
    assert result.events == 300
    assert result.time < 1e-4  # of 1 to 3 s


@pytest.mark.parametrize("cor", [0.8, 0.9, 1.0])
@pytest.mark.parametrize("repeat", range(3))
def test_the_dilute_scene_for_100_events(cor, repeat):
    result = compared(report_scene(repeat, radius=0.1, cor=cor, container_mass=1e7), 100)
    assert result.events == 100
    assert result.time < 1e-2  # of 3 to 6 s


@pytest.mark.parametrize("container_mass", [20.0, math.inf])
def test_different_radii_and_masses_in_a_light_and_a_fixed_container(container_mass):
    assert compared(mixed_scene(container_mass, 0.9), 200).events == 200


@st.composite
def scenes(draw: st.DrawFn, boxes: bool, least: int = 1, few_kernels: bool = False) -> Scene:
    """Up to 8 balls that do not touch. What is continuous is thrown, so that ties and grazing
    contacts, where rounding decides who collides, have no probability.

    boxes : in boxes, periodic or not, instead of circles
    few_kernels : equal balls in fixed circles and periodic boxes, and unequal ones in free circles
    """
    dice = random.Random(draw(st.integers(0, 2**32)))
    number = 8 - draw(st.integers(0, 8 - least))
    equal, special = draw(st.booleans()), draw(st.booleans())  # free, or periodic
    if few_kernels:
        equal = (equal or special) if boxes else not special
    container, largest = Circle(6.0), 1.5
    if boxes:
        size = dice.uniform(6.0, 15.0), dice.uniform(6.0, 15.0)
        container = PeriodicBox(*size) if special else Box(*size)
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
    free = special and not boxes
    return scene_of(
        balls,
        container=container,
        container_mass=10 ** dice.uniform(0, 7) if free else math.inf,
        container_velocity=(dice.uniform(-1, 1), dice.uniform(-1, 1)) if free else (0.0, 0.0),
        restitution=draw(st.floats(0.1, 1.0)),
        wall_restitution=draw(st.floats(0.1, 1.0)),
    )


def fits(place: np.ndarray, radius: float, balls: list[Ball], container: Container) -> bool:
    """Whether a ball has its place to itself, by a thousandth of a metre."""
    if container.has_wall and container.wall_gaps(place[np.newaxis], np.array([radius]))[0] < 1e-3:
        return False
    table = np.array(balls).reshape(-1, 6)
    gaps = np.hypot(*container.nearest_image(table[:, :2] - place).T) - table[:, 4] - radius
    return bool(np.all(gaps > 1e-3))


@given(scene=scenes(boxes=False))
@settings(derandomize=True, deadline=None, max_examples=90)
def test_random_scenes(scene):
    """What goes wrong in a scene of 20 is found here with 99 %."""
    compared(scene, 30)


@pytest.mark.long
@given(scene=scenes(boxes=False))
@settings(derandomize=True, deadline=None, max_examples=400)
def test_many_random_scenes(scene):
    compared(scene, 30)


# --- cells ------------------------------------------------------------------------------------

CONTAINERS = {
    "circle": {"shape": "circle"},
    "light circle": {"shape": "circle", "container_mass": 20.0},
    "box": {"shape": "box", "aspect": 1.3},
    "periodic": {"shape": "periodic", "aspect": 1.3},
}
RARE = pytest.mark.long
"""Of a kind that would be compiled for this alone."""

MIXED = {"circle": False, "light circle": True, "box": True, "periodic": False}
"""Whether balls differ, where one kind is compiled anyway; in a box, both are."""

every_gas = pytest.mark.parametrize(
    ("container", "cor", "mixed"),
    [
        pytest.param(name, cor, mixed, marks=[RARE] if rare and name != "box" else [])
        for name in CONTAINERS
        for cor, mixed, rare in (
            # A gas of balls all alike is in a wall trap after 50 events with 0.5.
            (0.5 if MIXED[name] else 0.8, MIXED[name], False),
            (0.9, not MIXED[name], True),
            (1.0, MIXED[name], False),
        )
    ],
)


@every_gas
def test_a_packed_gas_for_80_events(container, cor, mixed):
    """Of all ways at which a run could be another, the clumsy twins see 1e-6 s of 1 s at most."""
    scene = gas(number=24, packing=0.3, cor=cor, mixed=mixed, **CONTAINERS[container])
    result = compared(scene, 80, engine="cells")
    assert result.events == 80
    assert result.time < 1e-6


@every_gas
def test_a_dilute_gas_for_15_events(container, cor, mixed):
    """Balls cross many cells between two events."""
    scene = gas(number=30, packing=0.002, cor=cor, mixed=mixed, **CONTAINERS[container])
    result = compared(scene, 15, engine="cells")
    assert result.events == 15


@given(scene=scenes(boxes=False, least=2, few_kernels=True))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_random_circles_in_cells(scene):
    compared(scene, 30, engine="cells")


@given(scene=scenes(boxes=True, least=2, few_kernels=True))
@settings(derandomize=True, deadline=None, max_examples=50)
def test_random_boxes(scene):
    compared(scene, 25, crossings(scene), engine="cells")


def crossings(scene: Scene) -> float:
    """The time of 20 crossings: in a periodic box it may take for ever until balls meet."""
    fastest = float(np.max(np.hypot(*scene.velocities.T)))
    return 20 * min(scene.container.size) / fastest if fastest > 0 else 1.0


def meets_again(scene: Scene) -> bool:
    """Whether a pair that has parted next meets itself, which is through a periodic box's sides."""
    if scene.container.has_wall:
        return False
    last: dict[int, int] = {}
    for _, i, j, _ in twin_collisions(scene, 25, until=crossings(scene)):
        if last.get(i) == j and last.get(j) == i:
            return True
        last[i], last[j] = j, i
    return False


def test_a_pair_that_has_parted_meets_again_through_a_side():
    """Balls 1 and 6, at 4.56 s and at 5.51 s."""
    saved = json.loads((DATA / "meets-again.json").read_text(encoding="utf-8"))
    scene = scene_of(
        saved.pop("balls"),
        container=PeriodicBox(saved.pop("width"), saved.pop("height")),
        **saved,
    )
    assert meets_again(scene)
    assert compared(scene, 25, engine="cells").events == 25


@pytest.mark.long
@given(scene=scenes(boxes=False) | scenes(boxes=True))
@settings(derandomize=True, deadline=None, max_examples=200)
def test_random_scenes_of_every_kind(scene):
    """Of one ball too, and of balls that are alike or not in every container."""
    compared(scene, 25, crossings(scene), engine="cells")


# --- all pairs --------------------------------------------------------------------------------


def shifted(scene: Scene, seed: int) -> Scene:
    """Every ball displaced by some ``SHIFT`` of half the container's width."""
    dice = np.random.default_rng(seed)
    shifts = SHIFT * scene.container.size[0] / 2 * dice.normal(size=scene.positions.shape)
    return replace(scene, positions=scene.positions + shifts)


def agreement(scene: Scene, count: int, events: Events, engine: str) -> int:
    """Assert that events are an engine's, until displaced starts make it give others; how many.

    What a start's displacement grows to is, with an event's roundings in its place, the tolerance,
    as in ``test_twin``.
    """
    expected = simulate(scene, collisions=count, engine=engine).events
    others = [
        simulate(shifted(scene, seed), collisions=count, engine=engine).events
        for seed in range(CLUMSY_TWINS)
    ]
    comparable = min(first_difference(expected, other) for other in others)
    here = slice(comparable)
    assert first_difference(expected, events) >= comparable
    one_sided = np.sqrt(np.arange(1, comparable + 1))
    for column in ("time", "impulse"):
        own = getattr(expected, column)[here]
        spread = np.max([abs(getattr(other, column)[here] - own) for other in others], axis=0)
        grown = np.maximum.accumulate(spread) / SHIFT
        tolerance = ROUNDINGS * EPSILON * one_sided * (grown + own)
        assert np.all(abs(getattr(events, column)[here] - own) <= tolerance)
    return comparable


def first_difference(a: Events, b: Events) -> int:
    """The first event that is not of the same balls; how many there are if all are."""
    differs = (a.i != b.i) | (a.j != b.j)
    return int(np.argmax(differs)) if differs.any() else len(a)


@pytest.mark.parametrize(
    ("changes", "least"),
    [
        ({"packing": 0.4}, 1000),
        pytest.param({"packing": 0.4, "container_mass": 100.0}, 1000, marks=RARE),
        pytest.param({"packing": 0.3, "mixed": True, "cor": 0.9}, 1000, marks=RARE),
        ({"packing": 0.3, "mixed": True, "container_mass": 30.0, "cor": 0.9}, 1000),
        ({"packing": 0.01, "cor": 0.8, "wall_cor": 1.0}, 300),
    ],
)
def test_all_pairs_agree_with_cells(changes, least):
    """300 balls; how many events can be compared was found and says that the test is worth it."""
    scene = gas("circle", 300, **changes)
    events = simulate(scene, collisions=3000, engine="cells").events
    assert agreement(scene, 3000, events, "allpairs") >= least
