"""The model of an experiment: its keys with units, ranges and rules."""

import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from itertools import pairwise
from typing import Annotated, Any, Generic, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    PlainSerializer,
    PlainValidator,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationError,
    WithJsonSchema,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from snooker_cli.config.axes import Axes, axes, written
from snooker_cli.config.problems import ConfigError, KeyPath, Problem
from snooker_cli.containers import SHAPES, Circle, Container
from snooker_cli.formatting import listed
from snooker_cli.laws import (
    EVERY_LAW,
    SIDES,
    CollisionRules,
    Law,
    PackageLaw,
    Sides,
    installed_laws,
    law_of_pairs,
    law_of_wall,
    origin_of,
    package_law,
    surface_of,
)
from snooker_cli.options import PLUGINS_LISTED
from snooker_cli.ranges import (
    FROM_LIST,
    POSITIVE_ZERO,
    WHOLE,
    ZERO_OR_A_SPEED,
    Amount,
    Coordinate,
    Count,
    Duration,
    Fraction,
    Friction,
    Index,
    Inertia,
    LawSpeed,
    Model,
    Number,
    Pair,
    Restitution,
    RingNumber,
    Speed,
    Switch,
    TangentialCor,
    WallMass,
    WallSpeed,
    needs,
)

MAX_BALLS = 10_000_000  # balls of all species; their start takes half a minute and 2 GB

LEAST_LOSS = 1e-6  # 1 − wall CoR of balls that slide, or 0; 18 million bounces before a slide

AS_LARGE_AS_A_SUMMARY = 1000  # collisions of a repeat whose events take as much space

Value = TypeVar("Value")

RunPath = Annotated[
    str,
    Field(min_length=1, max_length=1000),
    needs("the name or the folder of a run", False),
]


def _of_a_shape(value: Any) -> Any:
    """The word of a shape, also of one that a module outside of the package has added."""
    if not (isinstance(value, str) and value in SHAPES):
        *others, last = map(repr, SHAPES)
        context = {"expected": f"{', '.join(others)} or {last}"}
        raise PydanticCustomError("literal_error", "{expected} is needed", context)
    return value


ShapeName = Annotated[
    str,
    BeforeValidator(_of_a_shape),
    WithJsonSchema({"enum": list(SHAPES), "type": "string"}),
]
"""The word of a shape."""

Title = Annotated[
    str,
    Field(min_length=1, max_length=200, pattern=r"^([^\p{C}\p{Z}]| )*$"),
    needs("one line of printable text of at most 200 characters", False),
]


# The parts of an experiment.


_USUAL = (("shape", Circle.name), ("common_rotation", True))
"""Values that mean the same as an absent key."""


class _Sparse(Model):
    """Written without absent keys, so that digests are the same as before these keys existed."""

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data: dict[str, Any] = handler(self)
        return {
            key: value
            for key, value in data.items()
            if value is not None and (key, value) not in _USUAL
        }


class ContainerConfig(_Sparse):
    """The container, centred at the origin."""

    shape: ShapeName = Circle.name
    """Shape: a circle, a box with four walls, a periodic box without walls, or a channel with walls
    left and right that is periodic up and down."""
    radius: Amount | None = None
    """Inner radius of the circle, m; absent: follows from packing."""
    width: Amount | None = None
    """Inner width of the box, along x, m; absent: follows from packing."""
    height: Amount | None = None
    """Inner height of the box, along y, m; absent: as width, a square."""
    packing: Fraction | None = None
    """Fraction of the container's area that balls given by count cover. Two of this, the
    container's size and the balls' radii are given; the third follows."""
    mass: WallMass = math.inf
    """Mass of a circle, kg; .inf (the default), or null, is a fixed wall. Boxes are fixed."""
    velocity: Pair | None = None
    """Velocity [u, v] of a circle with a mass at the start, m/s; absent: at rest."""

    @property
    def shape_class(self) -> type[Container]:
        """The class of the shape."""
        return SHAPES[self.shape]

    @property
    def given(self) -> Container | None:
        """The container, or None where its size follows from packing."""
        first, *others = (getattr(self, key) for key in self.shape_class.keys)
        if first is None:
            return None
        return self.shape_class(first, *(first if side is None else side for side in others))


class BySide(_Sparse, Generic[Value]):
    """A value for some straight walls; others have wall_cor."""

    left: Value | None = None
    """Of the left wall."""
    right: Value | None = None
    """Of the right wall."""
    bottom: Value | None = None
    """Of the lower wall."""
    top: Value | None = None
    """Of the upper wall."""

    @model_validator(mode="after")
    def _has_a_key(self) -> Self:
        if not self.model_fields_set:
            raise ValueError
        return self


