"""The model of an experiment: its keys with units, ranges and rules, and their JSON schema."""

import difflib
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    PlainValidator,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationInfo,
    field_validator,
    model_serializer,
)
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import PydanticCustomError

from snooker_cli.config import field_types as q
from snooker_cli.config.axes import WHOLE_RUN, ZIP, Axes, axes, written
from snooker_cli.config.problems import Complaint, KeyPath, refusal, rendered
from snooker_cli.containers import SHAPES, Circle, Container


class Model(BaseModel):
    """Frozen, and strict about keys, types and finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class _Sparse(Model):
    """Written without absent keys, so that digests are the same as before these keys existed."""

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data: dict[str, Any] = handler(self)
        return {
            key: value
            for key, value in data.items()
            if value is not None and (key, value) != ("shape", Circle.name)
        }


class ContainerConfig(_Sparse):
    """The container, centred at the origin."""

    shape: q.Shape = Field(
        default=Circle.name,
        description="Shape: a circle, a box with four walls, or a periodic box without walls.",
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
        description="Fraction of the container's area that balls given by count cover. Two of "
        "this, the container's size and the balls' radii are given; the third follows.",
    )
    mass: q.WallMass = Field(
        default=math.inf,
        description="Mass of a circle, kg; .inf (the default), or null, is a fixed wall. Boxes "
        "are fixed.",
    )

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
        return self.shape_class(first, *(first if each is None else each for each in others))


class Rings(Model):
    """Equal balls on concentric rings, one at the centre: 1 + 3n(n+1) balls for n rings.

    Ring k of n holds 6k balls at radius k/n · ring_extent · container.radius.
    """

    rings: q.RingNumber = Field(
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
        description="Speed of every ball at the start, m/s; with speeds: maxwell the root mean "
        "square. In a periodic box the total momentum is set to zero at the same kinetic energy."
    )
    speeds: q.Speeds = Field(
        default="equal",
        description="Speeds at the start: equal, or from Maxwell's distribution. Directions are "
        "random.",
    )
    start: q.Start | None = Field(
        default=None,
        description="Places at the start: a hexagonal lattice over the whole container (the "
        "default), or random. One of several species can give it for all.",
    )


class BallCount(Species):
    """Any number of equal balls that fill the container."""

    packing: q.Fraction | None = Field(
        default=None,
        description="Fraction of the container's area that the balls cover. Two of this, the "
        "container's size and the balls' radius are given; the third follows.",
    )


BALLS: Mapping[str, type[Rings] | type[BallList] | type[BallCount]] = {
    "rings": Rings,
    "list": BallList,
    "count": BallCount,
}
"""The ways to give balls in a mapping, by the key that only one of them has."""


def _variants(models: Mapping[str, type[Model]], value: object) -> list[str]:
    """The keys of `models` that a mapping has, or the one of its model."""
    if isinstance(value, Mapping):
        return [key for key in models if key in value]
    return [key for key, model in models.items() if isinstance(value, model)]


def _balls_variant(value: object) -> str | None:
    """The key in BALLS that a value has, misspelt or not; None if it has none or several.

    It is "species" for a list.
    """
    if isinstance(value, list | tuple):
        return "species"
    found = _variants(BALLS, value)
    if not found and isinstance(value, Mapping):
        known = {name for model in BALLS.values() for name in model.model_fields}
        unknown = [str(key).lower() for key in value if key not in known]
        found = [key for key in BALLS if difflib.get_close_matches(key, unknown, cutoff=0.7)]
    return found[0] if len(found) == 1 else None


AllSpecies = Annotated[tuple[Species, ...], Field(min_length=1), BeforeValidator(q.as_tuple)]

Balls = Annotated[
    Annotated[Rings, Tag("rings")]
    | Annotated[BallList, Tag("list")]
    | Annotated[BallCount, Tag("count")]
    | Annotated[AllSpecies, Tag("species")],
    Discriminator(
        _balls_variant,
        custom_error_type="balls",
        custom_error_message="one of rings, list and count is needed",
    ),
]


class ContactDuration(Model):
    """A ball that collided a short time ago collides without loss: contacts have a duration.

    TC model: Luding and McNamara, Granular Matter 1, 113 (1998).
    """

    tc: q.Fraction = Field(
        description="Duration of a contact in present mean free times, at most 1. A collision is "
        "elastic if one of its balls had another contact more recently."
    )


class ElasticBelow(Model):
    """Slow collisions are elastic."""

    elastic_below: q.Positive = Field(
        description="Relative normal speed, m/s, below which a collision is elastic."
    )


REGULARISED: Mapping[str, type[ContactDuration] | type[ElasticBelow]] = {
    "tc": ContactDuration,
    "elastic_below": ElasticBelow,
}
"""The models that prevent a collapse, by their key."""


def _collapse_variant(value: object) -> str | None:
    """The key in REGULARISED that a value has, "word" for a text; None if it has none or both."""
    found = ["word"] if isinstance(value, str) else _variants(REGULARISED, value)
    return found[0] if len(found) == 1 else None


Collapse = Annotated[
    Annotated[q.CollapseWord, Tag("word")]
    | Annotated[ContactDuration, Tag("tc")]
    | Annotated[ElasticBelow, Tag("elastic_below")],
    Discriminator(
        _collapse_variant,
        custom_error_type="needs",
        custom_error_message="{needs} is needed",
        custom_error_context={"needs": q.COLLAPSE, "form": "other"},
    ),
]


# Rules about several keys. They yield what is wrong.

AnyBalls = Rings | BallList | BallCount | tuple[Species, ...]


def _faults_of_container(container: ContainerConfig) -> Iterator[Complaint]:
    """Each shape has keys of its own."""
    shape = container.shape_class
    for key in dict.fromkeys(key for other in SHAPES.values() for key in other.keys):
        if key not in shape.keys and getattr(container, key) is not None:
            owners = " or ".join(other.name for other in SHAPES.values() if key in other.keys)
            sentence = (
                f"a {shape.title} has no {key}; give {' and '.join(shape.keys)}, or set shape: "
                f"{owners}"
            )
            yield Complaint(("container", key), sentence, about_key=True)
    first, *others = shape.keys
    for key in others:
        if getattr(container, key) is not None and getattr(container, first) is None:
            sentence = f"the {key} of a {shape.title} is given without its {first}; add {first}"
            yield Complaint(("container", key), sentence, about_key=True)
    if math.isfinite(container.mass) and not shape.can_move:
        sentence = f"a {shape.title} is fixed and has no mass; remove it, or set shape: circle"
        yield Complaint(("container", "mass"), sentence, about_key=True)


def _faults_of_slide(container: ContainerConfig) -> Iterator[Complaint]:
    """Balls can slide only along the fixed wall of a circle."""
    others = "set collapse: stop, {tc: 0.01} or {elastic_below: 1e-6}"
    if not issubclass(container.shape_class, Circle):
        sentence = f"balls slide only in a circle, not with shape: {container.shape}; {others}"
        yield Complaint(("collapse",), sentence)
    elif math.isfinite(container.mass):
        sentence = (
            f"slide needs a fixed wall, and container.mass is {container.mass:g} kg; remove it, or "
            f"{others}"
        )
        yield Complaint(("collapse",), sentence)


def _faults_of_places(container: ContainerConfig, balls: Rings | BallList) -> Iterator[Complaint]:
    """Rings need a circle; balls whose places are given need a container whose size is given."""
    shape, way = container.shape_class, "rings" if isinstance(balls, Rings) else "list"
    if way == "rings" and not issubclass(shape, Circle):
        sentence = f"rings are for a circle, not for shape: {shape.name}; give count or list"
        yield Complaint(("balls", "rings"), sentence, about_key=True)
        return
    if container.packing is not None:
        sentence = f"packing is for balls given by count, not for {way}; remove it"
        yield Complaint(("container", "packing"), sentence, about_key=True)
    if container.given is None:
        key = shape.keys[0]
        sentence = f"the key is missing; add it: inner {key} of the {shape.title}, m"
        path = ("container", key)
        yield Complaint(path, sentence, about_key=True, missing=(rendered(path),))


def _faults_of_balls(container: ContainerConfig, balls: AnyBalls) -> Iterator[Complaint]:
    """Balls must fit the rest of the configuration; whether they fit into space is not checked."""
    if isinstance(balls, Rings | BallList):
        yield from _faults_of_places(container, balls)
        return
    species: dict[KeyPath, Species] = {("balls",): balls} if isinstance(balls, Species) else {}
    if isinstance(balls, tuple):
        species = {("balls", k): each for k, each in enumerate(balls)}
    number = sum(each.count for each in species.values())
    if number > q.MAX_BALLS:
        sentence = (
            f"the species have {number:,} balls in all, of at most {q.MAX_BALLS:,}; give fewer"
        )
        yield Complaint(("balls",), sentence)
    if number == 1 and not container.shape_class.has_wall:
        sentence = f"one ball in a {container.shape_class.title} meets nothing; give two or more"
        yield Complaint((*next(iter(species)), "count"), sentence)
    starts = {(*path, "start"): each.start for path, each in species.items() if each.start}
    for path, start in starts.items():
        if start != (first := next(iter(starts.values()))):
            sentence = f"{start} is given where another species has {first}; give one for all"
            yield Complaint(path, sentence)
    yield from _faults_of_sizes(container, _packings(container, balls), species)


def _faults_of_sizes(
    container: ContainerConfig, packings: dict[KeyPath, float], species: dict[KeyPath, Species]
) -> Iterator[Complaint]:
    """Two of the container's size, the balls' radii and packing are needed."""
    without = [path for path, each in species.items() if each.radius is None]
    if len(packings) == 2:
        sentence = "packing is given here and as container.packing; keep one of them"
        yield Complaint(("balls", "packing"), sentence, about_key=True)
        return
    if without and len(without) < len(species):
        sentence = (
            "the radius is missing, and other species have one; give it to each species, or to "
            "none if one radius for all shall follow from packing"
        )
        yield from (Complaint((*path, "radius"), sentence, about_key=True) for path in without)
        return
    size = f"container.{container.shape_class.keys[0]}"
    there = {
        size: container.given is not None,
        "radius of the balls": not without,
        "packing": bool(packings),
    }
    given = [name for name, is_there in there.items() if is_there]
    if len(given) == 3:
        sentence = (
            f"packing follows from {size} and the radius of the balls, which are given too; remove "
            "one of the three"
        )
        yield Complaint(next(iter(packings)), sentence, about_key=True)
    elif len(given) < 2:
        sentence = (
            f"two of {size}, radius of the balls and packing are needed, and the third follows; "
            f"{given[0] if given else 'none'} is given, so add {'one' if given else 'two'}"
        )
        yield Complaint(("balls",), sentence)


def _packings(container: ContainerConfig, balls: AnyBalls) -> dict[KeyPath, float]:
    """The packing by the keys that give it."""
    found: dict[KeyPath, float | None] = {("container", "packing"): container.packing}
    if isinstance(balls, BallCount):
        found["balls", "packing"] = balls.packing
    return {path: packing for path, packing in found.items() if packing is not None}


def _refuse(faults: Iterable[Complaint]) -> None:
    """Raise an error for pydantic if there are faults."""
    if found := tuple(faults):
        raise refusal(found)


class Experiment(Model):
    """A snooker experiment: inelastic hard disks in a container."""

    title: q.Title | None = Field(default=None, description="Name shown in tables.")
    container: ContainerConfig = Field(description="Container: a circle, a box or a periodic box.")
    balls: Balls = Field(
        description="Balls at the start: a count of equal balls, a list of several such species, "
        "rings of equal balls, or a list of single balls."
    )
    cor: q.Restitution = Field(
        description="Coefficient of restitution between balls, 0 (no rebound) to 1 (elastic)."
    )
    wall_cor: q.Restitution | None = Field(
        default=None,
        description="Coefficient of restitution at the wall, 0 to 1; absent or null: as cor.",
    )
    collapse: Collapse = Field(
        default="stop",
        description="What to do about infinitely many collisions in finite time. stop (the "
        "default): end the repeat and report it. slide: let the ball slide along a circle's fixed "
        "wall. tc: contacts have a duration; elastic_below: slow collisions are elastic; with "
        "either there is no collapse.",
    )
    collisions: q.Count | None = Field(
        default=None,
        description="Stop after this many collisions; with `time`, whichever comes first.",
    )
    time: q.Positive | None = Field(
        default=None,
        validate_default=True,
        description="Stop at this time, s; with `collisions`, whichever comes first.",
    )
    repeats: q.Count = Field(
        default=1, description="Runs of every point, each with its own random start."
    )
    seed: q.Seed = Field(default=1, description="Seed of the random starts.")
    record: q.Record = Field(
        default="events", description="What is stored: every collision, or only a summary."
    )
    sweep: Annotated[
        Axes,
        PlainValidator(axes, json_schema_input_type=dict[str, Any]),
        PlainSerializer(written, return_type=dict[str, Any]),
    ] = Field(
        default=(),
        description="A grid over keys (dotted paths), each with a list of values, range(1, 6) or "
        "start:stop:count; the last key runs fastest. Keys under zip, or under each item of a list "
        "there, change together: they are one axis of the grid, at the place of zip.",
    )

    @field_validator("container")
    @classmethod
    def _has_sound_keys(cls, container: ContainerConfig) -> ContainerConfig:
        _refuse(_faults_of_container(container))
        return container

    # A container or `collisions` that failed its own check is not in info.data.

    @field_validator("balls")
    @classmethod
    def _fit_the_container(cls, balls: AnyBalls, info: ValidationInfo) -> AnyBalls:
        if container := info.data.get("container"):
            _refuse(_faults_of_balls(container, balls))
        return balls

    @field_validator("collapse")
    @classmethod
    def _has_a_wall_to_slide_on(cls, collapse: Collapse, info: ValidationInfo) -> Collapse:
        container = info.data.get("container")
        if container and collapse == "slide":
            _refuse(_faults_of_slide(container))
        return collapse

    @field_validator("time")
    @classmethod
    def _has_an_end(cls, time: float | None, info: ValidationInfo) -> float | None:
        if time is None and info.data.get("collisions", 0) is None:
            raise PydanticCustomError("endless", "collisions or time is needed")
        return time

    @property
    def effective_wall_cor(self) -> float:
        """Coefficient of restitution at the wall, `cor` unless `wall_cor` is given."""
        return self.cor if self.wall_cor is None else self.wall_cor

    @property
    def contact_duration(self) -> float:
        """Duration of a contact in the TC model, mean free times; zero without the model."""
        return self.collapse.tc if isinstance(self.collapse, ContactDuration) else 0.0

    @property
    def elastic_below(self) -> float:
        """Relative normal speed below which collisions are elastic, m/s; zero if none are."""
        return self.collapse.elastic_below if isinstance(self.collapse, ElasticBelow) else 0.0

    @property
    def species(self) -> tuple[Species, ...]:
        """The species of balls given by count; none of rings or a list."""
        if isinstance(self.balls, BallCount):
            return (self.balls,)
        return self.balls if isinstance(self.balls, tuple) else ()

    @property
    def start(self) -> str:
        """Places of balls given by count at the start, "lattice" or "random"."""
        return next((each.start for each in self.species if each.start), "lattice")

    @property
    def packing(self) -> tuple[str, float] | None:
        """The key that gives the packing, and its value."""
        found = _packings(self.container, self.balls)
        return next(((rendered(path), packing) for path, packing in found.items()), None)


# The JSON schema of a configuration file, for editors and other programs.

_SEVERAL = {
    "type": ["array", "string"],
    "minItems": 1,
    "pattern": r"^\s*(range\s*\(.*\)|[^:]+:[^:]+:[^:]+)\s*$",
}
"""A list of values, or the text of a range."""


class _Generator(GenerateJsonSchema):
    """Pydantic's generator without invented titles, and with null for the infinite default."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def encode_default(self, dft: Any) -> Any:
        return None if dft == math.inf else super().encode_default(dft)


