"""With rules that make some collisions elastic, a run goes on where it would stop.

These are slow collisions (``elastic_below``), or those of a ball that still has its last contact
(``contact_duration``, the TC model). Which ones is compared in ``test_twin``.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, digest, gas, lone_bouncer, report_scene, scene_of, trap_sums

from snooker_cli.engine import series, simulate
from snooker_cli.laws import Constant
from snooker_cli.trace import StopReason

RULES = [{"elastic_below": 1e-3}, {"contact_duration": 0.01}]
every_rule = pytest.mark.parametrize("rule", RULES, ids=str)


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


@every_rule
def test_an_elastic_gas_is_the_same(rule):
    with_it, without = (
        simulate(scene, collisions=1000).events
        for scene in (replace(report_scene(), **rule), report_scene())
    )
    assert digest(with_it) == digest(without)


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


@every_rule
@pytest.mark.parametrize(
    ("name", "engine"),
    [
        *itertools.product(["three balls", "cluster"], ["allpairs", "cells"]),
        ("wall trap", "allpairs"),
        pytest.param("wall trap", "cells", marks=pytest.mark.long),  # compiled for this alone
    ],
)
def test_a_run_that_would_stop_goes_on(name, rule, engine):
    make, changes, reason = STOPPING[name]
    scene = replace(make(), **changes)
    without = simulate(scene, collisions=20_000, time=20.0, engine=engine)
    assert without.stop.reason is reason
    trace = simulate(replace(scene, **rule), collisions=20_000, time=20.0, engine=engine)
    assert trace.stop.reason in (StopReason.TIME, StopReason.COLLISIONS)
    assert trace.stop.time > 2 * min(without.stop.time, 10.0)
    assert trace.finish.kinetic_energy < scene.kinetic_energy


def test_a_trapped_ball_ends_at_the_energy_of_its_slide():
    """1/2 m v_t^2, and what a normal speed below 1e-3 m/s adds; the wall's force is m v_t^2/a."""
    trace = simulate(replace(lone_bouncer(), elastic_below=1e-3), time=16.0)
    left = trace.finish.kinetic_energy - 0.5 * 8.0**2
    assert -1e-12 < left < 0.5e-6
    found = series(trace)
    late = found.time > 15.0
    force = np.polyfit(found.time[late], found.wall_impulse[late], 1)[0]
    assert force == pytest.approx(8.0**2 / 9.0, rel=1e-3)
    # Until it would slide the wall has taken nearly all that it takes of infinitely many hits.
    trap = trap_sums(6.0, 8.0, 0.9, 9.0)
    before = found.wall_impulse[np.searchsorted(found.time, 0.5 + trap.duration)]
    assert before == pytest.approx(6.0 / 0.9 * 1.9 + trap.impulse, abs=0.1)
