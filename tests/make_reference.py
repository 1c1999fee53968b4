"""The exact trajectories in ``tests/reference``: how they are made, and how they are read.

``python tests/make_reference.py`` makes them all anew, in a few minutes; with names, only those.
Each file is JSON; all numbers but the growths are the nearest doubles of the exact ones.

- what, made by: the scene, and the program and its precision
- scene: as in ``snooker_cli.scene``, SI units; null is infinite
- events: a row each: time (s), i, j (-1 for the container), impulse (kg m/s), and the ``Growth``
  of time (s), impulse (kg m/s) and the worst ball's place (m)
- states: after several numbers of events, evenly; a row a ball, the container last: x, y (m),
  u, v (m/s)
"""

from __future__ import annotations

import json
import math
import random
import sys
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scenes import scene_of

from snooker_cli import __version__
from snooker_cli.containers import Circle
from snooker_cli.laws import Constant
from snooker_cli.placement.places import DIGITS, cosine_and_sine
from snooker_cli.scene import Scene
from snooker_cli.trace import Events
from snooker_cli.validation.exact_twin import Interval, Twin, trajectory
from snooker_cli.validation.methods import ReferenceScene, events_from_rows, reference_scene, rings
from snooker_cli.validation.study import PLANS

FOLDER = Path(__file__).with_name("reference")

RADIUS = 10.0
"""Radius of every container, m."""

SHIFT, BITS = 1e-200, 8192
"""The relative errors of a noisy twin, and the precision in which they can grow."""

STATES = 5
"""States in a file, evenly over the events, with the last one."""


@dataclass(frozen=True)
class Growth:
    """What relative errors of 1 in every collision up to an event make of it: s, kg m/s, m.

    Those of positions are relative to the distance covered, those of velocities to the speed. The
    largest of some noisy twins; infinite from the event in which other bodies collide.
    """

    time: NDArray[np.float64]
    impulse: NDArray[np.float64]
    place: NDArray[np.float64]


@dataclass(frozen=True)
class Reference:
    """A file's content; ``after`` has the number of events before each row of ``states``."""

    scene: Scene
    events: Events
    growth: Growth
    after: NDArray[np.intp]
    states: NDArray[np.float64]


def read(name: str) -> Reference:
    """A reference by the name of its scene."""
    content = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    scene = content["scene"]
    columns = np.array(content["events"], dtype=np.float64).T
    arrays = {key: np.array(value) for key, value in scene.items() if isinstance(value, list)}
    container = Circle(scene.pop("container_radius"))
    mass = math.inf if scene["container_mass"] is None else scene["container_mass"]
    pair_law, wall_law = (Constant(scene.pop(key)) for key in ("restitution", "wall_restitution"))
    laws = {"pair_law": pair_law, "wall_law": wall_law}
    known = {**scene, **arrays, **laws, "container": container, "container_mass": mass}
    return Reference(
        scene=Scene(**known),
        events=events_from_rows(columns[:4].T),
        growth=Growth(*columns[4:7]),
        after=np.array([state["events"] for state in content["states"]]),
        states=np.array([state["bodies"] for state in content["states"]]),
    )


# The scenes beside those of the package


def row() -> Scene:
    """Newton's row of five with gaps, along a diameter; the first ball moves."""
    balls = [(1.5 * k - 6.5, 0.0, 0.0 if k else 10.0, 0.0, 0.5, 1.0) for k in range(5)]
    return scene_of(balls, restitution=0.9)


def galperin() -> Scene:
    """A light ball at rest between the wall and a ball 10,000 times heavier that approaches it."""
    return scene_of([(-9.4, 0.0, 0.0, 0.0, 0.1, 1.0), (-8.7, 0.0, -1.0, 0.0, 0.1, 1e4)])


def along_the_wall(angle: float) -> Scene:
    """One ball of 1 m at the wall; it moves inwards at an angle to the wall, rad."""
    with localcontext() as context:
        context.prec = DIGITS
        cosine, sine = cosine_and_sine(Decimal(angle))
    return scene_of([(RADIUS - 1.0, 0.0, -10.0 * float(sine), 10.0 * float(cosine), 1.0, 1.0)])


def wall_trap() -> Scene:
    """One ball that leaves a wall of restitution 0.9 at 6 m/s, and at 8 m/s along it."""
    return scene_of([(RADIUS - 1.0, 0.0, -6.0, 8.0, 1.0, 1.0)], wall_restitution=0.9)


FIXED = {"container_mass": math.inf}


def dilute_fixed() -> Scene:
    """The source report's balls with a radius of 0.1 m, and an elastic wall."""
    return replace(rings(1, radius=0.1, restitution=0.8, **FIXED), wall_law=Constant(1.0))