def schema() -> dict[str, Any]:
    """A JSON schema (draft 2020-12) made from the models; `sweep` lists what can be swept."""
    document = Experiment.model_json_schema(schema_generator=_Generator)
    properties, definitions = document["properties"], document["$defs"]
    swept: dict[str, Any] = {}
    for key, entry in properties.items():
        homes = _models(entry)
        for home in homes:
            for inner, inner_entry in definitions[home]["properties"].items():
                if not _models(inner_entry.get("items", {})):
                    swept[f"{key}.{inner}"] = _axis(inner_entry)
        words = [each for each in entry.get("oneOf", ()) if each.get("type") == "string"]
        if words:
            swept[key] = _axis({**words[0], "description": entry["description"]})
        elif not homes and key not in WHOLE_RUN:
            swept[key] = _axis(entry)
    group = _closed(
        {
            key: {**_SEVERAL, "items": {"$ref": f"#/properties/sweep/properties/{key}/items"}}
            for key in swept
        }
    )
    zipped = {
        "description": "Keys that change together: lists of equal length, or several such groups "
        "as a list.",
        "anyOf": [group, {"type": "array", "items": group}],
    }
    description = properties["sweep"]["description"]
    properties["sweep"] = {"description": description, **_closed({**swept, ZIP: zipped})}
    return {
        "$schema": GenerateJsonSchema.schema_dialect,
        **document,
        "title": "snooker experiment",
        "anyOf": [{"required": ["collisions"]}, {"required": ["time"]}],
    }


def _models(entry: dict[str, Any]) -> list[str]:
    """The models that a schema refers to, itself or as alternatives."""
    alternatives = (entry, *entry.get("oneOf", ()))
    return [each["$ref"].rsplit("/", 1)[1] for each in alternatives if "$ref" in each]


def _axis(entry: dict[str, Any]) -> dict[str, Any]:
    """The schema of a list of values of one key."""
    value = {name: part for name, part in entry.items() if name not in ("default", "description")}
    return {
        **_SEVERAL,
        "description": entry["description"],
        "items": value,
        "uniqueItems": True,
    }


def _closed(properties: dict[str, Any]) -> dict[str, Any]:
    """The schema of a mapping of swept keys, among them those of single balls or species."""
    return {
        "type": "object",
        "properties": properties,
        "patternProperties": {
            rf"^{key}\[[0-9]+\]\.": _SEVERAL for key in ("balls", r"balls\.list")
        },
        "additionalProperties": False,
    }