class SpeedBySide(BySide[WallSpeed]):
    """The speed of some straight walls, m/s."""


class TemperatureBySide(BySide[Amount]):
    """The temperature of some straight walls, J."""


CommonRotation = Annotated[
    Switch | None,
    Field(
        description="Whether random velocities keep their common rotation about the centre of a "
        "circle (the default). false: the start has the same energy and no angular momentum, and "
        "a smooth fixed circle keeps it at zero. One of several species can give it for all."
    ),
]


class SpinTemperature(Model):
    """Random spins."""

    temperature: Annotated[float, Field(ge=0), POSITIVE_ZERO, needs("a number of 0 or more")]
    """Temperature of the rotation, J: twice the mean energy of a spin."""


Spin = Annotated[
    Coordinate | SpinTemperature | None,
    needs("a finite number, or {temperature: 0 or more},", False),
    Field(
        description="Spin of every ball at the start, rad/s, positive to the left; or random spins "
        "of {temperature: J}. Absent: rough balls start at rest."
    ),
]


class Rings(_Sparse):
    """Equal balls on concentric rings, one at the centre: 1 + 3n(n+1) balls for n rings.

    Ring k of n holds 6k balls at radius k/n · ring_extent · container.radius.
    """

    rings: RingNumber
    """Number of rings n around the central ball; 1 + 3n(n+1) balls."""
    radius: Amount
    """Radius of every ball, m."""
    mass: Amount = 1.0
    """Mass of every ball, kg."""
    speed: Speed
    """Speed of every ball at the start, m/s."""
    ring_extent: Fraction = 0.8
    """Radius of the outermost ring, as a fraction of the container radius."""
    common_rotation: CommonRotation = None
    spin: Spin = None

    @property
    def number(self) -> int:
        """Number of balls."""
        return 1 + 3 * self.rings * (self.rings + 1)


class Ball(_Sparse):
    """One ball."""

    position: Pair
    """Position [x, y] of the ball's centre at the start, m."""
    velocity: Pair
    """Velocity [u, v] at the start, m/s."""
    radius: Amount
    """Radius of the ball, m."""
    mass: Amount = 1.0
    """Mass of the ball, kg."""
    spin: Annotated[Coordinate, needs("a finite number")] | None = None
    """Spin at the start, rad/s, positive to the left; absent: 0 of rough balls."""


class BallList(Model):
    """Balls given one by one."""

    list: Annotated[tuple[Ball, ...], Field(min_length=1), FROM_LIST]
    """The balls, each with position, velocity, radius and (default 1 kg) mass."""


class Species(_Sparse):
    """Any number of equal balls."""

    count: Number
    """Number of balls."""
    radius: Amount | None = None
    """Radius of every ball, m; absent: follows from packing."""
    mass: Amount = 1.0
    """Mass of every ball, kg."""
    speed: Speed
    """Speed of every ball at the start, m/s; with speeds: maxwell the root mean square. In a
    periodic box, and along a channel, the total momentum of balls given by count is set to zero at
    the same energy."""
    speeds: Literal["equal", "maxwell"] = "equal"
    """Speeds at the start: equal, or from Maxwell's distribution. Directions are random."""
    start: Literal["lattice", "random"] | None = None
    """Places at the start: a hexagonal lattice over the whole container (the default), or random.
    One of several species can give it for all."""
    common_rotation: CommonRotation = None
    spin: Spin = None


class BallCount(Species):
    """Any number of equal balls that fill the container."""

    packing: Fraction | None = None
    """Fraction of the container's area that the balls cover. Two of this, the container's size and
    the balls' radius are given; the third follows."""


BALLS: Mapping[str, type[Rings] | type[BallList] | type[BallCount]] = {
    "rings": Rings,
    "list": BallList,
    "count": BallCount,
}
"""The ways to give balls in a mapping, by the key that only one of them has."""


def _tag(balls: object) -> str | None:
    """The only key of BALLS that a mapping has, or that of a model; "species" for a list."""
    if isinstance(balls, list | tuple):
        return "species"
    tags = [key for key in BALLS if key in _keys(balls)]
    return tags[0] if len(tags) == 1 else None


def _keys(part: object) -> Collection[str]:
    """The keys of a mapping or of a model; none of anything else."""
    return part if isinstance(part, Mapping) else getattr(type(part), "model_fields", ())


Group = Annotated[
    Annotated[Ball, Tag("position")] | Annotated[Species, Tag("count")],
    Discriminator(lambda group: "position" if "position" in _keys(group) else "count"),
]
"""One ball at its place, or a species."""

