"""The measurement of speed: its gases and arithmetic. No test depends on a speed."""

from __future__ import annotations

import ctypes
import gc
import math
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snooker_cli.engine import kernel_state, simulate, simulation
from snooker_cli.figures import FigureData, Points
from snooker_cli.validation.speed_study import (
    BOTH,
    COLD,
    FULL_STUDY,
    MASS,
    QUICK_STUDY,
    KernelTimer,
    SpeedCase,
    SpeedStudy,
    crossover,
    growth,
    memory,
    recording,
    with_losses,
    without_rotation,
)


def timing(
    case: SpeedCase, median: float, engine: str = "cells", compared: bool = False
) -> dict[str, Any]:
    rates = {"median": median, "lowest": 0.9 * median, "highest": 1.2 * median}
    return asdict(case) | rates | {"engine": engine, "compared": compared}


# The gases


@pytest.mark.parametrize("case", [each for each in FULL_STUDY.cases if each.balls <= 1000])
def test_gases_have_their_numbers(case: SpeedCase) -> None:
    scene = case.scene()
    assert scene.number == case.balls
    assert scene.packing_fraction == pytest.approx(case.packing)
    assert scene.container_mass == (MASS if case.free else math.inf)
    assert (scene.restitution, scene.wall_restitution) == (1.0, 1.0)


def test_both_engines_are_timed_around_the_number_that_chooses() -> None:
    for packing, free in dict.fromkeys((case.packing, case.free) for case in BOTH):
        numbers = [
            {
                case.balls
                for case in BOTH
                if (case.packing, case.free, case.engine) == (packing, free, one)
            }
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
    velocities = kernel.engine.state.balls[[kernel_state.U, kernel_state.V]].T
    assert np.array_equal(velocities, finish.velocities)
    assert kernel.energy == finish.kinetic_energy / scene.kinetic_energy


@pytest.mark.parametrize(
    ("case", "engine"),
    [
        (SpeedCase(37, 0.37), "allpairs"),
        (SpeedCase(37, 0.37, engine="cells"), "cells"),
        (SpeedCase(19, 0.0037, free=True, cor=0.9), "allpairs"),
        (SpeedCase(100, 0.4), "cells"),
    ],
)
def test_a_timing_names_what_was_timed(case: SpeedCase, engine: str) -> None:
    found = QUICK_STUDY.timing(case)
    assert found["engine"] == engine
    assert found["compared"] == (case.engine is not None)
    assert all(found[key] == getattr(case, key) for key in ("balls", "packing", "free", "cor"))
    assert 0 < found["lowest"] <= found["median"] <= found["highest"]
    assert (found["repeats"], found["events"]) == (QUICK_STUDY.repeats, QUICK_STUDY.events)


def test_repeats_are_long_enough_for_balls_to_be_sorted_in_one() -> None:
    few, many = SpeedCase(1000, 0.4), SpeedCase(1_000_000, 0.4)
    assert FULL_STUDY.events_of(few) == 200_000
    assert 5 * FULL_STUDY.events_of(many) >= many.balls * simulation.REORDER_AFTER


# What follows from timings


def test_the_crossover_compares_what_was_timed_with_both() -> None:
    case = SpeedCase(19, 0.4)
    timings = [
        timing(case, 6e6, "allpairs", compared=True),
        timing(case, 3e6, compared=True),
        timing(replace(case, balls=37), 5e6, "allpairs", compared=True),
        timing(replace(case, balls=37), 1e6),
    ]
    few = simulation.few_at(0.4, free=False)
    assert crossover(timings) == [
        {"packing": 0.4, "free": False, "balls": 19, "ratio": 2.0, "few": few}
    ]


def test_growth_is_relative_to_a_thousand_balls() -> None:
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
    assert -1 < found["spread"][0] <= found["seconds"] <= found["spread"][1]
    assert found["processor_seconds"] > -1
    # Without compression an event takes 32 bytes, and the smallest file without any 10 kB.
    assert 10 < found["bytes_an_event"] < 34


def test_a_gas_is_followed_until_it_is_cold() -> None:
    found = QUICK_STUDY.cooling()
    assert found["repeats"] == QUICK_STUDY.repeats
    assert 0 < found["lowest"] <= found["ratio"] <= found["highest"]
    # A collision takes (1 - e^2) T in a gas that stays mixed, which has N T; in clusters less.
    assert found["collisions"] > 0.5 * -math.log(COLD) / (1 - QUICK_STUDY.cooled.cor**2)


def test_a_gas_that_does_not_cool_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("snooker_cli.validation.speed_study.LONGEST", 100)
    found = replace(QUICK_STUDY, cooled=SpeedCase(37, 0.2)).cooling()
    assert found["repeats"] == 0
    assert {found[key] for key in ("ratio", "lowest", "highest", "collisions")} == {None}


def test_memory_is_measured_where_the_system_counts_it() -> None:
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


# The record


def test_the_record_is_complete(bench: Any) -> None:
    _, record = bench("speed")
    assert len(record["cases"]) == len(QUICK_STUDY.cases)
    assert [one["balls"] for one in record["crossover"]] == [19, 37, 61]
    assert {"recording", "cooling", "memory", "growth"} < set(record)
    assert len(list(SpeedStudy.tables(record))) > len(record["cases"])


def figures_of(timings: list[dict[str, Any]]) -> dict[str, FigureData]:
    machine = {"processor": "a processor", "platform": "a system"}
    return SpeedStudy.figures({"machine": machine, "cases": timings})


def test_figures_show_the_elastic_gases_in_a_fixed_circle() -> None:
    numbers = [timing(SpeedCase(balls, 0.4), 1e9 / balls) for balls in (1000, 100, 10_000)]
    others = [timing(SpeedCase(10, 0.4, free=True), 1.0), timing(SpeedCase(10, 0.4, cor=0.9), 1.0)]
    ((name, figure),) = figures_of([*numbers, *others]).items()
    assert name == "speed-number"
    (points,) = (layer for layer in figure.layers if isinstance(layer, Points))
    assert points.x.tolist() == [100, 1000, 10_000]
    assert points.y.tolist() == [10.0, 1.0, 0.1]
    assert points.y_error is not None
    assert points.y_error == pytest.approx(0.2 * points.y)
    assert points.label == "packing 0.4, cells"
    assert figures_of([timing(SpeedCase(1000, 0.4), 1e6)]) == {}
