"""A point of an experiment and a repeat -> the scene it starts from, the same bits everywhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from snooker_cli.arrange import gas
from snooker_cli.arrange.rings import check_rings, ring_positions, unit_polygon
from snooker_cli.arrange.streams import random_directions
from snooker_cli.config import BallList, Rings
from snooker_cli.scene import Scene, SceneError, check

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.config import Experiment

    Floats = NDArray[np.float64]

__all__ = ["arrange", "random_directions", "ring_positions", "unit_polygon"]


def arrange(experiment: Experiment, repeat: int) -> Scene:
    """The start of a repeat of a point.

    The same repeat has the same random directions at every point of a sweep (common random
    numbers). Raises ``SceneError`` if balls overlap or stick out of the container.
    """
    container, balls = experiment.container, experiment.balls
    size = container.size
    if isinstance(balls, Rings):
        assert container.radius is not None
        columns = _of_rings(balls, container.radius, experiment.seed, repeat)
    elif isinstance(balls, BallList):
        columns = _of_list(balls)
    else:
        room, radii = gas.room_and_radii(experiment)
        size = room.size
        columns = (
            gas.start_positions(experiment, room, radii, repeat),
            gas.start_velocities(experiment, repeat),
            gas.each_ball(experiment, radii),
            gas.each_ball(experiment, [each.mass for each in experiment.species]),
        )
    assert size is not None
    circle = container.shape == "circle"
    scene = Scene(
        *columns,
        container_radius=size[0] / 2 if circle else math.nan,
        container_mass=container.mass,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=experiment.cor,
        wall_restitution=experiment.effective_wall_cor,
        shape=container.shape,
        width=math.nan if circle else size[0],
        height=math.nan if circle else size[1],
        contact_duration=experiment.contact_duration,
        elastic_below=experiment.elastic_below,
        slides=experiment.collapse == "slide",
    )
    try:
        check(scene)
    except SceneError as error:
        if isinstance(balls, BallList) and error.ball is not None:
            raise SceneError(f"balls.list[{error.ball}]", str(error), error.ball) from None
        raise
    return scene


def _of_rings(
    balls: Rings, container_radius: float, seed: int, repeat: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, velocities, radii and masses of balls on rings."""
    check_rings(balls, container_radius)
    positions = ring_positions(balls.rings, balls.ring_extent * container_radius)
    number = len(positions)
    velocities = balls.speed * random_directions(number, seed, repeat)
    return positions, velocities, np.full(number, balls.radius), np.full(number, balls.mass)


def _of_list(balls: BallList) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, velocities, radii and masses of balls given one by one."""
    return (
        np.array([ball.position for ball in balls.list]),
        np.array([ball.velocity for ball in balls.list]),
        np.array([ball.radius for ball in balls.list]),
        np.array([ball.mass for ball in balls.list]),
    )
