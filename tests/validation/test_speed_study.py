"""The measurement of speed: its gases and arithmetic. No test depends on a speed."""

from __future__ import annotations

import copy
import ctypes
import gc
import itertools
import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from snooker_cli import store
from snooker_cli.containers import Circle
from snooker_cli.engine import simulation
from snooker_cli.errors import StoreError, UserError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import Run
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import processors
from snooker_cli.scene import Scene
from snooker_cli.validation import speed_study
from snooker_cli.validation.speed_study import (
    BOTH_ENGINES,
    FULL_STUDY,
    MASS,
    QUICK_STUDY,
    SpeedCase,
    SpeedStudy,
    compared,
    earlier_record,
    memory,
    short_repeats,
)

TINY_STUDY = replace(
    QUICK_STUDY,
    cases=(SpeedCase(7, 0.1),),
    resident=SpeedCase(7, 0.1),
    recorded=20,
    events=20,
    short=2,
    rounds=1,
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


def test_short_repeats_are_a_run_with_the_default_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Run, list[RepeatResult]]] = []
    execute = speed_study.execute

    def spy(run: Run, *, workers: int, **others: Any) -> list[RepeatResult]:
        assert workers == processors()
        results = execute(run, workers=workers, **others)
        stored = [store.read_headers(path) for path in run.files()]
        assert sum(map(len, stored)) == len(results) == run.experiment.repeats
        seen.append((run, results))
        return results

    monkeypatch.setattr(speed_study, "execute", spy)
    found = short_repeats("summary", 3, 2)
    assert [len(results) for _, results in seen] == [2, 3, 3]
    for run, results in seen:
        scene = starting_scene(run.experiment, 0)
        assert (scene.container, scene.container_mass) == (Circle(10.0), math.inf)
        assert scene.number == found["balls"] == 37
        assert set(scene.radii) == {0.1}
        assert scene.restitution == 0.9
        assert run.experiment.record == found["record"] == "summary"
        assert all(0 < each.collisions <= found["collisions"] == 500 for each in results)
        assert not run.directory.exists()
    assert (found["repeats"], found["rounds"], found["threads"]) == (3, 2, processors())
    assert found["files"] == 1


def test_the_kernel_simulates_the_same_batches_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """By these clocks a run takes 2 s and 8 s of processors, and each batch again takes 1 s."""
    walls, processor_times = iter((0.0, 2.0)), iter((0.0, 8.0, 10.0, 11.0, 20.0, 21.0))
    clocks = SimpleNamespace(
        perf_counter=lambda: next(walls), process_time=lambda: next(processor_times)
    )
    batches: list[list[Scene]] = []
    limits: list[Any] = []

    def simulate_batch(scenes: list[Scene], **given: Any) -> None:
        batches.append(scenes)
        limits.append((given["collisions"], given["summary"]))

    monkeypatch.setattr(speed_study, "time", clocks)
    monkeypatch.setattr(speed_study, "batch_size", lambda *_: 2)
    monkeypatch.setattr(speed_study, "simulate_batch", simulate_batch)
    assert speed_study._short_run("events", 3) == (1.5, 0.25)
    assert [len(batch) for batch in batches] == [2, 1]
    assert limits == 2 * [(500, False)]
    directions = [scene.velocities.tobytes() for batch in batches for scene in batch]
    assert len(set(directions)) == 3


def test_short_repeats_that_cannot_be_stored_end_the_measurement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(path: Path, *_: object) -> None:
        raise StoreError(path, "no space left", "make room")

    monkeypatch.setattr(store, "write", fails)
    with pytest.raises(UserError, match=r"no space left.*TMPDIR"):
        short_repeats("events", 2, 1)


def test_the_first_rows_are_short_repeats_under_the_name_of_the_processor(bench: Any) -> None:
    _, record = bench("speed")
    lines = list(SpeedStudy.tables(record))
    assert lines[0].startswith(f"{record['machine']['processor']}, ")
    assert "repeats/s" in lines[4]
    for line, kept in zip(lines[5:7], ("events", "summary"), strict=True):
        assert line.split()[:4] == ["37", "≤", "500", kept]


def test_linux_names_the_processor(bench: Any) -> None:
    found = Path("/proc/cpuinfo")
    names = found.read_text(encoding="utf-8").splitlines() if found.exists() else []
    models = {line.partition(": ")[2] for line in names if line.startswith("model name")}
    processor = bench("speed")[1]["machine"]["processor"]
    assert processor
    assert not models or processor in models