Balls = Annotated[
    Annotated[Rings, Tag("rings")]
    | Annotated[BallList, Tag("list")]
    | Annotated[BallCount, Tag("count")]
    | Annotated[tuple[Group, ...], Field(min_length=1), FROM_LIST, Tag("species")],
    Discriminator(_tag),
]


class Start(_Sparse):
    """A state of a stored run, from which balls and container start."""

    run: RunPath
    """The run: its folder, or its name under runs/."""
    point: Index = 0
    """The number of its point, from 0."""
    repeat: Index = 0
    """The number of the repeat at that point, from 0."""
    time: Annotated[float, Field(ge=0), needs("a finite number of 0 or more")] | None = None
    """Time of the state, s; absent: the end of the repeat."""
    content: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$"), needs("a hash", False)] | None = None
    """Written by snooker: the hash of the repeat. Container and balls are then those of the
    state."""
    rounding: Annotated[float, Field(ge=0), needs("a finite number of 0 or more")] | None = None
    """Written by snooker: how far balls may overlap by the rounding of the run, m."""


class Regularisation(_Sparse):
    """A change of the collisions that prevents a collapse; exactly one of the keys is given."""

    tc: Fraction | None = None
    """Duration of a contact in present mean free times, at most 1. A collision is elastic if one
    of its balls had another contact more recently (TC model: Luding and McNamara, Granular Matter
    1, 113, 1998)."""
    elastic_below: LawSpeed | None = None
    """Relative normal speed, m/s, below which a collision is elastic."""

    @model_validator(mode="after")
    def _has_one_key(self) -> Self:
        if (self.tc is None) == (self.elastic_below is None):
            raise ValueError
        return self


Collapse = Annotated[
    Literal["stop", "slide"] | Regularisation,
    needs("stop, slide, {tc: up to 1} or {elastic_below: 1e-150 to 1e150}", False),
]


MOST_SNAPSHOTS = 10_000  # of a list; each is read and checked

_Moments = Annotated[
    tuple[Duration, ...], Field(min_length=1, max_length=MOST_SNAPSHOTS), FROM_LIST
]


class PerDecade(_Sparse):
    """Times that are as many in each decade, at equal distances of their logarithm."""

    per_decade: Annotated[int, Field(ge=1, le=100), WHOLE]
    """Times in each decade, 1 to 100, from about the time between two collisions of a ball on."""


def _ascending(value: Any) -> Any:
    """Raise ``ValueError`` for times that do not ascend."""
    if isinstance(value, tuple) and any(b <= a for a, b in pairwise(value)):
        raise ValueError
    return value


StoredTimes = Annotated[
    _Moments | PerDecade,
    AfterValidator(_ascending),
    needs("a list of times in s that ascend, as [1, 10, 100], or {per_decade: 1 to 100}", False),
]

DEFAULT_TIMES = PerDecade(per_decade=10)


def given_law(value: Any, key: str) -> PackageLaw:
    """A law of a package from the value of a key, still without its CoR. Raises ``ConfigError``."""
    if isinstance(value, PackageLaw):
        return value

    def wrong(sentence: str, *path: str) -> ConfigError:
        return ConfigError([Problem((key, *path), sentence)])

    laws = installed_laws()
    known = f"installed are {', '.join(laws)}" if laws else "no installed package adds a law"
    if not laws and any(plugin.problem for plugin in EVERY_LAW.plugins):
        known = "all installed laws are left out"
    if not isinstance(value, Mapping) or not isinstance(value.get("name"), str):
        raise wrong(f"{{name: …}} and the numbers of the law are needed; {known}")
    name, origin = value["name"], value.get("origin")
    numbers = {
        part: float(number) if type(number) is int else number  # as swept values may be
        for part, number in value.items()
        if part not in ("name", "origin")
    }
    if name not in laws or origin not in (None, origin_of(name)):
        with suppress(ValueError):
            return package_law({"name": name, "origin": origin, **numbers, "cor": 0.0})
        advice = f"install its package, or see in {PLUGINS_LISTED} why it is left out"
        raise wrong(f"there is no law {name}; {known}; {advice}", "name")
    try:
        return laws[name](**{"cor": 0.0, **numbers})
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        needed = fault.get("ctx", {}).get("needs")
        range_text = f"{needed} is needed" if needed else fault["msg"]
        has = ", ".join(laws[name].numbers()[1:])
        what = {
            "missing_argument": f"the law {name} needs it; it has {has}",
            "missing": f"the law {name} needs it; it has {has}",
            "unexpected_keyword_argument": f"the law {name} has no such number; it has {has}",
        }.get(fault["type"], f"{range_text}, not {fault['input']!r}")
        raise wrong(what, *map(str, fault["loc"])) from None


