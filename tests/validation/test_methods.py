"""The other methods to simulate, and what separates their trajectories from the exact one."""

import numpy as np
import pytest
from scenes import EPSILON, scene_of

from snooker_cli.engine import replay, simulate
from snooker_cli.validation.exact_twin import trajectory
from snooker_cli.validation.methods import (
    TOLERANCE,
    all_methods,
    by_engine,
    by_source_report,
    deepest_overlap,
    first_different,
    rings,
)


@pytest.fixture(params=all_methods((1e-3, 1e-4)), ids=lambda method: method.name)
def method(request):
    return request.param


def test_methods_find_a_head_on_collision(method):
    """At 1 s, with (1 + e) mu g = 1.8 * 0.75 * 2; time stepping is up to a step late."""
    balls = [(-2.0, 0.0, 2.0, 0.0, 0.5, 1.0), (1.0, 0.0, 0.0, 0.0, 0.5, 3.0)]
    course = method.run(scene_of(balls, restitution=0.8), np.array([0.0, 0.5, 1.5]))
    late = course.events.time[0] - 1.0
    # Positions up to 2 m are rounded by half an epsilon of that in each of 1.5 s / step additions.
    rounding = 1.5 / method.step * EPSILON if method.step else 4 * EPSILON
    # A step that ends in the contact may miss it, by the rounding of positions at 2 m/s.
    assert -rounding <= late <= (method.step or 0.0) + rounding
    assert (course.events.i[0], course.events.j[0]) == (0, 1)
    assert course.events.impulse.tolist() == [pytest.approx(2.7, rel=4 * EPSILON)]
    assert course.positions[0].tolist() == [[-2.0, 0.0], [1.0, 0.0]]
    assert course.positions[1, 0] == pytest.approx([-1.0, 0.0], abs=rounding)
    assert course.finish.velocities[:, 0] == pytest.approx([-0.7, 0.9], rel=4 * EPSILON)
    # The change of velocity during the delay.
    assert course.positions[2, 0, 0] == pytest.approx(-0.35 + 2.7 * late, abs=4 * rounding)
    assert course.overlap <= 2.0 * late + 4 * rounding


def test_the_source_reports_tolerance_drops_a_collision():
    """Two collisions of its own scene are 0.55 us apart: it loses the later one."""
    scene = rings()
    truth, _ = trajectory(scene, 260)
    time = truth.time
    dropped = int(np.argmax(np.diff(time) < TOLERANCE)) + 1
    assert dropped < 200
    before = by_source_report(scene, time[: dropped - 1])
    after = by_source_report(scene, time[: dropped + 50])
    assert first_different(after.events, truth) == dropped
    assert before.overlap < 1e-13
    assert after.overlap > 0.1  # of balls of 1 m
    engine = by_engine(scene, time[: dropped + 50])
    assert first_different(engine.events, truth) >= dropped + 49
    assert engine.overlap < 1e-13


def test_the_deepest_overlap_is_searched_during_the_free_flight() -> None:
    """Balls of 1 m, 3 m apart, approach at 1 m/s for 1.5 s: they end 0.5 m inside each other."""
    scene = scene_of([(0, 0, 1, 0, 1, 1), (3, 0, 0, 0, 1, 1)])
    states = replay(simulate(scene, time=0.1), np.array([0.0]))
    assert deepest_overlap(scene, states, np.array([0.5])) == 0
    assert deepest_overlap(scene, states, np.array([1.5])) == pytest.approx(0.5)