def test_rates_of_two_records_stand_beside_each_other() -> None:
    def row(packing: float, median: float) -> dict[str, Any]:
        return {"balls": 37, "packing": packing, "free": False, "engine": "cells", "median": median}

    short = {"repeats": 9, "balls": 37, "collisions": 500, "record": "events"}
    header = {"machine": {"processor": "as it was"}, "date": "then"}
    then = header | {
        "short_repeats": [short | {"median": 200.0}],
        "cases": [row(0.1, 4e6), row(0.2, 1e6)],
    }
    now = {"short_repeats": [short | {"median": 500.0}], "cases": [row(0.3, 3e6), row(0.1, 2e6)]}
    found = compared(then, now)
    assert found["then"] == header
    assert [(one["then"], one["now"], one["ratio"]) for one in found["rates"]] == [
        (200.0, 500.0, 2.5),
        (None, 3e6, None),
        (4e6, 2e6, 0.5),
        (1e6, None, None),
    ]
    assert len({one["rate"] for one in found["rates"]}) == 4


def test_rates_of_the_full_study_have_different_names() -> None:
    cases = [
        vars(each) | {"engine": each.engine or "auto", "median": 1} for each in FULL_STUDY.cases
    ]
    record = {"short_repeats": [], "cases": cases}
    assert len(speed_study._rates(record)) == len(cases)


def test_the_command_compares_with_an_earlier_record(
    bench: Any, snooker: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also with a record that has a comparison itself."""
    monkeypatch.setattr(speed_study, "QUICK_STUDY", TINY_STUDY)
    earlier = bench("speed")[0] / "speed.json"
    out = tmp_path / "out"
    ended = snooker("bench", "speed", "--quick", "--compare", earlier, "--out", out)
    assert ended.code == 0
    lines = ended.out.splitlines()
    (heading,) = (number for number, line in enumerate(lines) if "now/then" in line)
    assert "then:" in lines[:heading]
    rates = len(bench("speed")[1]["cases"]) + 2 + 3  # no row is in both
    assert len(lines[heading + 1 :]) == rates
    again = snooker("bench", "speed", "--quick", "--json", "--compare", out / "speed.json")
    found = json.loads(again.out)["comparison"]
    assert len(found["rates"]) == 3
    for one in found["rates"]:
        assert one["ratio"] == one["now"] / one["then"]
    assert found["then"]["machine"] == bench("speed")[1]["machine"]


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"machine": {}}, "no 'processor'"),
        ({"cases": [{"balls": 1}]}, "no 'packing'"),
        ({"cases": 3}, "'int' object is not iterable"),
        ({"date": 2026}, "'int' object is not subscriptable"),
        ({"versions": []}, "unsupported operand"),
        ({"short_repeats": {"a": "b"}}, "string indices"),
        ({"measurement": "error"}, "it has a measurement of `snooker bench error`"),
        ({"measurement": None}, "it has a measurement of `snooker bench None`"),
    ],
)
def test_a_wrong_record_is_not_compared(
    bench: Any, tmp_path: Path, changed: dict[str, Any], sentence: str
) -> None:
    path = tmp_path / "speed.json"
    path.write_text(json.dumps(bench("speed")[1] | changed), encoding="utf-8")
    with pytest.raises(UserError, match=rf"speed.json: .*\({sentence}.*\); give a speed.json that"):
        earlier_record(path)


@pytest.mark.parametrize("rate", [0, -1.0, math.nan, math.inf, None, "fast", 10**400])
def test_a_record_whose_rates_are_no_rates_is_not_compared(
    bench: Any, tmp_path: Path, rate: object
) -> None:
    record = copy.deepcopy(bench("speed")[1])
    record["short_repeats"][0]["median"] = rate
    path = tmp_path / "speed.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(UserError, match=r"cannot be compared \("):
        earlier_record(path)


def test_json_that_is_no_record_is_not_compared(tmp_path: Path) -> None:
    path = tmp_path / "speed.json"
    path.write_text('["speed"]', encoding="utf-8")
    with pytest.raises(UserError, match=r"cannot be compared \("):
        earlier_record(path)


@pytest.mark.parametrize("content", [b"\xff", b"", b'{"cases": [\n', b"[" * 100_000])
def test_a_file_that_is_not_json_is_not_compared(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "speed.json"
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"cannot be compared \("):
        earlier_record(path)


def test_the_record_is_complete(bench: Any) -> None:
    _, record = bench("speed")
    assert [one["record"] for one in record["short_repeats"]] == ["events", "summary"]
    for one in record["short_repeats"]:
        assert 0 < one["lowest"] <= one["median"] <= one["highest"]
        assert one["kernel_share"] > 0
    assert [one["balls"] for one in record["cases"]] == [one.balls for one in QUICK_STUDY.cases]
    for one in record["cases"]:
        assert 0 < one["lowest"] <= one["median"] <= one["highest"]
    stored = record["recording"]
    assert -1 < stored["lowest"] <= stored["median"] <= stored["highest"]
    # Without compression an event takes 32 bytes, and the smallest file without any 10 kB.
    assert 10 < stored["bytes_an_event"] < 34
    assert len(list(SpeedStudy.tables(record))) > len(record["cases"])
