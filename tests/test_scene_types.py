"""Tests share few types of scenes, because each takes seconds to compile."""

from __future__ import annotations

import numba
import pytest
from scene_types import LISTED, CompiledTypes
from scenes import gas, rough

from snooker_cli.engine.conversion import new_states
from snooker_cli.engine.event_loop import advance


@pytest.mark.parametrize(
    ("shape", "spins", "name", "listed"),
    [
        ("circle", False, "FixedCircle UnequalBalls Smooth", True),
        ("channel", True, "ChannelSides UnequalBalls Rough", False),
    ],
)
def test_a_type_that_is_in_no_list_is_noted(
    shape: str, spins: bool, name: str, listed: bool
) -> None:
    scene = gas(shape, 20, 0.2, mixed=True)
    states = new_states([rough(scene) if spins else scene])
    types = CompiledTypes()
    types.note(advance.function, [numba.typeof(states)])
    assert (name in LISTED) == listed
    assert types.unlisted == ([] if listed else [name])
