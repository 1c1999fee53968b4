"""The ranges of values in configs, laws and files, each with the phrase of its errors."""

import math
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

from snooker_cli import containers

STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True)
"""Strict about keys, types and finite numbers."""


class Model(BaseModel):
    """Frozen, and strict about keys, types and finite numbers."""

    model_config = ConfigDict(frozen=True, **STRICT)


MAX_INTEGER = 2**63 - 1  # the largest 64-bit integer, for files and arrays


def needs(phrase: str, is_number: bool = True) -> WrapValidator:
    """Replaces the errors about a value by one, with what is needed."""

    def validated(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError:
            context = {"needs": phrase, "is_number": is_number}
            raise PydanticCustomError("needs", "{needs} is needed", context) from None

    return WrapValidator(validated)


FROM_LIST = Field(strict=False)  # reads a list as a tuple, which is immutable

POSITIVE_ZERO = AfterValidator(lambda value: value + 0.0)
"""Turns −0.0 into 0.0, which must have the same digest."""

WHOLE = BeforeValidator(
    lambda value: int(value) if isinstance(value, float) and value.is_integer() else value
)
"""Accepts 3.0 and 1e6 as whole numbers."""

Coordinate = Annotated[float, POSITIVE_ZERO]
Pair = Annotated[
    tuple[Coordinate, Coordinate], FROM_LIST, needs("a pair of finite numbers [x, y]", False)
]
LawSpeed = Annotated[
    float,
    Field(ge=containers.LEAST_SPEED, le=containers.MOST_SPEED),
    needs("a number above 0 (from 1e-150 to 1e150)"),
]
"""A speed of a law: any other speed over it is a double."""
Amount = Annotated[
    float,
    Field(ge=containers.LEAST_AMOUNT, le=containers.MOST_AMOUNT),
    needs("a number above 0 (from 1e-50 to 1e50)"),
]
"""A length or a mass: areas and energies are doubles."""
Speed = Annotated[
    float,
    Field(ge=0, le=containers.MOST_SPEED),
    POSITIVE_ZERO,
    needs("a number of 0 or more (at most 1e150)"),
]
Duration = Annotated[
    float, Field(ge=containers.LEAST_TIME), needs("a finite number of at least 1e-250")
]
Fraction = Annotated[float, Field(gt=0, le=1), needs("a number above 0, at most 1")]
Inertia = Annotated[
    float,
    Field(ge=containers.LEAST_AMOUNT, le=1),
    needs("a number above 0 (from 1e-50), at most 1"),
]
TangentialCor = Annotated[
    float,
    Field(ge=-1, le=1),
    POSITIVE_ZERO,
    needs("a number from -1 (smooth) to 1 (perfectly rough)"),
]
Friction = Annotated[float, Field(ge=0), POSITIVE_ZERO, needs("a finite number of 0 or more")]
Restitution = Annotated[float, Field(ge=0, le=1), POSITIVE_ZERO, needs("a number from 0 to 1")]
Count = Annotated[
    int, Field(ge=1, le=MAX_INTEGER), WHOLE, needs("a whole number of 1 or more (below 2^63)")
]
Switch = Annotated[bool, needs("true or false", False)]
Index = Annotated[
    int, Field(ge=0, le=MAX_INTEGER), WHOLE, needs("a whole number of 0 or more (below 2^63)")
]
RingNumber = Annotated[int, Field(ge=0, le=1000), WHOLE, needs("a whole number from 0 to 1000")]
Number = Annotated[
    int, Field(ge=1, le=1_000_000), WHOLE, needs("a whole number from 1 to 1,000,000")
]
ZERO_OR_A_SPEED = "0 or a number from 1e-150 to 1e50"


def _zero_or_a_speed(value: float) -> float:
    if 0 < value < containers.LEAST_SPEED:
        raise ValueError
    return value


WallSpeed = Annotated[
    float,
    Field(ge=0, le=containers.MOST_AMOUNT),
    POSITIVE_ZERO,
    AfterValidator(_zero_or_a_speed),
    needs(ZERO_OR_A_SPEED),
]
DrivingSpeed = Annotated[WallSpeed, Field(gt=0)]
WallMass = Annotated[
    float,
    Field(gt=0, allow_inf_nan=True),
    BeforeValidator(
        lambda value: math.inf if value is None else value,
        json_schema_input_type=Annotated[float, Field(gt=0)] | None,
    ),
    needs("a number above 0, or .inf for a fixed wall"),
]
