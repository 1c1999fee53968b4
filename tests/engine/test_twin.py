"""The engine against its slow twin, event by event, as far as chaos lets two programs agree.

Both make rounding errors, and collisions make them grow. By how much is measured on the scene
itself: a clumsy twin displaces every ball at every event by SHIFT, many times the rounding. What
that makes of an event's time and impulse, times rounding over SHIFT, is the event's tolerance.
From the event on at which a clumsy twin has other balls collide, the scene does not say what must
happen, and the comparison ends.
"""

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import EPSILON, Ball, is_wall, mixed_scene, report_scene, scene_of, twin_collisions

from snooker_cli.containers import Circle
from snooker_cli.engine import simulate
from snooker_cli.scene import Scene
from snooker_cli.trace import Events, StopReason

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
    whom, time, impulse = columns(twin)
    spread = np.zeros((2, len(twin)))
    for seed in range(CLUMSY_TWINS):
        other_whom, *others = columns(twin_collisions(scene, count, clumsiness(scene, seed), until))
        common = min(len(twin), len(other_whom))
        differs = np.any(whom[:common] != other_whom[:common], axis=1)
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
    assert np.array_equal(whom[here], np.column_stack([trace.events.i, trace.events.j])[here])
    assert np.all(abs(trace.events.time[here] - time[here]) <= tolerance[0])
    assert np.all(abs(trace.events.impulse[here] - impulse[here]) <= tolerance[1])
    return Comparison(comparable, *tolerance.max(axis=1, initial=0.0))


def columns(events: list[naive.Event]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Who, when and how hard."""
    whom = np.array([(event.i, event.j) for event in events]).reshape(-1, 2)
    return whom, np.array([k.time for k in events]), np.array([k.impulse for k in events])


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
def scenes(draw: st.DrawFn, least: int = 1, few_kinds: bool = False) -> Scene:
    """Up to 8 balls that do not touch. What is continuous is thrown, so that ties and grazing
    contacts, where rounding decides who collides, have no probability.

    few_kinds : alike in fixed circles, and in no others
    """
    dice = random.Random(draw(st.integers(0, 2**32)))
    number, free = 8 - draw(st.integers(0, 8 - least)), draw(st.booleans())
    alike = not free if few_kinds else draw(st.booleans())
    radius, mass = dice.uniform(0.05, 1.5), 10 ** dice.uniform(-1, 1)
    balls: list[Ball] = []
    for _ in range(number):
        if not alike:
            radius, mass = dice.uniform(0.05, 1.5), 10 ** dice.uniform(-1, 1)
        place = next((place for place in darts(dice) if fits(place, radius, balls)), None)
        if place is not None:  # else the container is full
            speed = dice.choice([0.0, *[dice.uniform(0.1, 10.0)] * 4])
            turn = dice.uniform(0.0, 2 * math.pi)
            velocity = speed * math.cos(turn), speed * math.sin(turn)
            balls.append((*place, *velocity, radius, mass))
    return scene_of(
        balls,
        container=Circle(6.0),
        container_mass=10 ** dice.uniform(0, 7) if free else math.inf,
        container_velocity=(dice.uniform(-1, 1), dice.uniform(-1, 1)) if free else (0.0, 0.0),
        restitution=draw(st.floats(0.1, 1.0)),
        wall_restitution=draw(st.floats(0.1, 1.0)),
    )


def darts(dice: random.Random) -> Iterable[tuple[float, float]]:
    return ((dice.uniform(-6.0, 6.0), dice.uniform(-6.0, 6.0)) for _ in range(200))


def fits(place: tuple[float, float], radius: float, balls: list[Ball]) -> bool:
    """Whether a ball has its place to itself, by a thousandth of a metre."""
    if math.hypot(*place) > 6.0 - radius - 1e-3:
        return False
    return all(math.dist(place, ball[:2]) > radius + ball[4] + 1e-3 for ball in balls)


@given(scene=scenes())
@settings(derandomize=True, deadline=None, max_examples=90)
def test_random_scenes(scene):
    """What goes wrong in a scene of 20 is found here with 99 %."""
    compared(scene, 30)


@pytest.mark.long
@given(scene=scenes())
@settings(derandomize=True, deadline=None, max_examples=400)
def test_many_random_scenes(scene):
    compared(scene, 30)
