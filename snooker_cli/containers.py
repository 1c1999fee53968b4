"""The room that a circle, a box or a periodic box leaves to balls of one radius."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Container:
    """A container as equal balls of one radius meet it.

    Attributes
    ----------
    area : float
        Of the whole container (m²).
    wall : float
        Length of its wall (m); 0 without walls.
    accessible_area, accessible_wall : float
        Of the region that the balls' centres can reach (m²), and the length of its edge (m).
    spreading : float
        By how much that edge grows for each metre that all of the wall moves outwards: 2π for a
        circle, 8 for a box.
    """

    area: float
    wall: float
    accessible_area: float
    accessible_wall: float
    spreading: float


def circle(container_radius: float, ball_radius: float) -> Container:
    """A circular wall; the centres stay within a = R − r."""
    accessible = container_radius - ball_radius
    return Container(
        area=math.pi * container_radius**2,
        wall=2 * math.pi * container_radius,
        accessible_area=math.pi * accessible**2,
        accessible_wall=2 * math.pi * accessible,
        spreading=2 * math.pi,
    )


def box(width: float, height: float, ball_radius: float) -> Container:
    """Four straight walls; the centres stay within (w − 2r)(h − 2r)."""
    across, along = width - 2 * ball_radius, height - 2 * ball_radius
    return Container(
        area=width * height,
        wall=2 * (width + height),
        accessible_area=across * along,
        accessible_wall=2 * (across + along),
        spreading=8.0,
    )


def periodic_box(width: float, height: float) -> Container:
    """No walls: the centres can be everywhere."""
    area = width * height
    return Container(area=area, wall=0.0, accessible_area=area, accessible_wall=0.0, spreading=0.0)
