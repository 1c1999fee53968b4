"""What collisions do to the balls: the laws that configs, scenes, files and pages have.

A law is a name and numbers with their ranges. What it does to the normal speed is in
``engine.restitution``, and what a rough surface does along the tangent in ``engine.surfaces``. One
of an installed package has a function of its own, see `PackageLaw`.
"""

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from inspect import getattr_static, signature
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    BeforeValidator,
    Field,
    PlainSerializer,
    PlainValidator,
    TypeAdapter,
    model_validator,
)
from pydantic.dataclasses import dataclass

from snooker_cli.plugins import PluginError, Table
from snooker_cli.ranges import (
    STRICT,
    Amount,
    DrivingSpeed,
    Inertia,
    LawSpeed,
    Restitution,
    Switch,
    TangentialCor,
)


class Law:
    """What a hit does to the speed along the line of centres.

    name : in files
    adds_energy : whether hits can give energy to the balls, as only those of a wall may
    is_random : whether hits need random numbers
    cor : the coefficient of restitution e, 0 to 1, of fast collisions
    """

    name: ClassVar[str]
    adds_energy = False
    is_random = False

    cor: float

    @property
    def parts(self) -> "tuple[Law, ...]":
        """The laws of the sides of a wall, or the only law."""
        return (self,)

    @classmethod
    def numbers(cls) -> tuple[str, ...]:
        """The names of its numbers."""
        return tuple(field.name for field in fields(cls))  # type: ignore[arg-type]

    def as_json(self) -> dict[str, Any]:
        """The law as files have it."""
        return {"name": self.name, **{name: getattr(self, name) for name in self.numbers()}}


@dataclass(frozen=True, config=STRICT)
class Constant(Law):
    """One coefficient of restitution for all speeds."""

    name = "constant"

    cor: Restitution


@dataclass(frozen=True, config=STRICT)
class Viscoelastic(Law):
    """Restitution that depends on the normal speed v: 1 - (1 - e) (v/v0)^(3/4) below v0, else e.

    Slow collisions are almost elastic (Bizon et al., Phys. Rev. Lett. 80, 57 (1998)).

    cor_speed : v0, m/s
    """

    name = "viscoelastic"

    cor: Restitution
    cor_speed: LawSpeed


@dataclass(frozen=True, config=STRICT)
class Driven(Law):
    """A wall that moves inwards at a speed V whenever it is hit, and is always at the same place.

    This is saw-tooth driving of vanishing amplitude. A ball leaves with e v_n + (1 + e) V.

    speed : V, m/s
    """

    name = "driven"
    adds_energy = True

    cor: Restitution
    speed: DrivingSpeed


@dataclass(frozen=True, config=STRICT)
class Thermal(Law):
    """A wall with a temperature: a ball leaves it with a random velocity of Maxwell's flux.

    It keeps nothing of its normal speed, so its CoR is 0.

    temperature : J
    """

    name = "thermal"
    adds_energy = True
    is_random = True
    cor = 0.0

    temperature: Amount


LAWS: dict[str, type[Law]] = {law.name: law for law in (Constant, Viscoelastic, Driven, Thermal)}
"""The laws of one contact by their names; the first is the default."""


# Laws of installed packages

MOST_NUMBERS = 4
"""Numbers that a law of a package can have, with ``cor``."""


