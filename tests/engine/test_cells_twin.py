"""The engine of cells against the slow twin and against all pairs, as far as chaos lets it."""

import json
import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import EPSILON, Ball, gas, scene_of, twin_collisions
from test_twin import CLUMSY_TWINS, ROUNDINGS, SHIFT, compared
from test_twin import scenes as circles

from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.engine import simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import Events

DATA = Path(__file__).parents[1] / "data"
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


@given(scene=circles(least=2, few_kinds=True))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_random_circles(scene):
    compared(scene, 30, engine="cells")


@st.composite
def boxes(draw: st.DrawFn, least: int = 1, few_kinds: bool = False) -> Scene:
    """Up to 8 balls that do not touch in a box, periodic or not, as ``test_twin.scenes``.

    few_kinds : alike in each periodic one
    """
    dice = random.Random(draw(st.integers(0, 2**32)))
    number = 8 - draw(st.integers(0, 8 - least))
    alike, periodic = draw(st.booleans()), draw(st.booleans())
    alike = alike or (few_kinds and periodic)
    width, height = dice.uniform(6.0, 15.0), dice.uniform(6.0, 15.0)
    largest = min(width, height) / 10.1
    radius, mass = dice.uniform(0.05, largest), 10 ** dice.uniform(-1, 1)
    balls: list[Ball] = []
    for _ in range(number):
        if not alike:
            radius, mass = dice.uniform(0.05, largest), 10 ** dice.uniform(-1, 1)
        room = 0.0 if periodic else radius + 1e-3
        x, y = width / 2 - room, height / 2 - room
        darts = ((dice.uniform(-x, x), dice.uniform(-y, y)) for _ in range(200))
        period = (width, height) if periodic else (math.inf, math.inf)
        place = next((each for each in darts if is_free(each, radius, balls, period)), None)
        if place is not None:
            speed = dice.choice([0.0, *[dice.uniform(0.1, 10.0)] * 4])
            turn = dice.uniform(0.0, 2 * math.pi)
            velocity = speed * math.cos(turn), speed * math.sin(turn)
            balls.append((*place, *velocity, radius, mass))
    return scene_of(
        balls,
        container=PeriodicBox(width, height) if periodic else Box(width, height),
        restitution=draw(st.floats(0.1, 1.0)),
        wall_restitution=draw(st.floats(0.1, 1.0)),
    )


def is_free(
    place: tuple[float, float], radius: float, balls: list[Ball], period: tuple[float, float]
) -> bool:
    """Whether a ball has its place to itself, by a thousandth of a metre."""
    for ball in balls:
        x, y = (
            math.remainder(its - own, side)
            for its, own, side in zip(ball[:2], place, period, strict=True)
        )
        if math.hypot(x, y) < radius + ball[4] + 1e-3:
            return False
    return True


@given(scene=boxes(least=2, few_kinds=True))
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
@given(scene=circles() | boxes())
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
