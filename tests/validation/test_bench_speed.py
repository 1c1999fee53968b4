"""The measurement of speed: its gases and arithmetic; how fast anything is, no test says."""

from __future__ import annotations

import ctypes
import gc
import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snooker_cli.engine import simulate, simulation
from snooker_cli.figures import Points
from snooker_cli.validation.speed_study import (
    BOTH,
    CASES,
    COLD,
    MASS,
    MOST,
    QUICK,
    SMALL_PLAN,
    Cooling,
    Effort,
    KernelTimer,
    SpeedCase,
    Timing,
    cooling,
    crossover,
    growth,
    measure,
    memory,
    pictures,
    recording,
    with_losses,
    without_rotation,
)

Snooker = Callable[..., Any]


def timing(case: SpeedCase, median: float, engine: str = "cells") -> Timing:
    return Timing(case, engine, median, 0.9 * median, 1.2 * median, 5, 1000)


# The gases


@pytest.mark.parametrize("case", [each for each in CASES if each.balls <= 1000])
def test_gases_are_as_they_say(case: SpeedCase) -> None:
    scene = case.scene()
    assert scene.number == case.balls
    assert scene.packing_fraction == pytest.approx(case.packing)
    assert scene.container_mass == (MASS if case.free else math.inf)
    assert (scene.restitution, scene.wall_restitution) == (1.0, 1.0)


def test_all_that_is_asked_for_is_among_them() -> None:
    for packing in (0.37, 0.0037):
        for free in (False, True):
            for cor in (1.0, 0.9):
                assert SpeedCase(37, packing, free, cor) in CASES
    assert {SpeedCase(1000, packing) for packing in (0.4, 0.7, 0.004)} < set(CASES)
    assert SpeedCase(100_000, 0.4) in CASES
    assert SpeedCase(1_000_000, 0.4) in MOST
    assert len(set(CASES)) == len(CASES)


def test_both_engines_are_timed_around_the_number_that_chooses() -> None:
    for packing, free in dict.fromkeys((case.packing, case.free) for case in BOTH):
        kind = (packing, free)
        numbers = [
            {case.balls for case in BOTH if (case.packing, case.free, case.engine) == (*kind, one)}
            for one in ("allpairs", "cells")
        ]
        assert numbers[0] == numbers[1]
        few = simulation.few_at(packing, free=free)
        assert min(numbers[0]) < few
        assert few < max(numbers[0]) or few == simulation.MOST


def test_losses_change_nothing_but_speeds_and_coefficients() -> None:
    scene = SpeedCase(1000, 0.4).scene()
    lossy = with_losses(scene, 0.9, 1.0, np.random.default_rng(1))
    assert (lossy.restitution, lossy.wall_restitution) == (0.9, 1.0)
    assert lossy.positions is scene.positions
    # Four standard errors of the mean square of 2,000 components.
    assert np.mean(lossy.velocities**2) == pytest.approx(50.0, rel=4 * math.sqrt(2 / 2000))


def test_a_gas_without_rotation_has_no_angular_momentum() -> None:
    scene = without_rotation(SpeedCase(100, 0.2).scene())
    (x, y), (u, v) = scene.positions.T, scene.velocities.T
    assert abs(np.sum(x * v - y * u)) < 1e-12 * np.sum(np.hypot(x, y) * np.hypot(u, v))


# The kernel


@pytest.mark.parametrize("case", [SpeedCase(37, 0.37, free=True), SpeedCase(100, 0.2)])
def test_the_kernel_goes_where_a_simulation_goes(case: SpeedCase) -> None:
    scene = case.scene()
    kernel = KernelTimer(scene)
    assert [kernel.advance(300)[0], kernel.advance(200)[0]] == [300, 200]
    finish = simulate(scene, collisions=500).finish
    places = kernel.places()
    assert np.array_equal(places.positions, finish.positions)
    assert np.array_equal(places.container_position, finish.container_position)
    assert kernel.energy == pytest.approx(finish.kinetic_energy / scene.kinetic_energy)


@pytest.mark.parametrize(
    ("case", "engine"),
    [
        (SpeedCase(37, 0.37), "allpairs"),
        (SpeedCase(37, 0.37, engine="cells"), "cells"),
        (SpeedCase(19, 0.0037, free=True, cor=0.9), "allpairs"),
        (SpeedCase(100, 0.4), "cells"),
    ],
)
def test_a_timing_tells_what_was_timed(case: SpeedCase, engine: str) -> None:
    found = measure(case, QUICK)
    assert (found.case, found.engine) == (case, engine)
    assert 0 < found.lowest <= found.median <= found.highest
    assert (found.repeats, found.events) == (QUICK.repeats, QUICK.events)
    assert found.as_json() == {
        "balls": case.balls,
        "packing": case.packing,
        "free": case.free,
        "cor": case.cor,
        "engine": engine,
        **{name: getattr(found, name) for name in ("median", "lowest", "highest")},
        "repeats": QUICK.repeats,
        "events": QUICK.events,
    }


def test_repeats_are_long_enough_for_balls_to_be_sorted_in_one() -> None:
    effort = Effort(events=200_000, repeats=5)
    assert [effort.events_of(balls) for balls in (37, 1000)] == [200_000, 200_000]
    assert 5 * effort.events_of(1_000_000) >= 1_000_000 * simulation.REORDER_AFTER


# What follows from timings