class PackageLaw(Law):
    """A law of an installed package: any e(v) from 0 to 1 for contacts that give no energy.

    It has the field ``cor``, which is that of the config, and numbers of its own. In files it also
    has its ``origin``: distribution, version and the hash of the sources. So results of other
    sources are never taken for those of these.
    """

    @staticmethod
    def restitution(speed: float, *numbers: float) -> float:
        """The coefficient of restitution at a normal speed, m/s; for kernels too.

        numbers : ``cor`` and the others, in the order of the fields

        Kernels give the same bits on every machine for ``+ - * /``, ``math.sqrt``, ``min``, ``max``
        and ``if``.
        """
        raise NotImplementedError

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers in order."""
        return tuple(getattr(self, name) for name in self.numbers())

    def cor_at(self, speed: float) -> float:
        """The coefficient of restitution at a normal speed, m/s, with the law's own numbers."""
        return self.restitution(speed, *self.values)

    @property
    def origin(self) -> str:
        """Where it comes from, see `origin_of`."""
        return origin_of(self.name)

    @property
    def problem(self) -> str:
        """Why it cannot be used; empty if it can."""
        return ""

    def as_json(self) -> dict[str, Any]:
        return {**super().as_json(), "origin": self.origin}

    def in_config(self) -> dict[str, Any]:
        """The law as a config has it: its CoR is another key."""
        return {key: value for key, value in self.as_json().items() if key != "cor"}

    def with_cor(self, cor: float) -> "PackageLaw":
        """The law with the CoR of a config."""
        return replace(self, cor=cor)  # type: ignore[type-var]  # a dataclass

    def __reduce__(self) -> Any:
        """By what is written: another process may lack the package, or have another version."""
        return law_from, (self.as_json(),)


@dataclass(frozen=True, config=STRICT)
class AbsentLaw(PackageLaw):
    """A law that a file names and that is not installed like this: it can be read and compared.

    written : its name, numbers and origin
    """

    written: tuple[tuple[str, str | float], ...]

    def __getattr__(self, name: str) -> Any:
        """A number of the law, as a point of a sweep of it has it."""
        numbers = dict(vars(self).get("written", ()))
        if name not in numbers:
            raise AttributeError(f"the law has no {name}")
        return numbers[name]

    @property
    def name(self) -> str:  # type: ignore[override]
        return str(dict(self.written)["name"])

    @property
    def cor(self) -> float:  # type: ignore[override]
        return float(dict(self.written)["cor"])

    @property
    def origin(self) -> str:
        return str(dict(self.written)["origin"])

    @property
    def problem(self) -> str:
        distribution, version, *_ = self.origin.split()
        where = f"the law {self.name} is of {distribution} {version}"
        if self.name not in installed_laws():
            return f"{where}, which is {EVERY_LAW.absence(distribution)}"
        return f"{where} with other sources than {origin_of(self.name)}, which is installed"

    def as_json(self) -> dict[str, Any]:
        return dict(self.written)

    def with_cor(self, cor: float) -> "PackageLaw":
        return absent_law({**self.as_json(), "cor": cor})


def absent_law(written: Mapping[str, Any]) -> AbsentLaw:
    """A law that is not installed, with its numbers in the order of files."""
    numbers = {key: value for key, value in written.items() if key not in ("name", "cor", "origin")}
    ordered = {"name": written["name"], "cor": written["cor"], **numbers}
    return AbsentLaw((*ordered.items(), ("origin", written["origin"])))


def _taken(thing: object) -> tuple[str, type[PackageLaw]]:
    """What a distribution adds to ``EVERY_LAW``. Raises ``PluginError``."""
    if not (isinstance(thing, type) and issubclass(thing, PackageLaw)):
        raise PluginError("it is no PackageLaw", "name a class that inherits from it")
    names = thing.numbers() if hasattr(thing, "__dataclass_fields__") else ()
    if names[:1] != ("cor",) or not 1 < len(names) <= MOST_NUMBERS:
        advice = "make it a class of numbers with `@law`"
        raise PluginError(f"its fields are not `cor` and up to {MOST_NUMBERS - 1} others", advice)
    if not isinstance(getattr(thing, "name", None), str):
        raise PluginError("it has no name", 'give it one, as `name = "yielding"`')
    for field, known in thing.__pydantic_fields__.items():  # type: ignore[attr-defined]
        if known.annotation is not float:
            raise PluginError(f"its field {field} is no float", "give it a type of numbers")
    if not isinstance(getattr_static(thing, "restitution"), staticmethod):
        raise PluginError("restitution is no static method", "write `@staticmethod` above it")
    arguments = [*signature(thing.restitution).parameters]
    if arguments[1:] != [*names]:
        expected = ", ".join(["speed", *names])
        raise PluginError(f"restitution has the arguments {', '.join(arguments)}, not {expected}")
    if thing.name == Sides.name:
        raise PluginError(f"snooker has {thing.name} itself", "give it another name")
    if thing.adds_energy or thing.is_random:
        raise PluginError("its contacts give energy or are random, which packages cannot add")
    return thing.name, thing