def _given(key: str) -> PlainValidator:
    """Validates the law of a key."""
    return PlainValidator(
        lambda value: None if value is None else given_law(value, key),
        json_schema_input_type=dict[str, Any] | None,
    )


def describe_laws(schema: dict[str, Any]) -> None:
    """Add the laws of installed packages to the schema of a key."""
    laws = installed_laws()
    numbers = {
        name: {"type": "number", "description": f"Of the law {law.name}."}
        for law in laws.values()
        for name in law.numbers()[1:]
    }
    names = {"enum": list(laws)} if laws else {"type": "string"}
    properties = {"name": names, **numbers, "origin": {"type": "string"}}
    schema["anyOf"][0] |= {"properties": properties, "required": ["name"]}


WRITTEN_LAW = PlainSerializer(
    lambda law: None if law is None else law.in_config(), return_type=dict[str, Any] | None
)
WITH_LAWS = Field(json_schema_extra=describe_laws)


class Config(Model):
    """A snooker experiment: inelastic hard disks in a container."""

    title: Title | None = None
    """Name shown in tables."""
    container: ContainerConfig
    """Container: a circle, a box, a periodic box or a channel."""
    balls: Balls
    """Balls at the start: a count of equal balls, a list of several such species (after any
    single balls with a position), rings of equal balls, or a list of single balls."""
    start: Start | None = None
    """A state of a stored run to start from, instead of balls and container."""
    cor: Restitution
    """Coefficient of restitution between balls, 0 (no rebound) to 1 (elastic)."""
    wall_cor: Restitution | None = None
    """Coefficient of restitution at the wall, 0 to 1; absent or null: as cor."""
    cor_speed: LawSpeed | None = None
    """Relative normal speed v₀, m/s, below which collisions between balls become more elastic:
    e(v) = 1 − (1 − cor)(v/v₀)^¾. Absent: cor at all speeds."""
    law: Annotated[PackageLaw | None, _given("law"), WRITTEN_LAW, WITH_LAWS] = None
    """A law of an installed package between balls, as {name: yielding, yield_speed: 2}; cor is its
    CoR of fast collisions. `snooker plugins` lists laws. Absent: cor and cor_speed."""
    wall_cor_speed: LawSpeed | None = None
    """The same speed at the wall, m/s, with wall_cor; absent: one CoR at all speeds."""
    wall_law: Annotated[PackageLaw | None, _given("wall_law"), WRITTEN_LAW, WITH_LAWS] = None
    """The same at walls without a speed or a temperature, with wall_cor. Absent: wall_cor."""
    tangential_cor: TangentialCor | None = None
    """Tangential restitution β of two rough balls: their surfaces slip at −β times their speed
    after a collision; −1 changes nothing, 1 turns the slip round. Absent: smooth balls."""
    friction: Friction | None = None
    """Friction μ: the tangential impulse is at most μ times the normal one. Absent: no limit."""
    wall_tangential_cor: TangentialCor | None = None
    """Tangential restitution at the wall; absent: as tangential_cor. A wall with a temperature is
    smooth."""
    wall_friction: Friction | None = None
    """Friction at the wall; absent: as friction."""
    inertia: Inertia = 0.5
    """Moment of inertia of a rough ball over m r²: 0.5 of a disk, 1 of a ring."""
    wall_speed: (
        Annotated[
            WallSpeed | SpeedBySide,
            needs(f"{ZERO_OR_A_SPEED}, or one for some sides, as {{left: 1, right: 1}},"),
        ]
        | None
    ) = None
    """Speed V, m/s, at which a fixed wall moves inwards when it is hit: a ball leaves it with the
    normal speed e v + (1 + e) V. A number, or numbers for left, right, bottom and top."""
    wall_temperature: (
        Annotated[
            Amount | TemperatureBySide,
            needs("a number above 0, or one for some sides, as {left: 20, right: 80},"),
        ]
        | None
    ) = None
    """Temperature of a fixed wall, J: a ball leaves it with a random velocity of this temperature.
    It replaces wall_cor. A number, or numbers for left, right, bottom and top."""
    wall_key: Index | None = None
    """Key of the random velocities at a wall with a temperature, as the live page writes it: of
    repeat 0; repeat k has wall_key + k. Absent: from the seed."""
    collapse: Collapse = "stop"
    """What to do about infinitely many collisions in finite time. stop (the default): end the
    repeat and report it. slide: let the ball slide along a circle's fixed wall. tc: contacts have
    a duration; elastic_below: slow collisions are elastic; with either there is no collapse."""
    collisions: Count | None = None
    """Stop after this many collisions; with `time`, whichever comes first."""
    time: Duration | None = None
    """Stop at this time, s; with `collisions`, whichever comes first."""
    repeats: Count = 1
    """Repeats of every point: simulations with their own random start."""
    seed: Index = 1
    """Seed of the random starts."""
    common_random: Switch = False
    """Whether all points have the same random starts, for paired comparisons. By default each point
    has its own: they follow from the seed and the point's physics."""
    record: Literal["events", "summary", "snapshots"] = "events"
    """What is stored: every collision, only a summary, or a summary and states at some times. With
    collisions below 1,000 every collision is stored, because this is smaller and faster."""
    snapshots: StoredTimes | None = None
    """When record: snapshots stores states: a list of times, s, or {per_decade: n}; absent:
    {per_decade: 10}. Start and end are always stored."""
    sweep: Annotated[
        Axes,
        PlainValidator(axes, json_schema_input_type=dict[str, Any]),
        PlainSerializer(written, return_type=dict[str, Any]),
    ] = ()
    """A grid over keys (dotted paths), each with a list of values, range(1, 6) or start:stop:count;
    the last key runs fastest. Keys under zip, or under each item of a list there, change together:
    they are one axis of the grid, at the place of zip."""

    @model_validator(mode="after")
    def _follows_the_rules(self) -> Self:
        """Raise ConfigError for values that do not fit each other."""
        if faults := tuple(_faults(self)):
            raise ConfigError(faults)
        return self

    @property
    def keeps_events(self) -> bool:
        """Whether every collision is stored."""
        few = self.collisions is not None and self.collisions < AS_LARGE_AS_A_SUMMARY
        return self.record == "events" or few

    @property
    def stored_times(self) -> tuple[float, ...] | PerDecade:
        """When states are stored, s; () unless there are snapshots instead of events."""
        if self.record != "snapshots" or self.keeps_events:
            return ()
        return self.snapshots or DEFAULT_TIMES

    @property
    def effective_wall_cor(self) -> float:
        """Coefficient of restitution at the wall, `cor` unless `wall_cor` is given."""
        return self.cor if self.wall_cor is None else self.wall_cor

    @property
    def _law_of_walls(self) -> Law:
        """The law of collisions at the wall."""
        keys = self.wall_speed, self.wall_temperature
        if any(isinstance(key, BySide) for key in keys):
            return Sides(*map(self._law_at, SIDES))
        return self._law_at("left")

    def _law_at(self, side: str) -> Law:
        """The law of one wall."""
        speed, temperature = self._at(side)
        if self.wall_law is not None and not speed and temperature is None:
            return self.wall_law.with_cor(self.effective_wall_cor)
        return law_of_wall(self.effective_wall_cor, self.wall_cor_speed, speed, temperature)

    def _at(self, side: str) -> tuple[float | None, float | None]:
        """The speed (m/s) and the temperature (J) of one wall."""
        speed, temperature = (
            getattr(key, side) if isinstance(key, BySide) else key
            for key in (self.wall_speed, self.wall_temperature)
        )
        return speed, temperature

    @property
    def collision_rules(self) -> CollisionRules:
        """What collisions do: the laws, what rough balls do along the tangent, and ``collapse``."""
        pairs = self.law and self.law.with_cor(self.cor)
        sides = self.container.shape_class.sides or ("left",)
        change = None if isinstance(self.collapse, str) else self.collapse
        return CollisionRules(
            pairs or law_of_pairs(self.cor, self.cor_speed),
            self._law_of_walls,
            contact_duration=(change and change.tc) or 0.0,
            elastic_below=(change and change.elastic_below) or 0.0,
            slides=self.collapse == "slide",
            surface=surface_of(
                self.inertia,
                self.tangential_cor,
                self.friction,
                self.wall_tangential_cor,
                self.wall_friction,
                all(self._law_at(side).is_random for side in sides),
            ),
        )

    @property
    def species(self) -> tuple[Species, ...]:
        """The species of balls given by count; none of rings or a list."""
        groups = self.balls if isinstance(self.balls, tuple) else (self.balls,)
        return tuple(group for group in groups if isinstance(group, Species))

    @property
    def placed(self) -> tuple[Ball, ...]:
        """The single balls with a position among species; balls 0, 1, … of the scene."""
        groups = self.balls if isinstance(self.balls, tuple) else ()
        return tuple(group for group in groups if isinstance(group, Ball))

    @property
    def number(self) -> int:
        """Number of balls."""
        if isinstance(self.balls, Rings):
            return 1 + 3 * self.balls.rings * (self.balls.rings + 1)
        if isinstance(self.balls, BallList):
            return len(self.balls.list)
        return len(self.placed) + sum(species.count for species in self.species)

    @property
    def arrangement(self) -> str:
        """Places of balls given by count at the start, "lattice" or "random"."""
        return next((kind.start for kind in self.species if kind.start), "lattice")

    @property
    def common_rotation(self) -> bool:
        """Whether random velocities keep their common rotation."""
        groups = (self.balls,) if isinstance(self.balls, Rings) else self.species
        return all(group.common_rotation is not False for group in groups)

    @property
    def packing(self) -> tuple[str, float] | None:
        """The key that gives the packing, and its value."""
        for key, home in (("container", self.container), ("balls", self.balls)):
            if isinstance(home, ContainerConfig | BallCount) and home.packing is not None:
                return f"{key}.packing", home.packing
        return None


