"""The frozen model of an experiment: what may be written, in which unit, in which range."""

from typing import Annotated, Any

from pydantic import Field, PlainSerializer, PlainValidator, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from snooker_cli.config import quantities as q
from snooker_cli.config.agreement import (
    AnyBalls,
    faults_of_balls,
    faults_of_container,
    faults_of_slide,
)
from snooker_cli.config.axes import Axes, axes, written
from snooker_cli.config.balls import Balls, Container, Gas, Model, Species
from snooker_cli.config.collapse import Collapse, ContactDuration, ElasticBelow
from snooker_cli.config.problems import refusal


class Experiment(Model):
    """A snooker experiment: inelastic hard disks in a container."""

    title: q.Title | None = Field(default=None, description="Name shown in tables.")
    container: Container = Field(description="Container: a circle, a box or a periodic box.")
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
        description="What to do about infinitely many collisions in finite time: stop and say so, "
        "the default, which is right everywhere; let a ball slide along a circle's fixed wall "
        "after them (slide); or have contacts last (tc) or slow collisions elastic "
        "(elastic_below), so that there are none.",
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
        "there, walk together: one axis of the grid, in the place of zip.",
    )

    @field_validator("container")
    @classmethod
    def _is_sound(cls, container: Container) -> Container:
        if found := tuple(faults_of_container(container)):
            raise refusal(found)
        return container

    @field_validator("balls")
    @classmethod
    def _agree_with_container(cls, balls: AnyBalls, info: ValidationInfo) -> AnyBalls:
        # A container that failed its own check is not in info.data.
        container = info.data.get("container")
        if container and (found := tuple(faults_of_balls(container, balls))):
            raise refusal(found)
        return balls

    @field_validator("collapse")
    @classmethod
    def _has_a_wall_to_slide_on(cls, collapse: Collapse, info: ValidationInfo) -> Collapse:
        container = info.data.get("container")
        if collapse == "slide" and container and (found := tuple(faults_of_slide(container))):
            raise refusal(found)
        return collapse

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

    @property
    def contact_duration(self) -> float:
        """How long a contact lasts in the TC model, mean free times; zero without it."""
        return self.collapse.tc if isinstance(self.collapse, ContactDuration) else 0.0

    @property
    def elastic_below(self) -> float:
        """Relative normal speed below which collisions are elastic, m/s; zero if none are."""
        return self.collapse.elastic_below if isinstance(self.collapse, ElasticBelow) else 0.0

    @property
    def species(self) -> tuple[Species, ...]:
        """The species of balls given by count; none of rings or a list."""
        if isinstance(self.balls, Gas):
            return (self.balls,)
        return self.balls if isinstance(self.balls, tuple) else ()

    @property
    def start(self) -> str:
        """Where balls given by count are at the start, "lattice" or "random"."""
        return next((each.start for each in self.species if each.start), "lattice")

    @property
    def packing(self) -> tuple[str, float] | None:
        """The key that gives the packing, and its value."""
        if self.container.packing is not None:
            return "container.packing", self.container.packing
        if isinstance(self.balls, Gas) and self.balls.packing is not None:
            return "balls.packing", self.balls.packing
        return None