EVERY_LAW: Table[type[Law]] = Table("snooker.laws", LAWS, _taken)
"""The laws of one contact by their names, with those of installed packages."""


def installed_laws() -> dict[str, type[PackageLaw]]:
    """The laws of installed packages by their names."""
    return {name: law for name, law in EVERY_LAW.items() if issubclass(law, PackageLaw)}


law = dataclass(frozen=True, config=STRICT)
"""Makes a class a law: its fields become numbers that are checked."""


def origin_of(name: str) -> str:
    """Distribution, version and hash of the sources of a law of a package, in one text."""
    origin = EVERY_LAW.origin(name)
    return " ".join([*origin[:2], origin[2][:16]]) if origin else ""


def law_from(written: Any) -> Law:
    """A law from a file. Raises ``ValueError`` for numbers that no config gives."""
    if isinstance(written, Law):
        return written
    numbers = dict(written)
    name = numbers.pop("name", None)
    known = Sides if name == Sides.name else LAWS.get(name)
    return known(**numbers) if known else package_law(written)


def package_law(written: Mapping[str, Any]) -> PackageLaw:
    """A law of a package, or its ``AbsentLaw``. Raises ``ValueError``."""
    name, origin = written.get("name"), written.get("origin")
    numbers = {key: value for key, value in written.items() if key not in ("name", "origin")}
    if not (isinstance(name, str) and isinstance(origin, str) and len(origin.split()) > 1):
        raise ValueError(f"no law of collision has the name {name!r}")
    known = installed_laws().get(name)
    if known and origin_of(name) == origin:
        return known(**numbers)
    fit = all(type(value) is float and math.isfinite(value) for value in numbers.values())
    if not fit or not 0 <= numbers.get("cor", -1) <= 1 or len(numbers) > MOST_NUMBERS:
        raise ValueError(f"wrong numbers of the law {name!r}")
    return absent_law(written)


SIDES = "left", "right", "bottom", "top"

StoredLaw = Annotated[Law, PlainValidator(law_from), PlainSerializer(lambda law: law.as_json())]
"""A law that JSON has as its name and its numbers."""


@dataclass(frozen=True, config=STRICT)
class Sides(Law):
    """The laws of straight walls, one for each side. The CoR is the least of all."""

    name = "sides"

    left: StoredLaw
    right: StoredLaw
    bottom: StoredLaw
    top: StoredLaw

    @model_validator(mode="after")
    def _has_laws_of_one_wall(self) -> Self:
        if any(isinstance(law, Sides) for law in self.parts):
            raise ValueError
        return self

    def as_json(self) -> dict[str, Any]:
        sides = {side: getattr(self, side).as_json() for side in SIDES}
        return {"name": self.name, **sides}

    @property
    def parts(self) -> tuple[Law, ...]:
        return tuple(getattr(self, side) for side in SIDES)

    @property
    def cor(self) -> float:  # type: ignore[override]
        return min(law.cor for law in self.parts)

    @property
    def adds_energy(self) -> bool:  # type: ignore[override]
        return any(law.adds_energy for law in self.parts)

    @property
    def is_random(self) -> bool:  # type: ignore[override]
        return any(law.is_random for law in self.parts)


Friction = Annotated[
    float,
    Field(ge=0, allow_inf_nan=True),
    BeforeValidator(lambda limit: math.inf if limit is None else limit),
    PlainSerializer(lambda limit: None if limit == math.inf else limit),
]
"""The largest tangential impulse over the normal one; infinite, which JSON has as null, if there is
no limit."""


