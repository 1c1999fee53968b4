"""``snooker run``: tables, hints, and estimates of time and disk."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from command_line import Snooker

from snooker_cli.api.simulating import PlannedRun
from snooker_cli.errors import UserError

HARD = Path(__file__).parents[2] / "configs" / "hard"


def overrides(*keys: str) -> list[str]:
    return [f"--override={key}" for key in keys]


@pytest.mark.parametrize(
    ("config", "keys", "hint", "way"),
    [
        ("along-the-wall", ["wall_cor=0.5"], "`collapse: slide`", "collapse=slide"),
        ("along-the-wall", ["wall_cor=0.5", "container.mass=1e7"], "`collapse: {tc: 0.01}`", ""),
        ("along-the-wall", ["wall_cor=0.5", "collapse=slide"], "", ""),
        ("collapse-three", ["cor=0.05"], "`collapse: {tc: 0.01}`", "collapse.tc=0.01"),
    ],
)
def test_a_hint_says_how_collapsed_repeats_continue(
    config: str, keys: list[str], hint: str, way: str, here: Path, snooker: Snooker
) -> None:
    arguments = ["run", str(HARD / f"{config}.yaml"), "--no-progress", *overrides(*keys)]
    ended = snooker(*arguments, "--out", "before")
    assert ended.code == 0, ended.err
    assert ("To continue such repeats" in ended.out) == bool(hint)
    assert hint in ended.out
    if way:
        continued = snooker(*arguments, "-o", way, "--out", "after")
        assert continued.code == 0, continued.err
        assert "wall_trap" not in continued.out
        assert " collapse" not in continued.out


def test_a_run_says_why_repeats_ended_early(here: Path, snooker: Snooker) -> None:
    """Two balls of CoR 0 have the same velocity after they met, but for roundings."""
    Path("gas.yaml").write_text(
        "container: {shape: periodic, packing: 0.02}\ncor: 0\ncollisions: 500\nseed: 2\n"
        "balls: {count: 2, radius: 1, speed: 10, start: random}\n"
    )
    ended = snooker("run", "gas.yaml", "--no-progress")
    assert ended.code == 0, ended.err
    assert "point 0, repeat 0: all balls are slower than 2e-154 m/s" in ended.out


def test_a_run_begins_on_a_full_disk_with_yes(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = shutil.disk_usage(here)._replace(free=10_000)
    monkeypatch.setattr("shutil.disk_usage", lambda _: full)
    arguments = ("run", "small.yaml", "-j", "2", "--no-progress")
    refused = snooker(*arguments)
    assert refused.code == 2
    assert "only 10 kB are free" in refused.err
    assert snooker(*arguments, "--yes").code == 0
    # Stored repeats need no more disk, and two more repeats need less than is free.
    assert snooker(*arguments).code == 0
    assert snooker(*arguments, "-o", "repeats=4").code == 0
    assert snooker(*arguments, "-o", "repeats=6").code == 2


def test_a_checkpoint_is_saved_after_minutes(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[float] = []

    def carried_out(_request: PlannedRun, *, checkpoint: float, **_: object) -> None:
        given.append(checkpoint)
        raise UserError("enough", "stop")

    monkeypatch.setattr(PlannedRun, "carry_out", carried_out)
    snooker("run", str(HARD / "along-the-wall.yaml"), "--checkpoint", "2", "--out", "run")
    assert given == [120]
