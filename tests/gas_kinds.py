"""A small config of every type of gas that theories, figures and pages distinguish."""

from __future__ import annotations

from snooker_cli.config import parse
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene

CIRCLE = "container: {radius: 10}\n"
RINGS = CIRCLE + "balls: {rings: 2, radius: 0.8, speed: 10}\n"
MIXED = "balls: [{count: 10, radius: 0.8, speed: 10}, {count: 9, radius: 0.5, mass: 3, speed: 5}]\n"
BOX = "container: {shape: box, width: 20}\nballs: {count: 37, radius: 0.5, speed: 10}\n"
CHANNEL = BOX.replace("box", "channel")
PERIODIC = BOX.replace("box", "periodic")
DRIFT = (
    "container: {shape: periodic, width: 20}\nballs:\n  list:\n"
    "    - {position: [-5, 0], velocity: [5, 0], radius: 1}\n"
    "    - {position: [0, 1], velocity: [2, 0], radius: 1}\n"
    "    - {position: [5, 1], velocity: [1, 2], radius: 1}\n"
)
ROUGH = "tangential_cor: 0.5\nwall_tangential_cor: -1\n"
END = "collisions: 400\nrepeats: 5\nrecord: events\n"

KINDS = {
    "one ball": CIRCLE + "balls: {rings: 0, radius: 1, speed: 10}\ncor: 0.9\n",
    "one elastic ball": CIRCLE + "balls: {rings: 0, radius: 1, speed: 10}\ncor: 1\n",
    "elastic": RINGS + "cor: 1\n",
    "cooling": RINGS + "cor: 0.9\n",
    "cooling, elastic wall": RINGS + "cor: 0.9\nwall_cor: 1\n",
    "rough": RINGS + "cor: 0.9\nwall_cor: 1\n" + ROUGH,
    "rough, friction": RINGS + "cor: 0.9\nwall_cor: 1\nfriction: 0.3\n" + ROUGH,
    "rough, elastic": RINGS + "cor: 1\ntangential_cor: 1\n",
    "rough, driven": RINGS + "cor: 0.9\nwall_speed: 2\n" + ROUGH,
    "mixture": CIRCLE + MIXED + "cor: 0.9\n",
    "mixture, elastic": CIRCLE + MIXED + "cor: 1\n",
    "e(v)": RINGS + "cor: 0.9\ncor_speed: 5\n",
    "channel": CHANNEL + "cor: 0.9\n",
    "periodic": PERIODIC + "cor: 0.9\n",
    "periodic, elastic": PERIODIC + "cor: 1\n",
    "mixture, periodic": PERIODIC.split("\n")[0] + "\n" + MIXED + "cor: 0.9\n",
    "drift": DRIFT + "cor: 0.9\n",
    "drift, elastic": DRIFT + "cor: 1\n",
    "dense": PERIODIC.replace("radius: 0.5", "packing: 0.7") + "cor: 0.95\n",
    "driven": RINGS + "cor: 0.95\nwall_cor: 1\nwall_speed: 2\n",
    "thermal": RINGS + "cor: 1\nwall_temperature: 30\n",
    "thermal, inelastic": RINGS + "cor: 0.9\nwall_temperature: 30\n",
    "two temperatures": BOX + "cor: 0.95\nwall_temperature: {left: 20, right: 60}\n",
    "two temperatures, mixture": BOX.split("\n")[0] + "\n" + MIXED + "cor: 0.95\n"
    "wall_temperature: {left: 20, right: 60}\n",
    "light container": RINGS.replace("10}", "10, mass: 50}", 1) + "cor: 0.9\n",
    "tc": RINGS + "cor: 0.9\nwall_cor: 1\ncollapse: {tc: 0.01}\n" + ROUGH,
}
"""The text of each, whose repeats need `END` too."""


def text_of(kind: str) -> str:
    """The whole config of a gas; repeats of listed balls would all be the same."""
    end = END.replace("repeats: 5", "repeats: 1") if "list:" in KINDS[kind] else END
    return KINDS[kind] + end


def scene_of(kind: str) -> Scene:
    """Its first start."""
    return starting_scene(parse(text_of(kind)).config, 0)