@dataclass(frozen=True, config=STRICT)
class Surface:
    """Rough balls: what a collision does along the tangent, see ``engine.surfaces``.

    inertia : q of the moment of inertia q m r², above 0, at most 1
    tangential_cor, wall_tangential_cor : β of slow slips, -1 (smooth) to 1, of two balls and at
        the wall
    friction, wall_friction : μ, the largest tangential impulse over the normal one; may be infinite
    """

    inertia: Inertia
    tangential_cor: TangentialCor
    friction: Friction
    wall_tangential_cor: TangentialCor
    wall_friction: Friction

    @property
    def rubs_wall(self) -> bool:
        """Whether hits of the wall change anything along the tangent."""
        return self.wall_tangential_cor > -1.0 and self.wall_friction > 0.0

    @property
    def elastic_pairs(self) -> bool:
        """Whether no contact of two balls takes energy."""
        return keeps_slip(self.tangential_cor, self.friction)

    @property
    def elastic_wall(self) -> bool:
        """Whether no hit of the wall takes energy."""
        return keeps_slip(self.wall_tangential_cor, self.wall_friction)


def keeps_slip(cor: float, friction: float) -> bool:
    """Whether surfaces are smooth, or turn each slip round: contacts take no energy."""
    return cor == -1 or friction == 0 or (cor == 1 and friction == math.inf)


@dataclass(frozen=True, config=STRICT)
class CollisionRules:
    """What collisions do in a scene, as files have it.

    pair_law, wall_law : between balls, and at the wall
    contact_duration : of the TC model, in mean free times; 0 without it
    elastic_below : relative normal speed below which collisions are elastic, m/s; 0 without it
    slides : whether a ball slides on after infinitely many bounces on a fixed circular wall
    surface : of rough balls; None for smooth ones, which do not spin
    """

    pair_law: StoredLaw
    wall_law: StoredLaw
    contact_duration: Annotated[float, Field(ge=0, le=1)] = 0.0
    elastic_below: Annotated[float, Field(ge=0)] = 0.0
    slides: Switch = False
    surface: Surface | None = None

    @model_validator(mode="after")
    def _balls_lose_energy(self) -> Self:
        """Two balls have one law, which adds no energy."""
        if self.pair_law.adds_energy or isinstance(self.pair_law, Sides):
            raise ValueError
        return self

    @property
    def laws(self) -> tuple[Law, ...]:
        """The law of two balls, and those of the wall."""
        return (self.pair_law, *self.wall_law.parts)

    @classmethod
    def of(cls, scene: Any) -> Self:
        """Those of a scene, which has fields of the same names."""
        return cls(*(getattr(scene, field.name) for field in fields(cls)))


RULES = TypeAdapter(CollisionRules)
"""Writes rules as JSON and reads them. Raises ``ValueError`` for what no config gives."""


# The laws that the numbers of a config give. Pages have these functions too, see `live_page`.


def law_of_pairs(cor: float, cor_speed: float | None) -> Law:
    """The law of two balls, or of a wall that gives no energy."""
    if cor_speed is not None:
        return Viscoelastic(cor, cor_speed)
    return Constant(cor)


def law_of_wall(
    cor: float, cor_speed: float | None, speed: float | None, temperature: float | None
) -> Law:
    """The law of one wall; a speed of 0 is none."""
    if temperature is not None:
        return Thermal(temperature)
    if speed:
        return Driven(cor, speed)
    return law_of_pairs(cor, cor_speed)


def surface_of(
    inertia: float,
    cor: float | None,
    friction: float | None,
    wall_cor: float | None,
    wall_friction: float | None,
    smooth_wall: bool,
) -> Surface | None:
    """The surface of balls, without a limit of the friction that is not given.

    smooth_wall : whether every hit of the wall forgets how the ball moved
    """
    if cor is None and wall_cor is None:
        return None
    pairs = -1.0 if cor is None else cor
    limit = math.inf if friction is None else friction
    walls = pairs if wall_cor is None else wall_cor
    wall_limit = limit if wall_friction is None else wall_friction
    return Surface(inertia, pairs, limit, -1.0 if smooth_wall else walls, wall_limit)
