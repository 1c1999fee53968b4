"""Decay constants do not depend on what is recorded, nor does the report's own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from snooker_cli.analysis import decay
from snooker_cli.analysis.decay import Decay
from snooker_cli.analysis.observables import series
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import Events, Stop, StopReason, Trace

SCENE = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, mass: 1.0, speed: 10.0, ring_extent: 0.8}
cor: 0.95
collisions: 500
"""


def by_name(found: list[Decay]) -> dict[tuple[str, str], Decay]:
    return {(each.quantity, each.law): each for each in found}


@pytest.fixture(scope="module", params=["0.8", "0.95"])
def both_records(request: pytest.FixtureRequest) -> tuple[list[Trace], list[Trace]]:
    """Twenty repeats of the report's scene, every collision of them and a summary."""
    experiment = parse(SCENE, overrides=[f"cor={request.param}"]).experiment
    scenes = [starting_scene(experiment, repeat) for repeat in range(20)]
    return (
        [simulate(scene, collisions=500) for scene in scenes],
        [simulate(scene, collisions=500, summary=True) for scene in scenes],
    )


def test_summaries_and_events_give_the_same_constants(
    both_records: tuple[list[Trace], list[Trace]],
) -> None:
    """The difference of the two means over 20 repeats is a tenth of their standard error at most.

    In windows of time it is half of it: an edge of a window is anywhere between two of the some 400
    rows, and the hits between those, one in two windows or so, may be in either.
    """
    full, grid = (by_name(decay.decays(traces)) for traces in both_records)
    for (quantity, law), one in full.items():
        other = grid[quantity, law]
        assert one.over_repeats.count == other.over_repeats.count == 20
        allowed = 0.5 if quantity == "local_pressure" else 0.1
        difference = other.over_repeats.mean - one.over_repeats.mean
        assert abs(difference) <= allowed * one.over_repeats.standard_error, (quantity, law)
        if quantity in ("kinetic_energy", "temperature", "pressure"):
            assert all(each.points <= 501 for each in (*one.fits, *other.fits))
            assert [each.points for each in one.fits] == [each.points for each in other.fits]


# The report's constant


def test_the_reported_constant_is_the_reports_formula(
    both_records: tuple[list[Trace], list[Trace]],
) -> None:
    for trace, summary in zip(*both_records, strict=True):
        speed = series(trace).mean_speed[1:].mean()
        density = 37 / (math.pi * 10.0**2)
        path = 1 / (math.sqrt(2) * density * 2 * math.pi * 1.0)
        expected = -2 * math.log(trace.start.restitution) * speed / path
        assert decay.reported_constant(trace) == pytest.approx(expected, rel=1e-12)
        # The 400 rows of a grid have as many collisions between them: a fifth of a percent of 500.
        assert decay.reported_constant(summary) == pytest.approx(expected, rel=0.002)


def test_where_the_report_has_no_constant() -> None:
    trace = simulate(starting_scene(parse(SCENE).experiment, 0), collisions=100)
    scene = trace.start
    unequal = np.linspace(0.9, 1.0, scene.number)
    for start in (
        replace(scene, restitution=0.0),
        replace(scene, radii=unequal),
        replace(scene, masses=unequal),
    ):
        assert math.isnan(decay.reported_constant(replace(trace, start=start)))
    nobody = np.empty(0, dtype=np.int32)
    stop = Stop(StopReason.TIME, 0.01, (), "0.01 s reached")
    idle = replace(trace, stop=stop, events=Events(np.empty(0), nobody, nobody, np.empty(0)))
    assert math.isnan(decay.reported_constant(idle))
    elastic = replace(trace, start=replace(scene, restitution=1.0))
    assert decay.reported_constant(elastic) == 0
    assert math.copysign(1, decay.reported_constant(elastic)) == 1
