"""The measurement of speed: its gases and arithmetic. No test depends on a speed."""

from __future__ import annotations

import ctypes
import gc
import itertools
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snooker_cli.engine import simulation
from snooker_cli.validation.speed_study import (
    BOTH_ENGINES,
    FULL_STUDY,
    MASS,
    QUICK_STUDY,
    SpeedCase,
    SpeedStudy,
    memory,
)


@pytest.mark.parametrize("case", [each for each in FULL_STUDY.cases if each.balls <= 1000])
def test_gases_have_their_numbers(case: SpeedCase) -> None:
    scene = case.scene()
    assert scene.number == case.balls
    assert scene.packing_fraction == pytest.approx(case.packing)
    assert scene.container_mass == (MASS if case.free else math.inf)
    assert (scene.restitution, scene.wall_restitution) == (1.0, 1.0)


def test_both_engines_are_timed_around_the_number_that_chooses() -> None:
    for packing, free in itertools.product((0.4, 0.004), (False, True)):
        pairs, cells = (
            {one.balls for one in BOTH_ENGINES if one == SpeedCase(one.balls, packing, free, name)}
            for name in ("allpairs", "cells")
        )
        few = simulation.few_at(packing, free=free)
        assert pairs == cells
        assert min(pairs) < few
        assert few < max(pairs) or few == simulation.MOST


def test_rates_are_of_the_time_between_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chunk has 16,384 collisions here; by this clock, each but the first takes 0.16384 s."""
    clock = iter(9.0 + 0.16384 * np.arange(10))
    monkeypatch.setattr("snooker_cli.validation.speed_study.time.process_time", lambda: next(clock))
    study = replace(QUICK_STUDY, events=16_384)
    found = study.timing(SpeedCase(37, 0.37, engine="cells"))
    assert found["engine"] == "cells"
    for key in ("median", "lowest", "highest"):
        assert found[key] == pytest.approx(1e5)


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


def test_the_record_is_complete(bench: Any) -> None:
    _, record = bench("speed")
    assert [one["balls"] for one in record["cases"]] == [one.balls for one in QUICK_STUDY.cases]
    for one in record["cases"]:
        assert 0 < one["lowest"] <= one["median"] <= one["highest"]
    stored = record["recording"]
    assert -1 < stored["lowest"] <= stored["median"] <= stored["highest"]
    # Without compression an event takes 32 bytes, and the smallest file without any 10 kB.
    assert 10 < stored["bytes_an_event"] < 34
    assert len(list(SpeedStudy.tables(record))) > len(record["cases"])
