"""The models of a container and of the balls in it: what may be written, and in which unit."""

import difflib
import math
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
)

from snooker_cli.config import quantities as q


class Model(BaseModel):
    """Frozen, and strict about keys, types and finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class _Sparse(Model):
    """Written without the keys that are absent, as if they did not exist.

    So a container that is a circle is written as before there were others, with its old digest.
    """

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data: dict[str, Any] = handler(self)
        return {
            key: value
            for key, value in data.items()
            if value is not None and (key, value) != ("shape", "circle")
        }


class Container(_Sparse):
    """The container, centred at the origin."""

    shape: q.Shape = Field(
        default="circle",
        description="What it is: a circle, a box with four walls, or a periodic box without any.",
    )
    radius: q.Positive | None = Field(
        default=None,
        description="Inner radius of the circle, m; absent: follows from packing.",
    )
    width: q.Positive | None = Field(
        default=None,
        description="Inner width of the box, along x, m; absent: follows from packing.",
    )
    height: q.Positive | None = Field(
        default=None,
        description="Inner height of the box, along y, m; absent: as width, a square.",
    )
    packing: q.Fraction | None = Field(
        default=None,
        description="Fraction of the container's area that balls given by count cover together. "
        "Of this, the container's size and the balls' radii two are given, the third follows.",
    )
    mass: q.WallMass = Field(
        default=math.inf,
        description="Mass of a circle, kg; .inf (the default), or null, is a fixed wall. Boxes "
        "are fixed.",
    )

    @property
    def size(self) -> tuple[float, float] | None:
        """Width and height, m, where they are given; of a circle both are the diameter."""
        if self.shape == "circle":
            return None if self.radius is None else (2 * self.radius, 2 * self.radius)
        if self.width is None:
            return None
        return self.width, self.width if self.height is None else self.height


class Rings(Model):
    """Equal balls on concentric rings, one at the centre: 1 + 3n(n+1) balls for n rings.

    Ring k of n holds 6k balls at radius k/n · ring_extent · container.radius.
    """

    rings: q.Rings = Field(
        description="Number of rings n around the central ball; 1 + 3n(n+1) balls."
    )
    radius: q.Positive = Field(description="Radius of every ball, m.")
    mass: q.Mass = Field(default=1.0, description="Mass of every ball, kg.")
    speed: q.NotNegative = Field(description="Speed of every ball at the start, m/s.")
    ring_extent: q.Fraction = Field(
        default=0.8,
        description="Radius of the outermost ring, as a fraction of the container radius.",
    )


class Ball(Model):
    """One ball."""

    position: q.Pair = Field(description="Position [x, y] of the ball's centre at the start, m.")
    velocity: q.Pair = Field(description="Velocity [u, v] at the start, m/s.")
    radius: q.Positive = Field(description="Radius of the ball, m.")
    mass: q.Mass = Field(default=1.0, description="Mass of the ball, kg.")


class BallList(Model):
    """Balls given one by one."""

    list: Annotated[tuple[Ball, ...], Field(min_length=1), BeforeValidator(q.as_tuple)] = Field(
        description="The balls, each with position, velocity, radius and (default 1 kg) mass."
    )


class Species(_Sparse):
    """Any number of equal balls."""

    count: q.Number = Field(description="Number of balls.")
    radius: q.Positive | None = Field(
        default=None, description="Radius of every ball, m; absent: follows from packing."
    )
    mass: q.Mass = Field(default=1.0, description="Mass of every ball, kg.")
    speed: q.NotNegative = Field(
        description="Speed of every ball at the start, m/s; for speeds: maxwell the root mean "
        "square. In a periodic box the velocity of the centre of mass is taken off all and the "
        "kinetic energy then restored."
    )
    speeds: q.Speeds = Field(
        default="equal",
        description="Speeds at the start: equal, or those of Maxwell's distribution. Directions "
        "are random.",
    )
    start: q.Start | None = Field(
        default=None,
        description="Places at the start: a hexagonal lattice over the whole container (the "
        "default), or random. Of several species one says it for all.",
    )


class Gas(Species):
    """Any number of equal balls that fill the container."""

    packing: q.Fraction | None = Field(
        default=None,
        description="Fraction of the container's area that the balls cover. Of this, the "
        "container's size and the balls' radius two are given, the third follows.",
    )


BALLS: Mapping[str, type[Rings] | type[BallList] | type[Gas]] = {
    "rings": Rings,
    "list": BallList,
    "count": Gas,
}
"""The ways to give balls in a mapping, by the key that tells them apart."""


def balls_variant(value: object) -> str | None:
    """The key in BALLS that `balls:` evidently goes by, misspelt or not; None when unclear.

    A list is one of species.
    """
    if isinstance(value, list | tuple):
        return "species"
    for key, model in BALLS.items():
        if isinstance(value, model):
            return key
    if not isinstance(value, Mapping):
        return None
    given = [key for key in BALLS if key in value]
    if not given:
        known = {name for model in BALLS.values() for name in model.model_fields}
        unknown = [str(key).lower() for key in value if key not in known]
        given = [key for key in BALLS if difflib.get_close_matches(key, unknown, cutoff=0.7)]
    return given[0] if len(given) == 1 else None


AllSpecies = Annotated[tuple[Species, ...], Field(min_length=1), BeforeValidator(q.as_tuple)]

Balls = Annotated[
    Annotated[Rings, Tag("rings")]
    | Annotated[BallList, Tag("list")]
    | Annotated[Gas, Tag("count")]
    | Annotated[AllSpecies, Tag("species")],
    Discriminator(
        balls_variant,
        custom_error_type="balls",
        custom_error_message="one of rings, list and count is needed",
    ),
]