_KEYS = tuple(Config.model_fields)
RULE_KEYS = _KEYS[_KEYS.index("cor") : _KEYS.index("collapse") + 1]
"""The keys that say what collisions do."""


# Rules about several keys. Each yields what is wrong. Whether balls fit into space is not checked.


def _faults(config: Config) -> Iterator[Problem]:
    """All that is wrong with values that are right by themselves."""
    if config.collisions is None and config.time is None:
        sentence = "neither collisions nor time is given; give at least one, so that runs end"
        yield Problem(("collisions",), sentence)
    container, balls = config.container, config.balls
    if faults := tuple(_faults_of_container(container)):
        yield from faults
        return
    if isinstance(balls, Rings | BallList):
        yield from _faults_of_places(container, balls)
    else:
        yield from _faults_of_species(config)
    if not config.common_rotation:
        yield from _faults_of_rotation(config)
    fixed_circle = issubclass(container.shape_class, Circle) and math.isinf(container.mass)
    if config.collapse == "slide" and not fixed_circle:
        sentence = (
            "slide needs a circle with a fixed wall; set container.mass: .inf, or collapse: stop, "
            "{tc: 0.01} or {elastic_below: 1e-6}"
        )
        yield Problem(("collapse",), sentence)
    if config.collapse == "slide" and 0 < 1 - config.effective_wall_cor < LEAST_LOSS:
        sentence = (
            f"slide adds up bounces one by one, too many for a wall CoR between 1 − {LEAST_LOSS:g} "
            "and 1; set wall_cor: 1, or collapse: stop"
        )
        yield Problem(("collapse",), sentence)
    yield from _faults_of_walls(config)
    yield from _faults_of_snapshots(config)
    yield from _faults_of_surface(config)
    yield from _faults_of_given_laws(config)
    if config.collapse == "slide" and config.wall_cor_speed is not None:
        sentence = "slide needs one CoR at all speeds at the wall; remove wall_cor_speed, or slide"
        yield Problem(("collapse",), sentence)


