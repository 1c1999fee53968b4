"""The measurement of speed: its gases and arithmetic. No test depends on a speed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from snooker_cli import store
from snooker_cli.errors import StoreError, UserError
from snooker_cli.scene import Scene
from snooker_cli.validation import speed_study
from snooker_cli.validation.speed_study import SPEED, short_repeats
from snooker_cli.validation.study_tables import earlier_record, lines


def test_short_repeats_that_cannot_be_stored_end_the_measurement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(path: Path, *_: object) -> None:
        raise StoreError(path, "no space left", "make room")

    monkeypatch.setattr(store, "write", fails)
    with pytest.raises(UserError, match=r"no space left.*TMPDIR"):
        list(short_repeats(2, 1))


def test_the_record_is_complete_and_shown_beside_an_earlier_one(bench: Any) -> None:
    folder, record = bench("speed")
    short, gases = record["rates"][:2], record["rates"][2:]
    printed = list(lines(record))
    for rate, what, line in zip(short, ("simulated", "analysed"), printed[5:7], strict=True):
        assert rate["rate"] == f"repeats/s: 100 of 37 balls, 500 collisions, {what}"
        assert line.startswith(rate["rate"])
    assert [gas["balls"] for gas in gases] == [
        balls for balls, *_ in SPEED.plan(quick=True)["cases"]
    ]
    for rate in record["rates"]:
        assert 0 < rate["lowest"] <= rate["median"] <= rate["highest"]
    assert printed[0].startswith(f"{record['machine']['processor']}, ")
    earlier = earlier_record(folder / "speed.json")
    assert earlier == record
    slower = [rate | {"median": rate["median"] / 2} for rate in earlier["rates"][1:]]
    beside = lines(record | {"earlier": earlier | {"rates": slower}})
    rows = [line for line in beside if line.endswith(" 2.00")]
    assert len(rows) == len(slower)


def test_the_first_chunk_which_compiles_is_not_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock on which compiling takes 1,000 s, and then each thousand collisions 1 s."""
    clock = 0.0

    def simulated(_scene: Scene, *, collisions: int, watch: Any, sink: Any) -> None:
        nonlocal clock
        for done in range(0, collisions, 1000):
            chunk = min(1000, collisions - done)
            clock += chunk / 1000 if done else 1000.0
            watch(chunk, 0.0)

    monkeypatch.setattr(speed_study, "simulate", simulated)
    monkeypatch.setattr(speed_study.time, "process_time", lambda: clock)
    case = speed_study.SpeedCase(balls=8, packing=0.1, free=False)
    (rate, *_) = list(speed_study.timing(case, 5000, 3, 1))
    assert [rate["lowest"], rate["highest"]] == pytest.approx([1000, 1000])