ALL = {item["name"]: reference_scene(item) for item in PLANS["scenes"]} | {
    scene.name: scene
    for scene in (
        ReferenceScene(
            "report-fixed",
            "the source report's balls, elastic, in a fixed container",
            500,
            partial(rings, 1, **FIXED),
        ),
        ReferenceScene(
            "dilute-fixed-cor-0.8",
            "balls of 0.1 m, cor 0.8, in a fixed container with an elastic wall",
            150,
            dilute_fixed,
        ),
        ReferenceScene(
            "row", "Newton's row of five, cor 0.9, and back from the elastic wall", 60, row
        ),
        ReferenceScene("galperin", "Galperin's billiard, mass ratio 10,000", 314, galperin),
        ReferenceScene(
            "whispering-gallery",
            "one elastic ball along the wall, at 0.001 rad to it",
            500,
            partial(along_the_wall, 1e-3),
        ),
        ReferenceScene(
            "star",
            "one elastic ball on a star of five corners",
            500,
            partial(along_the_wall, 0.4 * math.pi),
        ),
        ReferenceScene("wall-trap", "one ball into a wall trap, wall cor 0.9", 300, wall_trap),
    )
}
"""All scenes by name."""


class NoisyTwin(Twin):
    """Errs at random in each collision: by ``SHIFT`` of the distance covered and of the speed.

    Its errors are so small that they grow linearly to the end.
    """

    def __init__(self, scene: Scene, seed: int) -> None:
        self.dice = random.Random(seed)
        super().__init__(scene, BITS)

    def collide(self, i: int, j: int) -> tuple[Interval, Interval]:
        """Displace both bodies before they collide; a container that is fixed stays."""
        for body in (self.balls[i], self.bodies[j]):
            if body is not self.container or self.scene.free:
                speed = abs(body.velocity.real) + abs(body.velocity.imag)
                # The container's size, and speed times time: clocks are rounded too.
                way = self.half_sides[0] + speed * self.now
                body.turn(self.error(speed), self.now)
                body.place += self.error(way)
        return super().collide(i, j)

    def error(self, whole: Interval) -> Interval:
        """A random vector in proportion to what it is an error of."""
        across, along = (self.dice.gauss(0, 1) for _ in range(2))
        return self.vector(across, along) * self.number(SHIFT) * whole.mid()


def growth(scene: Scene, collisions: int) -> Growth:
    """The growth of errors over a scene's first collisions, of three noisy twins."""
    return Growth(*np.maximum.reduce([_deviation(scene, collisions, seed) for seed in range(3)]))


def _deviation(scene: Scene, collisions: int, seed: int) -> NDArray[np.float64]:
    """One noisy twin's deviation in time, impulse and place, over its errors; (3, *n*)."""
    exact, noisy = Twin(scene, BITS), NoisyTwin(scene, seed)
    others = noisy.collisions()
    rows, alike = [], True
    for own in islice(exact.collisions(), collisions):
        other = next(others, None) if alike else None
        alike = other is not None and (other.i, other.j) == (own.i, own.j)
        if other is None or not alike:
            rows.append([math.inf] * 3)
            continue
        pairs = zip(exact.balls, noisy.balls, strict=True)
        offsets = [mine.position(own.time) - yours.position(own.time) for mine, yours in pairs]
        errors = [
            abs(own.time - other.time),
            abs(own.impulse - other.impulse),
            *(abs(offset.real) + abs(offset.imag) for offset in offsets),
        ]
        relative = [float(error.mid() / SHIFT) for error in errors]
        rows.append([*relative[:2], max(relative[2:])])
    return np.array(rows).reshape(-1, 3).T


def content(case: ReferenceScene) -> dict[str, Any]:
    """A scene's file."""
    scene = case.start()
    events, states = trajectory(scene, case.collisions)
    number = len(events)
    grown = growth(scene, number)
    after = sorted({number * k // STATES for k in range(1, STATES + 1)})
    columns = (events.time, events.i, events.j, events.impulse)
    growths = [
        [float(f"{value:.2e}") for value in column]
        for column in (grown.time, grown.impulse, grown.place)
    ]
    return {
        "what": case.description,
        "made by": f"python tests/make_reference.py, with snooker {__version__}'s exact twin in "
        f"intervals, and growths in {BITS} bits",
        "scene": {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in vars(scene).items()
            if isinstance(value, np.ndarray)
        }
        | {
            "restitution": scene.restitution,
            "wall_restitution": scene.wall_restitution,
            "container_radius": scene.container.size[0] / 2,
            "container_mass": scene.container_mass if scene.free else None,
        },
        "events": [
            list(row)
            for row in zip(*(column.tolist() for column in columns), *growths, strict=True)
        ],
        "states": [{"events": k, "bodies": states[k].tolist()} for k in after],
    }


def text(content: dict[str, Any]) -> str:
    """JSON with a line for each event and each state."""
    fields = []
    for key, value in content.items():
        line = json.dumps(value, allow_nan=False)
        if isinstance(value, list):
            line = "[\n" + ",\n".join(json.dumps(row, allow_nan=False) for row in value) + "\n]"
        fields.append(f"{json.dumps(key)}: {line}")
    return "{\n" + ",\n".join(fields) + "\n}\n"


def main(names: list[str]) -> None:
    """Write the named references, or all."""
    FOLDER.mkdir(exist_ok=True)
    for name in names or ALL:
        path = FOLDER / f"{name}.json"
        path.write_text(text(content(ALL[name])), encoding="utf-8")
        print(path.name, path.stat().st_size, "bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