def _faults_of_surface(config: Config) -> Iterator[Problem]:
    """Friction, inertia and spins are of rough balls."""
    surface = config.collision_rules.surface
    if surface is None:
        given = [key for key in ("friction", "wall_friction") if getattr(config, key) is not None]
        given += ["inertia"] * (config.inertia != 0.5)
        for key in given:
            sentence = f"{key} is of rough balls; give tangential_cor (-1 to 1) too, or remove it"
            yield Problem((key,), sentence, about_key=True)
        spinning = [path for path, group in _groups(config.balls) if group.spin is not None]
        if spinning and config.start is not None:
            sentence = "the balls of this state spin; give tangential_cor (-1 to 1) too"
            yield Problem(("start",), sentence, about_key=True)
            return
        for path in spinning:
            sentence = "smooth balls have no spin; give tangential_cor (-1 to 1), or remove it"
            yield Problem((*path, "spin"), sentence, about_key=True)
    elif config.collapse == "slide" and surface.rubs_wall:
        sentence = (
            "slide needs a smooth wall; set wall_tangential_cor: -1, or collapse: stop, {tc: 0.01} "
            "or {elastic_below: 1e-6}"
        )
        yield Problem(("collapse",), sentence)
    shape = config.container.shape_class
    for key in ("wall_tangential_cor", "wall_friction"):
        if getattr(config, key) is not None and surface is not None and not shape.has_wall:
            sentence = f"a {shape.title} has no wall; remove {key}, or set another shape"
            yield Problem((key,), sentence, about_key=True)


def _faults_of_given_laws(config: Config) -> Iterator[Problem]:
    """A law of a package replaces what else says how e depends on speed."""
    for key, other in (("law", "cor_speed"), ("wall_law", "wall_cor_speed")):
        if getattr(config, key) is not None and getattr(config, other) is not None:
            yield Problem((key,), f"{key} replaces {other}; remove one of them", about_key=True)
    if config.wall_law is None:
        return
    shape = config.container.shape_class
    if not shape.has_wall:
        sentence = f"a {shape.title} has no wall; remove wall_law, or set another shape"
        yield Problem(("wall_law",), sentence, about_key=True)
    if config.collapse == "slide":
        sentence = "slide needs one CoR at all speeds at the wall; remove wall_law, or slide"
        yield Problem(("collapse",), sentence)


