"""The end of every caption: the scene, its repeats, how they ended, what they share."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

import pytest
from figure_runs import (
    BOX,
    ELASTIC,
    layers,
    made,
    shown,
    traces,
    why_not,
)

from snooker_cli.figures import (
    Line,
    Points,
    Selection,
    unfinished,
)
from snooker_cli.figures.captions import early
from snooker_cli.figures.selection import Facts
from snooker_cli.runs import Run, open_run
from snooker_cli.trace import StopReason


@pytest.fixture(scope="module")
def trapped(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Seven balls with a wall that traps some of them."""
    overrides = ("balls.rings=1", "cor=0.85,1.0", "wall_cor=null", "repeats=4")
    return made(tmp_path_factory.mktemp("trapped") / "run", *overrides)


@pytest.fixture
def broken(decaying: Run, tmp_path: Path) -> Run:
    """That run, interrupted: CoR 0.8 is whole, of 0.9 the last repeat is there, of 1.0 none."""
    shutil.copytree(decaying.directory, tmp_path / "broken")
    run = open_run(tmp_path / "broken")
    for point, repeat in ((1, 0), (1, 1), (2, 0), (2, 1), (2, 2)):
        run.path(point, repeat).unlink()
    return run


def test_captions_tell_the_scene(decaying: Run) -> None:
    scene = "Scene: N = 19, r = 1 m, v₀ = 10 m/s, R = 10 m, "
    assert shown(decaying, "energy", repeat=2, cor=0.8).caption.endswith(
        scene + "CoR 0.8, wall CoR 1; repeat 2 of 3, 200 collisions."
    )
    assert shown(decaying, "speeds", cor=0.8).caption.endswith(
        scene + "CoR 0.8, wall CoR 1; 3 repeats, 200 collisions each."
    )


def test_captions_count_what_ended_early(trapped: Run) -> None:
    reasons = Counter(trace.stop.reason for trace in traces(trapped, 0))
    count = reasons[StopReason.WALL_TRAP]
    assert reasons == {StopReason.WALL_TRAP: count, StopReason.COLLISIONS: 4 - count}
    assert 0 < count < 4
    assert shown(trapped, "ideal-ratio").caption.endswith(
        f"4 repeats of at most 200 collisions: {count} of 8 repeats ended early, in a wall trap."
    )
    alone = shown(trapped, "pressure", cor=0.85)
    assert f"{count} of 4 repeats ended early, in a wall trap" in alone.caption
    assert "early" not in shown(trapped, "pressure", cor=1.0).caption


def test_captions_of_one_repeat_tell_its_own_end(trapped: Run) -> None:
    for number, trace in enumerate(traces(trapped, 0)):
        picture = shown(trapped, "energy-fit", repeat=number, cor=0.85)
        ended = trace.stop.reason is StopReason.WALL_TRAP
        length = (
            ", at most 200 collisions: the repeat ended early, in a wall trap."
            if ended
            else ", 200 collisions."
        )
        assert picture.caption.endswith(f"repeat {number} of 4{length}")


def test_several_endings() -> None:
    reasons = [StopReason.COLLISIONS, StopReason.TIME]
    assert early([Facts(reason, 9, b"") for reason in reasons]) == ""
    reasons += [StopReason.COLLAPSE] * 2 + [StopReason.WALL_TRAP] * 3
    assert early([Facts(reason, 9, b"") for reason in reasons]) == (
        "5 of 7 repeats ended early, 3 in a wall trap and 2 in a collapse"
    )


def test_an_end_of_all_motion_is_early_too(tmp_path: Path) -> None:
    still = made(tmp_path / "still", "balls.speed=0", "repeats=1")
    assert shown(still, "central-distances").caption.endswith(
        "one repeat, at most 200 collisions: the repeat ended early, with no collision ahead."
    )


def test_pictures_of_an_unfinished_run(broken: Run, decaying: Run) -> None:
    missing = "The run is unfinished: 1 of 3 at CoR 0.9 and none of 3 at CoR 1 are there."
    assert unfinished(broken, Selection()) == missing
    assert unfinished(decaying, Selection()) == ""
    picture = shown(broken, "energy")
    assert picture.caption.endswith(missing)
    assert [line.label for line in layers(picture, Line)] == ["CoR 0.8", "CoR 0.9"]
    # 0 of one, 2 of the other
    assert "Lines: the first repeat of each point; bands: mean" in picture.caption
    means = shown(broken, "decay-against-cor")
    assert [record["repeats"] for record in means.numbers["points"]] == [3, 1]
    k = layers(means, Points)[0]
    whole = layers(shown(decaying, "decay-against-cor"), Points)[0]
    assert k.y[0] == whole.y[0]
    assert k.y_error is None  # there is none of a single repeat


def test_one_point_of_an_unfinished_run(broken: Run, decaying: Run) -> None:
    picture = shown(broken, "energy-fit", cor=0.9)
    assert picture.caption.endswith(
        "repeat 2 of 3, 200 collisions. The run is unfinished: 1 of 3 repeats are there."
    )
    assert picture.numbers["k"] == shown(decaying, "energy-fit", repeat=2, cor=0.9).numbers["k"]
    assert "no repeat is there yet" in why_not(broken, "energy", cor=1.0)
    assert "repeat 0 is not there yet" in why_not(broken, "energy", repeat=0, cor=0.9)


def test_many_missing_repeats_are_summed_up(tmp_path: Path) -> None:
    run = made(tmp_path / "run", "cor=0.5:1.0:6", "collisions=20")
    for point in range(1, 6):
        run.path(point, 1).unlink()
    assert unfinished(run, Selection()) == "The run is unfinished: 13 of 18 repeats are there."
    for point in (4, 5):
        for repeat in (0, 2):
            run.path(point, repeat).unlink()
    said = "The run is unfinished: 9 of 18 repeats are there, none at 2 of 6 points."
    assert unfinished(run, Selection()) == said


def test_captions_say_which_runs_are_copies(warm: Run) -> None:
    said = (
        "The repeats at v₀ = 5, 10 and 20 m/s have the same random numbers: they are the same "
        "motions at another pace and count once."
    )
    assert shown(warm, "pressure-temperature").caption.endswith(said)
    assert shown(warm, "speeds", balls__radius=1.0).caption.endswith(said)
    slow, fast = (traces(warm, index)[1] for index in (3, 5))
    assert (fast.finish.velocities == 4 * slow.finish.velocities).all()
    assert (fast.finish.positions == slow.finish.positions).all()


def test_motions_that_rounding_has_parted_are_no_copies(tmp_path: Path) -> None:
    run = made(tmp_path / "run", *ELASTIC, "balls.speed=10,15", "collisions=500")
    ten, fifteen = (traces(run, index)[0] for index in (0, 1))
    assert (fifteen.start.positions == ten.start.positions).all()
    assert not (fifteen.finish.positions == ten.finish.positions).all()
    assert "pace" not in shown(run, "pressure-temperature").caption


def test_captions_count_species(tmp_path: Path) -> None:
    mixture = "balls=[{count: 9, radius: 0.6, speed: 10}, {count: 4, radius: 0.9, speed: 10}]"
    run = made(tmp_path / "mixture", mixture, "sweep={}", "collisions=50", text=BOX)
    caption = shown(run, "energy").caption
    assert "Scene: N = 13 of 2 species, box, width 20 m, height 14 m, CoR 0.9" in caption
