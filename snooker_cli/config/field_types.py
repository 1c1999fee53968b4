"""Types of the values in a configuration: their ranges, and the phrase that states each."""

import math
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

from snooker_cli.containers import SHAPES, ShapeName

MAX_RINGS = 1000
"""1 + 3·1000·1001 = 3,003,001 balls."""

MAX_COUNT = 1_000_000
"""Balls of one species."""

MAX_BALLS = 10_000_000
"""Balls of all species; their start takes half a minute and 2 GB."""

MAX_INTEGER = 2**63 - 1
"""The largest 64-bit integer, for files and arrays."""

Form = Literal["number", "number or infinity", "pair", "other"]
"""What a key takes; the advice about a wrong value depends on it."""


def needs(phrase: str, form: Form = "number") -> PydanticCustomError:
    """The error of a value that is wrong in any way, with what is needed instead."""
    return PydanticCustomError("needs", "{needs} is needed", {"needs": phrase, "form": form})


def _needs(phrase: str, form: Form = "number") -> WrapValidator:
    """Replaces the errors about a value by one."""

    def checked(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise needs(phrase, form) from None

    return WrapValidator(checked)


def _whole(value: object) -> object:
    """Accepts 3.0 and 1e6 as whole numbers."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _positive_zero(value: float) -> float:
    """Turns −0.0 into 0.0, which must have the same digest."""
    return value + 0.0


def _infinite_if_absent(value: object) -> object:
    """Reads null, which stands for infinity in JSON."""
    return math.inf if value is None else value


def _printable(title: str) -> str:
    if not title.isprintable():
        raise ValueError
    return title


def as_tuple(value: object) -> object:
    """Turns a list into a tuple, which is immutable."""
    return tuple(value) if isinstance(value, list) else value


_ZERO = AfterValidator(_positive_zero)
_WHOLE = BeforeValidator(_whole)

Pair = Annotated[
    tuple[Annotated[float, _ZERO], Annotated[float, _ZERO]],
    BeforeValidator(as_tuple),
    _needs("a pair of finite numbers [x, y]", "pair"),
]
Positive = Annotated[float, Field(gt=0), _needs("a finite number above 0")]
Mass = Annotated[float, Field(ge=1e-100, le=1e100), _needs("a number from 1e-100 to 1e100")]
NotNegative = Annotated[float, Field(ge=0), _ZERO, _needs("a finite number of 0 or more")]
Fraction = Annotated[float, Field(gt=0, le=1), _needs("a number above 0, at most 1")]
Restitution = Annotated[float, Field(ge=0, le=1), _ZERO, _needs("a number from 0 to 1")]
Count = Annotated[
    int, Field(ge=1, le=MAX_INTEGER), _WHOLE, _needs("a whole number of 1 or more (below 2^63)")
]
Seed = Annotated[
    int, Field(ge=0, le=MAX_INTEGER), _WHOLE, _needs("a whole number of 0 or more (below 2^63)")
]
RingNumber = Annotated[
    int, Field(ge=0, le=MAX_RINGS), _WHOLE, _needs(f"a whole number from 0 to {MAX_RINGS}")
]
Number = Annotated[
    int, Field(ge=1, le=MAX_COUNT), _WHOLE, _needs(f"a whole number from 1 to {MAX_COUNT:,}")
]
WallMass = Annotated[
    float,
    Field(gt=0, allow_inf_nan=True),
    BeforeValidator(
        _infinite_if_absent, json_schema_input_type=Annotated[float, Field(gt=0)] | None
    ),
    _needs("a number above 0, or .inf for a fixed wall", "number or infinity"),
]
Title = Annotated[
    str,
    Field(min_length=1, max_length=200),
    AfterValidator(_printable),
    _needs("one line of printable text of at most 200 characters", "other"),
]
Shape = Annotated[ShapeName, _needs(f"one of {', '.join(SHAPES)}", "other")]
Start = Annotated[Literal["lattice", "random"], _needs("one of lattice, random", "other")]
Speeds = Annotated[Literal["equal", "maxwell"], _needs("one of equal, maxwell", "other")]
COLLAPSE = "stop, slide, {tc: NUMBER} or {elastic_below: NUMBER}"
CollapseWord = Annotated[Literal["stop", "slide"], _needs(COLLAPSE, "other")]
Record = Annotated[Literal["events", "summary"], _needs("one of events, summary", "other")]
