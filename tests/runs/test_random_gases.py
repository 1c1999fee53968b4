"""Random gases run until each ball has had 2,000 collisions, and their files can be read.

The environment variable SNOOKER_GASES is the number of gases. With it, they are different ones each
time; else there are 200, always the same.
"""

from __future__ import annotations

import os
import random
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

import snooker_cli
from snooker_cli.trace import StopReason

pytestmark = pytest.mark.long  # it compiles some 25 types of scenes

ALWAYS = 200
GASES = int(os.environ.get("SNOOKER_GASES", ALWAYS))

LONGEST = 120  # s, with compiling; then the gas is stopped, and the test fails


def gas(dice: random.Random) -> dict[str, Any]:
    """A config of 2 to 8 balls with any shape, laws, sizes and spins."""
    shape = dice.choice(["circle", "circle", "free", "slide", "box", "channel", "periodic"])
    number, radius = dice.choice([2, 3, 4, 6, 8]), dice.choice([0.1, 0.3, 0.5, 1.0])
    balls: dict[str, Any] = {
        "count": number,
        "radius": radius,
        "speed": float(f"{10 ** dice.uniform(-3, 3):.3g}"),
    }
    circle = shape in ("circle", "free", "slide")
    container: dict[str, Any] = {"radius": 10.0} if circle else {"shape": shape, "width": 20.0}
    if shape == "free":
        container["mass"] = float(f"{10 ** dice.uniform(-1, 7):.3g}")
    config: dict[str, Any] = {
        "container": container,
        "cor": dice.choice([1.0, 0.99, 0.9, 0.7, 0.5, 0.2]),
        "record": dice.choice(["events", "events", "summary"]),
        "collisions": 1000 * number,
        "seed": dice.randrange(10**6),
    }
    fixed_walls = shape in ("circle", "box", "channel")
    law = dice.random()
    if fixed_walls and law < 0.1:
        config["wall_speed"] = 1.0
    elif fixed_walls and law < 0.15:
        config["wall_temperature"] = 5.0
    elif shape != "periodic":
        config["wall_cor"] = dice.choice([1.0, 0.9, 0.5])
    if shape != "slide" and dice.random() < 0.2:
        config["cor_speed"] = dice.choice([0.1, 1.0, 20.0])
    if shape == "slide":
        config["collapse"] = "slide"
    elif dice.random() < 0.25:
        config["collapse"] = {"tc": dice.choice([0.001, 0.01, 0.1])}
    if dice.random() < 0.5:
        config["tangential_cor"] = dice.choice([-0.5, 0.0, 0.3, 0.5, 1.0])
        config["friction"] = dice.choice([None, 0.05, 0.3, 1.0])
        if dice.random() < 0.5:
            balls["spin"] = dice.choice([0.1, 1.0, {"temperature": 5.0}])
        if shape == "slide":
            config["wall_tangential_cor"] = -1.0
        elif shape != "periodic" and "wall_temperature" not in config:
            config["wall_tangential_cor"] = dice.choice([-1.0, 0.0, 0.5, 1.0])
    config["balls"] = balls
    if dice.random() < 0.3:
        mass = dice.choice([0.01, 0.25, 4.0])
        others = {**balls, "count": number // 2, "radius": radius / 2, "mass": mass}
        first = {**balls, "count": number - number // 2}
        config["balls"] = [{**first, "start": "random"}, {**others, "start": "random"}]
    return config


def seeds() -> list[int]:
    """One for each gas."""
    if "SNOOKER_GASES" not in os.environ:
        return list(range(ALWAYS))
    return random.SystemRandom().sample(range(ALWAYS, 10**9), GASES)


@pytest.mark.parametrize("seed", seeds())
def test_a_gas_ends_and_can_be_read(seed: int, tmp_path: Path) -> None:
    """It ends with a reason; every number has its range; a new simulation has the same bits."""
    config = gas(random.Random(seed))
    stopped = threading.Timer(LONGEST, signal.raise_signal, [signal.SIGINT])
    stopped.start()
    try:
        run = snooker_cli.run(config, out=tmp_path / "run", progress=False)
    except KeyboardInterrupt:
        pytest.fail(f"it does not end: {config}")
    finally:
        stopped.cancel()
    (repeat,) = run
    assert repeat.stop.reason not in (StopReason.IDLE, StopReason.OUT_OF_RANGE), repeat.stop.message
    verdicts = run.verify(replay=True)
    assert verdicts.sound, f"{config}: {verdicts}"