def _groups(balls: Any) -> Iterator[tuple[KeyPath, Any]]:
    """The parts of ``balls`` that can have a spin, and their paths."""
    if isinstance(balls, BallList):
        yield from ((("balls", "list", k), ball) for k, ball in enumerate(balls.list))
    elif isinstance(balls, tuple):
        yield from ((("balls", k), group) for k, group in enumerate(balls))
    else:
        yield ("balls",), balls


def _faults_of_walls(config: Config) -> Iterator[Problem]:
    """Walls that give energy are fixed, and each has one law."""
    shape = config.container.shape_class
    for key in ("wall_speed", "wall_temperature"):
        value = getattr(config, key)
        if value is None:
            continue

        def fault(sentence: str, path: KeyPath = (key,)) -> Problem:
            return Problem(path, sentence, about_key=True)

        if not shape.has_wall:
            yield fault(f"a {shape.title} has no wall; remove {key}, or set another shape")
        if math.isfinite(config.container.mass):
            yield fault(f"a free container has no {key}; remove it, or set container.mass: .inf")
        if isinstance(value, BySide) and shape.has_wall:
            given = {side for side, amount in value if amount is not None}
            for side in given - set(shape.sides):
                sides = listed(shape.sides) if shape.sides else "no sides, so give one number"
                yield fault(f"a {shape.title} has {sides}", (key, side))
        if config.collapse == "slide":
            yield Problem(("collapse",), f"balls do not slide with {key}; set collapse: stop")
    speeds, temperatures = zip(*map(config._at, shape.sides or ("left",)), strict=True)
    if config.wall_speed is not None and config.wall_cor_speed is not None:
        sentence = "wall_cor_speed is for walls that do not move; remove it, or wall_speed"
        yield Problem(("wall_cor_speed",), sentence, about_key=True)
    if any(None not in both for both in zip(speeds, temperatures, strict=True)):
        sentence = "one wall has a wall_temperature and a wall_speed; remove one of them"
        yield Problem(("wall_temperature",), sentence, about_key=True)
    if config.wall_key is not None and config.wall_temperature is None:
        sentence = "wall_key is for a wall with a wall_temperature; remove it, or give one"
        yield Problem(("wall_key",), sentence, about_key=True)
    for key in ("wall_cor", "wall_cor_speed", "wall_tangential_cor", "wall_friction"):
        if None not in temperatures and getattr(config, key) is not None:
            sentence = f"wall_temperature replaces {key}; remove one of them"
            yield Problem((key,), sentence, about_key=True)


def _faults_of_snapshots(config: Config) -> Iterator[Problem]:
    """Their times are for snapshots, and not after the end."""
    times, end = config.snapshots, config.time
    if times is not None and config.record != "snapshots":
        sentence = "snapshots is for record: snapshots; remove it, or set record: snapshots"
        yield Problem(("snapshots",), sentence, about_key=True)
    elif isinstance(times, tuple) and end is not None and times[-1] > end:
        sentence = f"{times[-1]:g} s is after the end of the repeats, {end:g} s; remove it"
        yield Problem(("snapshots", len(times) - 1), sentence)


def _faults_of_container(container: ContainerConfig) -> Iterator[Problem]:
    """Each shape has keys of its own."""
    shape = container.shape_class

    def fault(key: str, sentence: str) -> Problem:
        return Problem(("container", key), f"a {shape.title} {sentence}", about_key=True)

    for key in dict.fromkeys(key for other in SHAPES.values() for key in other.keys):
        if key not in shape.keys and getattr(container, key) is not None:
            owners = " or ".join(other.name for other in SHAPES.values() if key in other.keys)
            keys = " and ".join(shape.keys)
            yield fault(key, f"has no {key}; give {keys}, or set shape: {owners}")
    first, *others = shape.keys
    for key in others:
        if getattr(container, key) is not None and getattr(container, first) is None:
            yield fault(key, f"with a {key} needs a {first} too; add {first}")
    if math.isfinite(container.mass) and not shape.can_move:
        yield fault("mass", "is fixed and has no mass; remove it, or set shape: circle")
    if container.velocity is not None and math.isinf(container.mass):
        yield fault("velocity", "without a mass is fixed; remove the velocity, or give a mass")


