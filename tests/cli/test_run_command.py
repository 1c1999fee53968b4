"""``snooker run``: tables, hints, and estimates of time and disk."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from command_line import Snooker

from snooker_cli.api.simulating import Request
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


def test_a_plan_warns_of_balls_that_cool_until_they_drift_together(
    here: Path, snooker: Snooker
) -> None:
    """Speeds are 10⁻¹⁶ of what they were after 36 · 2N / (1 − CoR²) collisions."""
    Path("gas.yaml").write_text(
        "container: {shape: periodic}\ncor: 0.999\n"
        "balls: {count: 217, packing: 0.1, radius: 1.0, speed: 10.0}\n"
    )
    for keys, warned in (
        (["collisions=7.8e6"], False),
        (["collisions=7.9e6"], True),
        (["collisions=7.9e6", "cor=1"], False),
        (["collisions=7.9e6", "collapse={elastic_below: 0.01}"], False),
        (["collisions=7.9e6", "container.shape=box"], False),
    ):
        printed = snooker("run", "gas.yaml", "--dry-run", *overrides(*keys)).out
        assert ("This may take much longer" in printed) == warned, keys


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

    def carried_out(_request: Request, *, checkpoint: float, **_: object) -> None:
        given.append(checkpoint)
        raise UserError("enough", "stop")

    monkeypatch.setattr(Request, "carry_out", carried_out)
    snooker("run", str(HARD / "along-the-wall.yaml"), "--checkpoint", "2", "--out", "run")
    assert given == [120]
