"""A trajectory depends on the scene alone: which search finds the events decides no bit.

Everyone, cells of any size, and balls in any order in memory, sorted again or not, give the same
events, endings and final states.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scenes import EVERYONE, NEIGHBOURS, gas, lone_bouncer, report_scene, scene_of, sort_often
from test_bits import SIDES, heated

from snooker_cli.containers import Circle
from snooker_cli.engine import CheckpointError, simulate
from snooker_cli.engine.simulation import AmongEveryone, AmongNeighbours, Simulation
from snooker_cli.laws import Constant, Driven, Thermal, Viscoelastic
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, StopReason, Trace

MOST = 40_000  # events
FACTORS = 0.0, 1.7, 4.0  # of the usual width of cells; they are at least a ball wide


def wide(factor: float) -> type[AmongNeighbours]:
    """The search among neighbours, in cells of another width."""
    return type(f"Wide{factor}", (AmongNeighbours,), {"cell_factor": factor})


def assert_same(expected: Trace, trace: Trace) -> None:
    """Assert that two traces have the same bits, but for the words of their messages."""
    assert trace.stop._replace(message="") == expected.stop._replace(message="")
    for column in ("time", "i", "j", "impulse"):
        first, second = (getattr(one.events, column) for one in (expected, trace))
        assert np.array_equal(first, second), column
    for field in ("positions", "velocities", "container_position", "container_velocity"):
        assert np.array_equal(getattr(trace.finish, field), getattr(expected.finish, field)), field


def assert_one_trajectory(
    scene: Scene,
    factors: tuple[float, ...] = FACTORS,
    collisions: int = MOST,
    time: float | None = None,
) -> Trace:
    """Assert that all searches give the same; what the first one gives.

    Only circles have a search among everyone, so that no other kernel is compiled for this alone.
    """
    searches = [wide(factor) for factor in factors]
    if isinstance(scene.container, Circle):
        searches.insert(0, AmongEveryone)
    limits = {"collisions": collisions, "time": time}
    expected, *others = (simulate(scene, search=search, **limits) for search in searches)
    for other in others:
        assert_same(expected, other)
    return expected


circle, periodic = partial(gas, "circle"), partial(gas, "periodic", aspect=1.3)

GASES: dict[str, Callable[[], Scene]] = {
    "dilute": partial(circle, 60, 0.003),
    "inelastic": partial(report_scene, cor=0.95, wall_cor=1.0),
    "free, mixture": partial(circle, 60, 0.3, mixed=True, cor=0.99, container_mass=20.0),
    "periodic": partial(periodic, 60, 0.3, cor=0.99),
    "periodic, two balls": partial(periodic, 2, 0.02),
    "wall trap": partial(report_scene, radius=0.1, cor=0.8),
    "wall trap, free": partial(report_scene, radius=0.1, cor=0.8, container_mass=50.0),
    "collapse": partial(periodic, 60, 0.3, cor=0.1),
    "sides": lambda: heated(gas("box", 60, 0.3, cor=0.9, aspect=1.5), SIDES),
    "channel, driven": lambda: heated(
        gas("channel", 60, 0.3, cor=0.9, aspect=0.7), Driven(0.9, 2.0)
    ),
}


@pytest.mark.parametrize("name", GASES)
def test_the_search_decides_no_bit(name: str) -> None:
    """More than one epoch of each, unless it ends before."""
    assert_one_trajectory(GASES[name]())


BALL = (1.0, 1.0)  # radius and mass
ENDINGS = {
    "at rest": scene_of([(0.0, 0.0, 0.0, 0.0, *BALL), (4.0, 1.0, 0.0, 0.0, *BALL)]),
    "stopped": scene_of(
        [(-3.0, 0.0, 1.0, 0.0, *BALL), (3.0, 0.0, -1.0, 0.0, *BALL)], restitution=0.0
    ),
    "three in a line": scene_of(
        [(x, 0.0, u, 0.0, *BALL) for x, u in ((-3.0, 1.0), (0.1, 0.0), (3.0, -1.0))],
        restitution=0.03,
    ),
    "lone ball in a trap": lone_bouncer((0.0, 0.0, 0.0, 0.0, *BALL)),
}
"""Scenes of a few balls in a circle, which end before their last collision."""


@pytest.mark.parametrize("container_mass", [math.inf, 5.0])
@pytest.mark.parametrize("name", ENDINGS)
def test_few_balls_end_alike(name: str, container_mass: float) -> None:
    scene = replace(ENDINGS[name], container_mass=container_mass)
    trace = assert_one_trajectory(scene, (0.0,), 1000, None)
    assert trace.stop.reason is not StopReason.COLLISIONS


@pytest.mark.parametrize("name", ["wall trap", "free, mixture", "periodic"])
def test_the_order_in_memory_decides_no_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Balls are put into the order of their cells after every chunk of 100 events."""
    expected = simulate(GASES[name](), collisions=4000, search=AmongNeighbours)
    sort_often(monkeypatch, 100)
    assert_same(expected, simulate(GASES[name](), collisions=4000, search=AmongNeighbours))


