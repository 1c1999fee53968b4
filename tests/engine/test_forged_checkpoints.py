"""Whatever a checkpoint holds, the engine refuses it or stays within its arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from command_line import output_of
from numpy.typing import NDArray
from scenes import gas, report_scene

from snooker_cli.engine import simulate, simulation
from snooker_cli.engine.kernel_state import U, V, X, Y
from snooker_cli.scene import Scene

Checkpoint = dict[str, NDArray[Any]]

SCENES: dict[str, tuple[Callable[[], Scene], dict[str, Any]]] = {
    "all pairs": (partial(gas, "circle", 60, 0.3), {"engine": "allpairs", "summary": True}),
    "cells": (partial(gas, "circle", 60, 0.3), {"engine": "cells"}),
    "cells, free": (
        partial(gas, "circle", 60, 0.3, mixed=True, cor=0.9, container_mass=20.0),
        {"engine": "cells", "summary": True},
    ),
    "box": (partial(gas, "box", 60, 0.3, cor=0.9, aspect=1.5), {}),
    "periodic box": (partial(gas, "periodic", 60, 0.3, cor=0.9), {}),
}
"""A scene, and how it is simulated. Other tests compile the same kernels."""

# Numbers that kernels only count or compare: any of them is harmless.
COUNTED = {"histogram", "early_histogram", "ordered_at"}


def interrupted(name: str) -> Checkpoint:
    """A checkpoint after 400 events."""
    scene, options = SCENES[name]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(simulation, "CHUNK", 400)
        found = simulate(scene(), collisions=2000, watch=lambda _: True, **options).checkpoint
    assert found is not None
    return found


def continued(name: str, checkpoint: Checkpoint) -> None:
    """Simulate 2,000 events with a checkpoint."""
    scene, options = SCENES[name]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(simulation, "CHUNK", 400)
        simulate(scene(), collisions=2000, checkpoint=checkpoint, **options)


def reshaped(checkpoint: Checkpoint) -> Iterator[tuple[str, Checkpoint]]:
    """Checkpoints with an array that has another shape or type, or is missing."""
    for name, values in checkpoint.items():
        yield f"no {name}", {key: each for key, each in checkpoint.items() if key != name}
        others = [values[np.newaxis], values.astype("f4" if values.dtype == "f8" else "i2")]
        if values.size > 1:
            others += [values[..., :-1], np.concatenate([values, values])]
        yield from ((name, checkpoint | {name: each}) for each in others)


def integers(checkpoint: Checkpoint) -> Iterator[tuple[str, Checkpoint]]:
    """Checkpoints with integers that are no indices."""
    for name, values in checkpoint.items():
        if values.dtype.kind == "i" and name.rpartition(".")[2] not in COUNTED and values.size:
            for least in (False, True):
                number = np.iinfo(values.dtype)
                forged = np.full_like(values, number.min if least else number.max)
                yield f"{name} {least}", checkpoint | {name: forged}


@pytest.mark.parametrize("name", SCENES)
def test_arrays_of_another_shape_and_wrong_indices_are_refused(name: str) -> None:
    checkpoint = interrupted(name)
    continued(name, checkpoint)
    forged = [*reshaped(checkpoint), *integers(checkpoint)]
    assert len(forged) > 40
    for _which, each in forged:
        with pytest.raises(ValueError, match="checkpoint is not of this repeat"):
            continued(name, each)


@pytest.mark.parametrize("name", [name for name in SCENES if name != "all pairs"])
def test_wrong_entries_of_cells_are_refused(name: str) -> None:
    """Two balls exchanged, a ball listed twice, a queue whose nodes are not their children's."""
    good = interrupted(name)
    forged = [("cells.members", 0), ("cells.occupancy", 1), ("cells.links", 1)]
    for which, step in forged:
        values = good[which].copy()
        if which == "cells.links":
            values[2:4] = np.roll(values[2:4], 1, axis=1)
        else:
            values[values > 0] += 1 if step else -1
        with pytest.raises(ValueError, match="cell"):
            continued(name, good | {which: values})
    for place, time in ((1, 0.0), (-1, 0.0), (64, math.nan), (70, -1.0)):
        times = good["cells.tree.times"].copy()
        times[place] = time
        with pytest.raises(ValueError, match="queue"):
            continued(name, good | {"cells.tree.times": times})


@pytest.mark.parametrize("name", ["cells", "box"])
def test_a_ball_that_leaves_the_container_ends_the_simulation(name: str) -> None:
    """It is far outside, and its cell is not."""
    good = interrupted(name)
    balls = good["state.balls"].copy()
    balls[X] += 1000.0 * np.sign(balls[U])
    balls[Y] += 1000.0 * np.sign(balls[V])
    with pytest.raises(ValueError, match="left the container"):
        continued(name, good | {"state.balls": balls})


PROGRAM = """
import numpy as np, random, test_forged_checkpoints as forged
random.seed({seed})
good, refused = forged.interrupted({name!r}), 0
names = [key for key, each in good.items() if each.size and each.dtype.kind == 'i']
for _ in range({rounds}):
    checkpoint = {{key: each.copy() for key, each in good.items()}}
    for _ in range(random.choice([1, 3])):
        values = checkpoint[random.choice(names)]
        for place in random.sample(range(values.size), min(values.size, random.choice([1, 9]))):
            values.flat[place] = random.choice([-1, 0, 1, 2, 59, 60, 61, 400])
    try:
        forged.continued({name!r}, checkpoint)
    except ValueError:
        refused += 1
print(refused)
"""


@pytest.mark.parametrize("rounds", [60, pytest.param(3000, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", SCENES)
def test_random_integers_in_a_checkpoint_do_no_harm(name: str, rounds: int) -> None:
    """In a process of its own, which a fault would end."""
    program = PROGRAM.format(name=name, seed=rounds, rounds=rounds)
    assert 0 < int(output_of(program)) < rounds


def test_sliding_needs_a_wall_that_takes_energy() -> None:
    """The bounces of a ball that begins to slide would not end."""
    scene = report_scene(radius=0.1, cor=1.0)
    scene = type(scene)(**vars(scene) | {"slides": True, "wall_restitution": 1.0})
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(simulation, "CHUNK", 400)
        found = simulate(scene, collisions=2000, watch=lambda _: True).checkpoint
        assert found is not None
        found["states.slides"][0, 3] = 1
        with pytest.raises(ValueError, match="slides"):
            simulate(scene, collisions=2000, checkpoint=found)
