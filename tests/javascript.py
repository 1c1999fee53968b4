"""The live page's JavaScript in V8, and the program's answer to the same question."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from py_mini_racer import MiniRacer

from snooker_cli.engine import webassembly
from snooker_cli.laws import Law
from snooker_cli.live_page.page import STARTING, engine_source, stored_start
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace, event_hashes

HELPERS = r"""
function bitsOf(values) {
  const view = new DataView(new ArrayBuffer(8));
  return Array.from(values, (value) => {
    view.setFloat64(0, value + 0); // -0 is 0
    return view.getBigUint64(0).toString(16).padStart(16, "0");
  }).join("");
}

function startOfScene(scene, config) {
  const { positions, velocities, radii, masses, container, wallKey, spins = [] } = scene;
  return JSON.stringify({
    bits: bitsOf([...positions, ...velocities, ...radii, ...masses, ...container.size, ...spins]),
    key: wallKey === null ? null : String(wallKey),
    config: configOfStart(config, scene), given: scene.isGiven,
  });
}

function startOfRepeat(config, repeat) {
  try {
    return startOfScene(startingScene(config, repeat), config);
  } catch (error) {
    if (!(error instanceof SceneError)) throw error;
    return JSON.stringify({ error: error.message });
  }
}

// What browsers have beside V8.
function atob(text) {
  const letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const bitsOfLetter = (letter) => letters.indexOf(letter).toString(2).padStart(6, "0");
  const bytes = Array.from(text.replace(/=/g, ""), bitsOfLetter).join("").match(/.{8}/g);
  return bytes.map((byte) => String.fromCharCode(parseInt(byte, 2))).join("");
}

function simulated(scene, limits) {
  const simulation = new Simulation(scene, limits, { hash: true });
  // In pieces, as a page does; a time between events stops nothing.
  while (simulation.stop === null) {
    simulation.advance(100);
    simulation.advance(50, simulation.time * (1 + 1e-9));
  }
  const { stop, number } = simulation, numbers = [];
  for (let i = 0; i <= number; i += 1) {
    numbers.push(...simulation.positionOf(i, stop.time), ...simulation.velocityOf(i, stop.time));
  }
  if (scene.surface) numbers.push(...simulation.spins);
  return JSON.stringify({
    stop, events: simulation.wallEvents + simulation.pairEvents, hash: simulation.eventHash(),
    hashes: simulation.hashes, bits: bitsOf(numbers), wall: simulation.wallEvents,
  });
}
"""


def modules_source(boundaries: Sequence[str] | None = None, laws: Sequence[Law] = ()) -> str:
    """A script that compiles modules of the engine at once, as no page may do."""
    modules = webassembly.modules(boundaries, laws).items()
    codes = {name: ",".join(map(str, code)) for name, code in modules}
    return "".join(
        f"modules.{name} = new WebAssembly.Module(Uint8Array.of({code}));\n"
        for name, code in codes.items()
    )


class JavaScript:
    """The scripts of the engine and of the start, in V8."""

    def __init__(self, boundaries: Sequence[str] | None = None, laws: Sequence[Law] = ()) -> None:
        """With the modules of some boundaries, or of all, and with laws of packages."""
        self.context = MiniRacer()
        self.context.eval(engine_source(*STARTING, laws=laws))
        self.context.eval(modules_source(boundaries, laws) + "0")
        self.context.eval(HELPERS)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()  # else Python does not end

    def answer(self, expression: str) -> Any:
        """What an expression, which gives JSON, evaluates to."""
        return json.loads(str(self.context.eval(expression)))


def bits_of(*arrays: ArrayLike) -> str:
    """The bits of numbers, as ``bitsOf``."""
    return b"".join((np.asarray(array) + 0.0).astype(">f8").tobytes() for array in arrays).hex()


def scene_of(scene: Scene) -> str:
    """The expression of a scene of the program."""
    return f"storedScene({json.dumps(stored_start(scene))})"


def answer_of(trace: Trace) -> dict[str, Any]:
    """What ``simulated`` should answer."""
    finish, stop, hashes = trace.finish, trace.stop, event_hashes([trace.events])
    rows = np.column_stack([finish.positions, finish.velocities])
    container = np.concatenate([finish.container_position, finish.container_velocity])
    return {
        "stop": {
            "reason": stop.reason,
            "time": stop.time,
            "balls": list(stop.balls),
            "message": stop.message,
        },
        "events": trace.collisions,
        "hash": hashes[-1][1],
        "hashes": [[k, text] for k, text in hashes if k >= 1000 and math.log10(k) % 1 == 0],
        "bits": bits_of(rows, container, [] if finish.spins is None else finish.spins),
        "wall": trace.wall_events,
    }