def test_arrays_of_another_repeat_are_refused() -> None:
    """Of another shape or type, or missing."""
    scene = GASES["free, mixture"]()
    arrays = simulate(scene, collisions=20_000, summary=True, watch=lambda *_: True).checkpoint
    assert arrays is not None
    for name, values in arrays.items():
        others = {key: array for key, array in arrays.items() if key != name}
        wrong = {name: values[..., np.newaxis]}, {name: values.astype(np.float32)}, {}
        for forged in wrong:
            with pytest.raises(CheckpointError):
                simulate(scene, collisions=20_000, summary=True, checkpoint=others | forged)


def random_scene(seed: int) -> tuple[Scene, float]:
    """A scene of any shape, size, packing, laws, masses and rules; and a time to end at, s."""
    dice = random.Random(seed)
    shape = dice.choice(["circle", "circle", "box", "channel", "periodic"])
    # Cells need boxes of five diameters or more: these have more balls.
    number = round(2 ** dice.uniform(*((1, 6.5) if shape == "circle" else (4, 6.5))))
    walls, cor = shape != "periodic", dice.choice([1.0, dice.uniform(0.05, 1.0)])
    free = shape == "circle" and dice.random() < 0.5
    scene = gas(
        shape,
        number,
        math.exp(dice.uniform(math.log(1e-3), math.log(0.5 if shape == "circle" else 0.3))),
        mixed=shape in ("circle", "box") and dice.random() < 0.4,
        cor=cor,
        wall_cor=dice.choice([1.0, cor, dice.uniform(0.05, 1.0)]),
        container_mass=10 ** dice.uniform(0, 7) if free else math.inf,
        aspect=1.0 if shape == "circle" else dice.uniform(0.8, 1.25),
        seed=seed,
    )
    if dice.random() < 0.2:
        scene = replace(scene, pair_law=Viscoelastic(cor, 5.0))
    if walls and not free and dice.random() < 0.3:
        law = dice.choice([Driven(0.9, 2.0), Thermal(20.0), Viscoelastic(0.8, 5.0)])
        scene = heated(scene, SIDES if shape == "box" and dice.random() < 0.5 else law)
    rule = dice.random()
    if rule < 0.1:
        scene = replace(scene, contact_duration=0.05)
    elif rule < 0.2:
        scene = replace(scene, elastic_below=0.1)
    return scene, dice.choice([math.inf, 3.0])


@pytest.mark.parametrize("group", range(5))
def test_random_scenes(group: int) -> None:
    for seed in range(30 * group, 30 * group + 30):
        scene, time = random_scene(seed)
        # Balls that drift together would cross cells for ever.
        idle = scene.container.period is not None
        limit = None if math.isinf(time) and not idle else min(time, 300.0)
        assert_one_trajectory(scene, (0.0, random.Random(seed).uniform(1, 4)), 2000, limit)


def test_balls_that_meet_at_the_same_time() -> None:
    """A lattice whose balls all move alike, and mirror images: ties of many kinds."""
    for rows, seed in ((4, 0), (6, 1)):
        scene = gas("box", rows * rows, 0.2)
        dice = np.random.default_rng(seed)
        columns = np.arange(rows * rows) % rows
        velocities = np.column_stack([np.zeros(rows * rows), np.full(rows * rows, 3.0)])
        velocities[:, 0] = dice.choice([-2.0, 2.0], rows)[columns]
        assert_one_trajectory(replace(scene, velocities=velocities), collisions=3000)
    ring = np.arange(8) * math.pi / 4
    places = 5.0 * np.column_stack([np.cos(ring), np.sin(ring)])
    balls = replace(
        gas("circle", 8, 0.08),
        positions=places,
        velocities=-places,
        container=Circle(10.0),
        wall_law=Constant(1.0),
    )
    assert_one_trajectory(balls, collisions=2000)


@pytest.mark.parametrize("search", [EVERYONE, NEIGHBOURS])
def test_of_events_at_one_time_the_hit_of_the_wall_is_first(search: type[Simulation]) -> None:
    """Ball 2 is at the wall after 8 s exactly, and so do balls 0 and 1 meet."""
    balls = [(-2, -4, 0, 0, 1, 1), (0.5, -4, -0.0625, 0, 1, 1), (0, 0, 1, 0, 1, 1)]
    events = simulate(scene_of(balls, container=Circle(9.0)), collisions=2, search=search).events
    assert events is not None
    assert events.time.tolist() == [8, 8]
    assert list(zip(events.i.tolist(), events.j.tolist(), strict=True)) == [(2, CONTAINER), (0, 1)]