def test_the_crossover_compares_what_was_timed_with_both() -> None:
    one, other = SpeedCase(19, 0.4, engine="allpairs"), SpeedCase(19, 0.4, engine="cells")
    timings = [
        timing(one, 6e6, "allpairs"),
        timing(other, 3e6),
        timing(replace(one, balls=37), 5e6, "allpairs"),
        timing(SpeedCase(37, 0.4), 1e6),
    ]
    few = simulation.few_at(0.4, free=False)
    assert crossover(timings) == [
        {"packing": 0.4, "free": False, "balls": 19, "ratio": 2.0, "few": few}
    ]


def test_growth_is_told_against_a_thousand_balls() -> None:
    timings = [
        timing(SpeedCase(1_000_000, 0.4), 5e5),
        timing(SpeedCase(1000, 0.4), 2e6),
        timing(SpeedCase(1000, 0.7), 4e6),
        timing(SpeedCase(100_000, 0.4, cor=0.9), 1e5),
        timing(SpeedCase(37, 0.4), 4e6),
    ]
    assert growth(timings) == [{"balls": 1_000_000, "times": 4.0}]
    assert growth(timings[4:]) == []


# Recording, cooling, memory


def test_recording_compares_events_with_summaries() -> None:
    found = recording(SpeedCase(7, 0.2), 5000, repeats=2)
    assert -1 < found.spread[0] <= found.seconds <= found.spread[1]
    assert found.processor_seconds > -1
    # Without compression an event takes 32 bytes, and the smallest file without any 10 kB.
    assert 10 < found.bytes_an_event < 34


def test_a_gas_is_followed_until_it_is_cold() -> None:
    found = cooling(SMALL_PLAN.cooled, QUICK)
    assert found.repeats == QUICK.repeats
    assert found.ratio is not None
    assert found.lowest is not None
    assert found.highest is not None
    assert 0 < found.lowest <= found.ratio <= found.highest
    # A collision takes (1 - e^2) T in a gas that stays mixed, which has N T; in clusters less.
    assert found.collisions is not None
    assert found.collisions > 0.5 * -math.log(COLD) / (1 - SMALL_PLAN.cooled.cor**2)


def test_a_gas_that_does_not_cool_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("snooker_cli.validation.speed_study.LONGEST", 100)
    assert cooling(SpeedCase(37, 0.2), QUICK) == Cooling(37, 0.2, 1.0, 0, None, None, None, None)


def test_memory_is_told_where_the_system_tells_it() -> None:
    # What tests before have freed goes back to the system: it would be taken again, unseen.
    if sys.platform == "linux" and hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        gc.collect()
        library.malloc_trim(0)
    found = memory(SpeedCase(20_000, 0.4))
    if not Path("/proc/self/statm").exists():
        assert found is None
    else:
        assert found is not None
        assert found > 8 * 8  # at least the columns of the kernel's balls


# The command


def test_bench_speed_gives_tables_json_and_figures(tmp_path: Path, snooker: Snooker) -> None:
    ended = snooker("bench", "speed", "--quick", "--json", "--out", tmp_path / "speed")
    assert ended.code == 0, ended.err
    record = json.loads(ended.out)
    assert json.loads((tmp_path / "speed" / "speed.json").read_text()) == record
    assert {"processor", "platform", "processors", "load"} == set(record["machine"])
    assert {"python", "numpy", "numba", "h5py"} == set(record["versions"])
    assert len(record["cases"]) == len(SMALL_PLAN.cases)
    assert [one["balls"] for one in record["crossover"]] == [19, 37, 61]
    assert {"recording", "cooling", "memory", "growth"} < set(record)
    files = {path.name for path in (tmp_path / "speed").iterdir()}
    assert files == {
        "speed.txt",
        "speed.json",
        *(f"speed-number.{ending}" for ending in ("svg", "png", "json")),
    }
    tables = (tmp_path / "speed" / "speed.txt").read_text()
    assert "collisions/s" in tables
    few = simulation.few_at(0.4, free=False)
    assert "packing 0.4, fixed container: speed of all pairs over that of cells: " in tables
    assert f"balls; up to {few} all pairs are used" in tables


def record_of(timings: list[Timing]) -> dict[str, Any]:
    machine = {"processor": "a processor", "platform": "a system"}
    return {"machine": machine, "cases": [each.as_json() for each in timings]}


def test_pictures_show_the_plain_gases() -> None:
    numbers = [timing(SpeedCase(balls, 0.4), 1e9 / balls) for balls in (1000, 100, 10_000)]
    others = [timing(SpeedCase(10, 0.4, free=True), 1.0), timing(SpeedCase(10, 0.4, cor=0.9), 1.0)]
    ((name, picture),) = pictures(record_of([*numbers, *others]))
    assert name == "speed-number"
    (points,) = (layer for layer in picture.layers if isinstance(layer, Points))
    assert points.x.tolist() == [100, 1000, 10_000]
    assert points.y.tolist() == [10.0, 1.0, 0.1]
    assert points.y_error is not None
    assert points.y_error == pytest.approx(0.2 * points.y)
    assert points.label == "packing 0.4, cells"
    assert "At most 10 million, of 100 balls at packing 0.4" in picture.caption


def test_nothing_to_show_is_no_picture() -> None:
    assert pictures(record_of([timing(SpeedCase(1000, 0.4), 1e6)])) == []
