"""The measurement of speed: its gases and arithmetic. No test depends on a speed."""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from snooker_cli import store
from snooker_cli.containers import Circle
from snooker_cli.errors import StoreError, UserError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.runs import Run
from snooker_cli.runs.batch import RepeatResult
from snooker_cli.runs.execution import processors
from snooker_cli.scene import Scene
from snooker_cli.validation import speed_study
from snooker_cli.validation.speed_study import (
    MASS,
    SpeedCase,
    SpeedStudy,
    earlier_record,
    short_repeats,
)

FULL_STUDY, QUICK_STUDY = (SpeedStudy.planned(name) for name in ("full", "quick"))
TINY_STUDY = replace(
    QUICK_STUDY,
    cases=(SpeedCase(7, 0.1),),
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


def test_rates_are_of_the_time_between_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chunk has 16,384 collisions here; by this clock, each but the first takes 0.16384 s."""
    clock = iter(9.0 + 0.16384 * np.arange(10))
    monkeypatch.setattr("snooker_cli.validation.speed_study.time.process_time", lambda: next(clock))
    study = replace(QUICK_STUDY, events=16_384)
    found = study.timing(SpeedCase(37, 0.37))
    for key in ("median", "lowest", "highest"):
        assert found[key] == pytest.approx(1e5)


def test_short_repeats_are_a_run_with_the_default_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Run, list[RepeatResult]]] = []
    execute = speed_study.execute

    def spy(run: Run, *, workers: int, **others: Any) -> list[RepeatResult]:
        assert workers == processors()
        results = execute(run, workers=workers, **others)
        stored = [store.read_headers(path) for path in run.batches(0)]
        assert sum(map(len, stored)) == len(results) == run.experiment.repeats
        seen.append((run, results))
        return results

    monkeypatch.setattr(speed_study, "execute", spy)
    found = short_repeats("summary", 3, 2)
    assert [len(results) for _, results in seen] == [2, 3, 3]
    for run, results in seen:
        scene = starting_scene(run.experiment, 0)
        assert (scene.container, scene.container_mass) == (Circle(10.0), math.inf)
        assert scene.number == 37
        assert set(scene.radii) == {0.1}
        assert scene.restitution == 0.9
        assert run.experiment.record == "summary"
        assert all(0 < each.collisions <= run.experiment.collisions == 500 for each in results)
        assert not run.directory.exists()
    assert found["rate"] == "repeats/s: 3 of 37 balls, 500 collisions, summary"
    assert (found["rounds"], found["threads"]) == (2, processors())


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
    for line, kept in zip(lines[5:7], ("events", "summary"), strict=True):
        assert line.startswith(f"repeats/s: 100 of 37 balls, 500 collisions, {kept}")


def test_linux_names_the_processor(bench: Any) -> None:
    found = Path("/proc/cpuinfo")
    names = found.read_text(encoding="utf-8").splitlines() if found.exists() else []
    models = {line.partition(": ")[2] for line in names if line.startswith("model name")}
    processor = bench("speed")[1]["machine"]["processor"]
    assert processor
    assert not models or processor in models


def test_rates_of_two_records_stand_beside_each_other(bench: Any) -> None:
    record = bench("speed")[1]
    first, _, *others = record["rates"]
    earlier = record | {"rates": [first | {"median": first["median"] / 2}, *others]}
    lines = list(SpeedStudy.tables(record | {"earlier": earlier}))
    (heading,) = (number for number, line in enumerate(lines) if "now/then" in line)
    assert "then:" in lines[:heading]
    ratios = [line.split()[-1] for line in lines[heading + 1 : -1]]
    assert ratios == ["2.00", "–", *["1.00"] * len(others)]


def test_the_command_compares_with_an_earlier_record(
    bench: Any, snooker: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also with a record that has a comparison itself."""
    monkeypatch.setattr(SpeedStudy, "planned", lambda _: TINY_STUDY)
    earlier = bench("speed")[0] / "speed.json"
    out = tmp_path / "out"
    ended = snooker("bench", "speed", "--quick", "--compare", earlier, "--out", out)
    assert ended.code == 0
    assert "now/then" in ended.out
    again = snooker("bench", "speed", "--quick", "--json", "--compare", out / "speed.json")
    found = json.loads(again.out)["earlier"]
    assert found == {
        key: value
        for key, value in json.loads((out / "speed.json").read_text(encoding="utf-8")).items()
        if key != "earlier"
    }


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"machine": {}}, "no 'processor'"),
        ({"rates": [{"rate": "repeats/s"}]}, "no 'median'"),
        ({"rates": 3}, "'int' object is not iterable"),
        ({"date": 2026}, "'int' object is not subscriptable"),
        ({"versions": []}, "unsupported operand"),
        ({"rates": {"a": "b"}}, "string indices"),
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
    record["rates"][0]["median"] = rate
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
    short, gases = record["rates"][:2], record["rates"][2:]
    for one, kept in zip(short, ("events", "summary"), strict=True):
        assert one["rate"] == f"repeats/s: 100 of 37 balls, 500 collisions, {kept}"
        assert one["kernel_share"] > 0
    assert [one["balls"] for one in gases] == [one.balls for one in QUICK_STUDY.cases]
    for one in record["rates"]:
        assert 0 < one["lowest"] <= one["median"] <= one["highest"]
    assert len({one["rate"] for one in record["rates"]}) == len(record["rates"])