def _faults_of_places(container: ContainerConfig, balls: Rings | BallList) -> Iterator[Problem]:
    """Rings need a circle; balls whose places are given need a container whose size is given."""
    shape, way = container.shape_class, "rings" if isinstance(balls, Rings) else "list"
    if way == "rings" and not issubclass(shape, Circle):
        sentence = f"rings are for a circle, not for shape: {shape.name}; give count or list"
        yield Problem(("balls", "rings"), sentence, about_key=True)
        return
    if container.packing is not None:
        sentence = f"packing is for balls given by count, not for {way}; remove it"
        yield Problem(("container", "packing"), sentence, about_key=True)
    if container.given is None:
        key = shape.keys[0]
        sentence = f"the key is missing; add it: inner {key} of the {shape.title}, m"
        yield Problem(("container", key), sentence, about_key=True)


def _faults_of_species(config: Config) -> Iterator[Problem]:
    """Species must fit each other. Two of the container's size, their radii and packing follow."""
    container, balls, species = config.container, config.balls, config.species
    shape, size = container.shape_class, f"container.{container.shape_class.keys[0]}"
    placed = config.placed
    paths: list[KeyPath] = [("balls", len(placed) + k) for k in range(len(species))]
    if isinstance(balls, BallCount):
        paths = [("balls",)]
    elif placed and (faults := tuple(_faults_of_placed(config))):
        yield from faults
        return
    number = sum(kind.count for kind in species)
    if number > MAX_BALLS:
        sentence = f"the species have {number:,} balls in all; at most {MAX_BALLS:,} are allowed"
        yield Problem(("balls",), f"{sentence}, so give fewer")
    if number == 1 and not shape.has_wall:
        sentence = f"one ball in a {shape.title} meets nothing; give two or more"
        yield Problem((*paths[0], "count"), sentence)
    for path, kind in zip(paths, species, strict=True):
        if kind.start not in (None, config.arrangement):
            sentence = f"{kind.start} is given where another species has {config.arrangement}"
            yield Problem((*path, "start"), f"{sentence}; give one for all")
    without = [path for path, kind in zip(paths, species, strict=True) if kind.radius is None]
    there = {
        size: container.given is not None,
        "the radius of the balls": not without,
        "container.packing": container.packing is not None,
        "balls.packing": isinstance(balls, BallCount) and balls.packing is not None,
    }
    given = [name for name, is_there in there.items() if is_there]
    packed = [name for name in given if name.endswith("packing")]
    if without and len(without) < len(species):
        sentence = "the radius is missing; give one to each species, or to none if packing is given"
        yield from (Problem((*path, "radius"), sentence, about_key=True) for path in without)
    elif len(given) != 2 or len(packed) == 2:
        are = "are" if given[1:] else "is"
        surplus = packed if len(packed) < len(given) - 1 else packed[1:]
        advice = f"remove {listed(surplus)}" if surplus else "add what is missing"
        sentence = (
            f"two of {size}, the radius of the balls and packing are needed (the third follows), "
            f"but {listed(given) or 'none'} {are} given; {advice}"
        )
        yield Problem(("balls",), sentence)


def _faults_of_rotation(config: Config) -> Iterator[Problem]:
    """Two balls or more in a circle can be without a common rotation, all of them alike."""
    balls, shape = config.balls, config.container.shape_class
    groups = balls if isinstance(balls, tuple) else (balls,)
    number = sum(kind.count for kind in config.species)
    if isinstance(balls, Rings):
        number = balls.number
    for k, group in enumerate(groups):
        path: KeyPath = ("balls", k) if isinstance(balls, tuple) else ("balls",)
        rotates = getattr(group, "common_rotation", None)
        if rotates:
            sentence = "true is given where another species has false; give one for all"
        elif rotates is False and not shape.keeps_rotation:
            sentence = f"a {shape.title} keeps no rotation; remove this key, or set shape: circle"
        elif rotates is False and number == 1:
            sentence = "one ball has no common rotation; remove this key, or add balls"
        else:
            continue
        yield Problem((*path, "common_rotation"), sentence, about_key=not rotates)


def _faults_of_placed(config: Config) -> Iterator[Problem]:
    """Balls with a position come before species that fill a container of a given size."""
    placed = len(config.placed)
    if not config.species:
        sentence = "all balls have a position; write balls: {list: […]}, or add balls with a count"
        yield Problem(("balls",), sentence)
    for k, ball in enumerate(config.balls if isinstance(config.balls, tuple) else ()):
        if isinstance(ball, Ball) and k >= placed:
            sentence = "a ball with a position is given after a species; move it to the front"
            yield Problem(("balls", k), sentence)
    if config.container.packing is not None:
        sentence = "packing is for balls given by count alone; give the container's size instead"
        yield Problem(("container", "packing"), sentence, about_key=True)
