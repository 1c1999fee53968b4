"""The frozen models of a configuration: what may be written, in which unit, in which range."""

import difflib
import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    PlainValidator,
    Tag,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
)
from pydantic_core import PydanticCustomError

from snooker_cli.config.axes import Axes, axes

MAX_RINGS = 1000
"""1 + 3·1000·1001 = 3,003,001 balls."""

MAX_INTEGER = 2**63 - 1
"""What fits a 64-bit integer, and so every file and array."""


def _needs(phrase: str) -> WrapValidator:
    """One error for whatever is wrong with a value, which says what is needed instead."""

    def checked(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise PydanticCustomError("needs", "{needs} is needed", {"needs": phrase}) from None

    return WrapValidator(checked)


def _whole(value: object) -> object:
    """3.0 and 1e6 are whole numbers too."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _positive_zero(value: float) -> float:
    """−0.0 means 0.0, and must not change a digest."""
    return value + 0.0


def _infinite_if_absent(value: object) -> object:
    """JSON has no infinity, so null stands for it."""
    return math.inf if value is None else value


def _printable(title: str) -> str:
    if not title.isprintable():
        raise ValueError
    return title


def _tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Coordinate = Annotated[float, AfterValidator(_positive_zero)]
Pair = Annotated[
    tuple[Coordinate, Coordinate],
    BeforeValidator(_tuple),
    _needs("a pair of finite numbers [x, y]"),
]
Positive = Annotated[float, Field(gt=0), _needs("a finite number above 0")]
NotNegative = Annotated[
    float, Field(ge=0), AfterValidator(_positive_zero), _needs("a finite number of 0 or more")
]
Fraction = Annotated[float, Field(gt=0, le=1), _needs("a number above 0, at most 1")]
Restitution = Annotated[
    float, Field(ge=0, le=1), AfterValidator(_positive_zero), _needs("a number from 0 to 1")
]
Count = Annotated[
    int,
    Field(ge=1, le=MAX_INTEGER),
    BeforeValidator(_whole),
    _needs("a whole number of 1 or more (below 2^63)"),
]
Seed = Annotated[
    int,
    Field(ge=0, le=MAX_INTEGER),
    BeforeValidator(_whole),
    _needs("a whole number of 0 or more (below 2^63)"),
]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Container(_Model):
    """The circular container, centred at the origin."""

    radius: Positive = Field(description="Inner radius of the container, m.")
    mass: Annotated[
        float,
        Field(gt=0, allow_inf_nan=True),
        BeforeValidator(
            _infinite_if_absent, json_schema_input_type=Annotated[float, Field(gt=0)] | None
        ),
        _needs("a number above 0, or .inf for a fixed wall"),
    ] = Field(
        default=math.inf,
        description="Mass of the container, kg; .inf (the default), or null, is a fixed wall.",
    )


class Rings(_Model):
    """Equal balls on concentric rings, one at the centre: 1 + 3n(n+1) balls for n rings.

    Ring k of n holds 6k balls at radius k/n · ring_extent · container.radius.
    """

    rings: Annotated[
        int,
        Field(ge=0, le=MAX_RINGS),
        BeforeValidator(_whole),
        _needs(f"a whole number from 0 to {MAX_RINGS}"),
    ] = Field(description="Number of rings n around the central ball; 1 + 3n(n+1) balls.")
    radius: Positive = Field(description="Radius of every ball, m.")
    mass: Positive = Field(default=1.0, description="Mass of every ball, kg.")
    speed: NotNegative = Field(description="Speed of every ball at the start, m/s.")
    ring_extent: Fraction = Field(
        default=0.8,
        description="Radius of the outermost ring, as a fraction of the container radius.",
    )


class Ball(_Model):
    """One ball."""

    position: Pair = Field(description="Position [x, y] of the ball's centre at the start, m.")
    velocity: Pair = Field(description="Velocity [u, v] at the start, m/s.")
    radius: Positive = Field(description="Radius of the ball, m.")
    mass: Positive = Field(default=1.0, description="Mass of the ball, kg.")


class BallList(_Model):
    """Balls given one by one."""

    list: Annotated[tuple[Ball, ...], Field(min_length=1), BeforeValidator(_tuple)] = Field(
        description="The balls, each with position, velocity, radius and (default 1 kg) mass."
    )


BALLS: Mapping[str, type[Rings] | type[BallList]] = {"rings": Rings, "list": BallList}
"""The ways to give balls, by the key that tells them apart."""


def balls_variant(value: object) -> str | None:
    """The key in BALLS that `balls:` evidently goes by, misspelt or not; None when unclear."""
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


class Experiment(_Model):
    """A snooker experiment: inelastic hard disks in a circular container."""

    title: (
        Annotated[
            str,
            Field(min_length=1, max_length=200),
            AfterValidator(_printable),
            _needs("one line of printable text of at most 200 characters"),
        ]
        | None
    ) = Field(default=None, description="Name shown in tables.")
    container: Container = Field(description="Circular container.")
    balls: Annotated[
        Annotated[Rings, Tag("rings")] | Annotated[BallList, Tag("list")],
        Discriminator(
            balls_variant,
            custom_error_type="balls",
            custom_error_message="either rings or list is needed",
        ),
    ] = Field(description="Balls at the start: rings of equal balls, or a list of balls.")
    cor: Restitution = Field(
        description="Coefficient of restitution between balls, 0 (no rebound) to 1 (elastic)."
    )
    wall_cor: Restitution | None = Field(
        default=None,
        description="Coefficient of restitution at the wall, 0 to 1; absent or null: as cor.",
    )
    collisions: Count | None = Field(
        default=None,
        description="Stop after this many collisions; with `time`, whichever comes first.",
    )
    time: Positive | None = Field(
        default=None,
        validate_default=True,
        description="Stop at this time, s; with `collisions`, whichever comes first.",
    )
    repeats: Count = Field(
        default=1, description="Runs of every point, each with its own random start."
    )
    seed: Seed = Field(default=1, description="Seed of the random starts.")
    record: Annotated[Literal["events", "summary"], _needs("one of events, summary")] = Field(
        default="events", description="What is stored: every collision, or only a summary."
    )
    sweep: Annotated[
        Axes,
        PlainValidator(axes, json_schema_input_type=dict[str, list[Any]]),
        PlainSerializer(dict, return_type=dict[str, Any]),
    ] = Field(
        default=(),
        description="A grid over keys (dotted paths): lists of values; the last key runs fastest.",
    )

    @field_validator("time")
    @classmethod
    def _has_an_end(cls, time: float | None, info: ValidationInfo) -> float | None:
        # A `collisions` that failed its own check is not in info.data: it was given.
        if time is None and info.data.get("collisions", 0) is None:
            raise PydanticCustomError("endless", "collisions or time is needed")
        return time

    @property
    def effective_wall_cor(self) -> float:
        """Coefficient of restitution at the wall, `cor` unless `wall_cor` is given."""
        return self.cor if self.wall_cor is None else self.wall_cor
