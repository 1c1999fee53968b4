"""With rules that make some collisions elastic, a run goes on where it would stop.

These are slow collisions (``elastic_below``), or those of a ball that still has its last contact
(``contact_duration``, the TC model). Which ones is compared in ``test_twin``.
"""

import math
from dataclasses import replace

import pytest
from scenes import EPSILON, gas, lone_bouncer, report_scene, scene_of

from snooker_cli.engine import simulate
from snooker_cli.laws import Constant
from snooker_cli.trace import StopReason

RULES = [{"elastic_below": 1e-3}, {"contact_duration": 0.01}]


def test_mean_free_path():
    """Boltzmann's 1.501 m for the report's balls, and 15.708 m between hits of the wall."""
    between = 10**2 * math.pi / (2 * math.sqrt(2) * 37 * 2.0)
    expected = 1 / (1 / between + 2 / (math.pi * 10.0))
    assert report_scene().mean_free_path == pytest.approx(expected, rel=4 * EPSILON)
    assert between == pytest.approx(1.5010, abs=5e-5)
    alone = scene_of([(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)])
    assert alone.mean_free_path == pytest.approx(math.pi * 10.0 / 2, rel=4 * EPSILON)
    periodic = gas("periodic", 30, 0.1)
    density = 30 / periodic.container.area
    assert periodic.mean_free_path == pytest.approx(1 / (math.sqrt(8) * density * 2.0))


STOPPING = {
    "three balls": (
        lambda: scene_of([(-4, 0, 1, 0, 1, 1), (0, 0, 0, 0, 1, 1), (5, 0, -1, 0, 1, 1)]),
        {"pair_law": Constant(0.036)},
        StopReason.COLLAPSE,
    ),
    "cluster": (
        lambda: report_scene(wall_cor=1.0),
        {"pair_law": Constant(0.1)},
        StopReason.COLLAPSE,
    ),
    "wall trap": (lone_bouncer, {}, StopReason.WALL_TRAP),
}


@pytest.mark.parametrize("rule", RULES, ids=str)
@pytest.mark.parametrize("name", STOPPING)
def test_a_run_that_would_stop_goes_on(name, rule):
    make, changes, reason = STOPPING[name]
    scene = replace(make(), **changes)
    without = simulate(scene, collisions=20_000, time=20.0)
    assert without.stop.reason is reason
    trace = simulate(replace(scene, **rule), collisions=20_000, time=20.0)
    assert trace.stop.reason in (StopReason.TIME, StopReason.COLLISIONS)
    assert trace.stop.time > 2 * min(without.stop.time, 10.0)
    assert trace.finish.kinetic_energy < scene.kinetic_energy
