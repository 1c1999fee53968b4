"""Scenes of the studies: gases, and for the exact twin the source report's scene and variants."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from snooker_cli.config import Experiment, load
from snooker_cli.placement.places import DIGITS
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene


def lattice_gas(container: Mapping[str, Any], cor: float = 1.0, **balls: Any) -> Experiment:
    """Equal balls on a lattice with Maxwell's speeds, 10 m/s (root mean square)."""
    balls |= {"speed": 10.0, "speeds": "maxwell"}
    known = {"container": dict(container), "balls": balls, "cor": cor, "collisions": 1, "seed": 1}
    return load(known).experiment


@dataclass(frozen=True)
class ReferenceScene:
    """A scene for the exact twin.

    collisions : as many are followed
    start : the scene of a repeat, or the only one
    exponent : its Lyapunov exponent, 1/event, from pairs of runs that start one rounding apart
    """

    name: str
    description: str
    collisions: int
    start: Callable[..., Scene]
    exponent: float | None = None


def rings(
    repeat: int = 0,
    *,
    radius: float = 1.0,
    restitution: float = 1.0,
    container_mass: float = 1e7,
    number: int = 3,
) -> Scene:
    """The source report's balls: on rings, at 10 m/s in random directions of each repeat.

    A repeat has the same directions in all scenes: tests/reference has results of these starts.
    """
    known = {
        "container": {"radius": 10.0, "mass": container_mass},
        "balls": {"rings": number, "radius": radius, "speed": 10.0, "ring_extent": 0.8},
        "cor": restitution,
        "collisions": 500,
        "seed": 1,
        "common_random": True,
    }
    return starting_scene(load(known).experiment, repeat)


def mixture() -> Scene:
    """The source report's balls with radii of 0.4 to 1 m, masses of 0.2 to 5 kg, and cor 0.9."""
    scene = rings(restitution=0.9, container_mass=20.0)
    return replace(
        scene,
        radii=np.linspace(1.0, 0.4, scene.number),
        masses=geometric(0.2, 5.0, scene.number),
    )


def geometric(first: float, last: float, number: int) -> NDArray[np.float64]:
    """A geometric sequence of ``number`` values from first to last, each correctly rounded.

    NumPy's ``geomspace`` rounds differently on different processors.
    """
    with localcontext() as context:
        context.prec = DIGITS
        start, ratio = Decimal(first), Decimal(last) / Decimal(first)
        powers = (ratio ** (Decimal(k) / max(number - 1, 1)) for k in range(number))
        return np.array([float(start * power) for power in powers])


def reference_scene(known: Mapping[str, Any]) -> ReferenceScene:
    """A scene of plans.yaml."""
    settings = {key: value for key, value in known.items() if key != "rings"}
    start = partial(rings, **known["rings"]) if "rings" in known else mixture
    return ReferenceScene(start=start, **settings)


PlannedScene = Annotated[ReferenceScene, BeforeValidator(reference_scene)]
