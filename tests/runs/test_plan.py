"""What a run will do: the classes of its scenes, and what is refused beforehand."""

from __future__ import annotations

import pytest

from snooker_cli.config import parse, points
from snooker_cli.containers import Circle
from snooker_cli.errors import SceneError
from snooker_cli.runs.plan import SceneClass, scene_classes

GAS = """\
container: {radius: 10.0}
balls: {count: 100, radius: 0.3, speed: 10}
cor: 1
collisions: 10
"""

KERNEL = {
    "cells": False,
    "balls sorted by cells": False,
    "straight walls": False,
    "periodic images": False,
    "moving container": False,
    "unequal balls": False,
    "sliding along the wall": False,
    "events": True,
    "lasting contacts": False,
    "slow collisions elastic": False,
}
LOSSES = {"losses between balls": False, "losses at the wall": False, "wall traps": False}

TWO_BALLS = """\
container: {radius: 10.0}
balls:
  list:
    - {position: [-4, 0], velocity: [1, 0.1], radius: 1}
    - {position: [4, 0], velocity: [-1, 0], radius: 1}
cor: 1
collisions: 10
"""


def classes_of(text: str, *overrides: str, engine: str | None = None) -> list[SceneClass]:
    return scene_classes(points(parse(text, overrides=overrides).experiment), engine)


def test_classes_name_what_is_modelled(small_config: str) -> None:
    lossy, elastic = classes_of(small_config)
    free = KERNEL | {"moving container": True, "collapse": True}
    assert elastic.models == free | LOSSES
    assert lossy.models == free | dict.fromkeys(LOSSES, True)
    assert [point.index for point in lossy.points + elastic.points] == [0, 1]
    assert (lossy.shape, lossy.balls, elastic.balls) == (Circle, (7,), (7,))


def test_a_class_holds_points_that_need_the_same(small_config: str) -> None:
    swept = ("balls.rings=0,2,1", "cor=0.7,0.8")
    (one,) = classes_of(small_config, *swept)
    assert one.balls == (1, 19, 7, 1, 19, 7)
    assert [point.index for point in one.points] == list(range(6))
    fixed, free = classes_of(small_config, "container.mass=.inf,1e7", "cor=1")
    assert (fixed.models["moving container"], free.models["moving container"]) == (False, True)


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        ((), {"cells": True}),
        (("balls.count=80",), {}),
        (("record=summary",), {"cells": True, "events": False}),
        (("balls.count=4096", "balls.radius=0.05"), {"cells": True, "balls sorted by cells": True}),
        (("cor=0.9",), {"cells": True} | dict.fromkeys(LOSSES, True)),
        (("cor=0.9", "wall_cor=1"), {"cells": True, "losses between balls": True}),
        (("container={shape: box, width: 20}",), {"cells": True, "straight walls": True}),
        (
            ("container={shape: box, width: 20}", "cor=0.9"),
            {"cells": True, "straight walls": True, **dict.fromkeys(LOSSES, True)}
            | {"wall traps": False},
        ),
        (
            ("container={shape: periodic, width: 20}", "wall_cor=0.9"),
            {"cells": True, "periodic images": True},
        ),
    ],
)
def test_only_what_a_scene_needs_is_modelled(
    overrides: tuple[str, ...], expected: dict[str, bool]
) -> None:
    (each,) = classes_of(GAS, *overrides)
    assert each.models == KERNEL | LOSSES | {"collapse": True} | expected


def test_different_balls_are_another_class() -> None:
    (equal,) = classes_of(TWO_BALLS)
    (different,) = classes_of(
        TWO_BALLS.replace("[-1, 0], radius: 1", "[-1, 0], radius: 2, mass: 3")
    )
    assert equal.balls == different.balls == (2,)
    assert different.models == equal.models | {"unequal balls": True}


def test_an_engine_can_be_forced_upon_all_scenes_it_knows(small_config: str) -> None:
    assert classes_of(GAS, engine="allpairs")[0].models["cells"] is False
    assert {each.models["cells"] for each in classes_of(small_config, engine="cells")} == {True}
    with pytest.raises(SceneError, match="allpairs knows no box: use cells") as caught:
        classes_of(GAS, "container={shape: box, width: 20}", engine="allpairs")
    assert caught.value.key == "container.shape"


def test_a_scene_that_cannot_exist_names_its_point(small_config: str) -> None:
    swept = parse(small_config, overrides=["balls.radius=1.0,3.0"]).experiment
    with pytest.raises(SceneError, match=r"\(at the point .*balls\.radius=3\.0\)") as caught:
        scene_classes(points(swept))
    assert caught.value.key == "balls.radius"


def test_repeats_of_given_balls_are_refused() -> None:
    """They would be the same bits again: nothing in a list is random."""
    scene_classes(points(parse(TWO_BALLS).experiment))
    with pytest.raises(SceneError, match=r"^4 repeats of balls\.list .*; set repeats: 1") as caught:
        scene_classes(points(parse(TWO_BALLS, overrides=["repeats=4"]).experiment))
    assert caught.value.key == "repeats"
