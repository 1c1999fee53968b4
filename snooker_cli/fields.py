"""What moves in a scene, and what an event has: each quantity once, with its unit and its names.

Scenes, states, records of the engine, files, hashes, exports, pages and starts from a state go
through these tables in order. So a new quantity of balls is an entry here, a field of ``Scene``,
and what the engine does with it; a new column of events is an entry here, a field of ``Events``,
and what the engine writes.
"""

from collections.abc import Container, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ALWAYS = "positions"
"""The field of ``Scene`` that all scenes have."""


class MovingField(NamedTuple):
    """A quantity of balls, or of the container, that changes in a repeat.

    name : the field of ``Scene`` and of ``States``
    key : of a ball in a config
    element : its name in H5MD
    unit : as in files
    titles : of its columns in exported tables; a vector has two
    of_container : whether it is the container's
    needs : the field of ``Scene`` that is ``None`` where there is no such quantity
    """

    name: str
    key: str
    element: str
    unit: str
    titles: tuple[str, ...]
    of_container: bool = False
    needs: str = ALWAYS

    @property
    def is_vector(self) -> bool:
        """Whether it has a component along x and one along y."""
        return len(self.titles) == 2

    def shape(self, balls: int) -> tuple[int, ...]:
        """The shape of its values for a number of balls; the container counts as one."""
        number = 1 if self.of_container else balls
        return (number, 2) if self.is_vector else (number,)

    def rows(self, scenes: Any) -> NDArray[np.float64]:
        """Its values in scenes, a row for each, of `shape`."""
        values = np.array([getattr(scene, self.name) for scene in scenes])
        return values.reshape(len(values), *self.shape(scenes[0].number))

    def of_row(self, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """The field of ``Scene`` from a row of `rows`."""
        return row[0] if self.of_container else row


MOVING = (
    MovingField("positions", "position", "position", "m", ("x", "y")),
    MovingField("velocities", "velocity", "velocity", "m s-1", ("u", "v")),
    MovingField("container_position", "position", "position", "m", ("x", "y"), of_container=True),
    MovingField(
        "container_velocity", "velocity", "velocity", "m s-1", ("u", "v"), of_container=True
    ),
    # What follows each ball has beside its motion.
    MovingField("spins", "spin", "angular_velocity", "s-1", ("spin",), needs="surface"),
)

CARRIED = 4
"""Where in `MOVING` these begin."""


def moving_fields(scene: Any) -> Sequence[MovingField]:
    """The quantities that a scene has."""
    return _without(_absent(scene))


@cache
def _without(absent: tuple[str, ...]) -> Sequence[MovingField]:
    """The quantities that do not need any of these fields of a scene."""
    return tuple(field for field in MOVING if field.needs not in absent)


def carried_fields(scene: Any) -> Sequence[MovingField]:
    """The quantities that each ball of a scene has beside its place and its velocity."""
    return moving_fields(scene)[CARRIED:]


class EventColumn(NamedTuple):
    """What an event has.

    name : the field of ``Events``
    kind : of its little-endian numbers
    unit : as in files
    path : of the element in files; i and j share one
    title : in exported tables; ``None`` of what only long repeats have, and only in files
    needs : the field of ``Scene`` that is ``None`` where there is no such column
    """

    name: str
    kind: str
    unit: str
    path: str
    title: str | None
    needs: str = ALWAYS


EVENT_COLUMNS = (
    EventColumn("time", "<f8", "s", "observables/time", "time"),
    EventColumn("i", "<i4", "1", "connectivity/collisions", "i"),
    EventColumn("j", "<i4", "1", "connectivity/collisions", "j"),
    EventColumn("impulse", "<f8", "kg m s-1", "observables/impulse", "impulse"),
    EventColumn(
        *("tangential", "<f8", "kg m s-1", "observables/tangential_impulse", "tangential_impulse"),
        needs="surface",
    ),
    EventColumn("residual", "<f8", "s", "observables/residual", None),
)
"""In the order of hashes."""

REQUIRED = tuple(c.name for c in EVENT_COLUMNS if c.title and c.needs == ALWAYS)
"""The columns that all events have."""


def record_type(names: Container[str]) -> np.dtype[np.void]:
    """The type of an event as the engine records and hashes it: its columns, without gaps.

    names : of the columns that the events have; times are whole, without a residual
    """
    return np.dtype([(c.name, c.kind) for c in EVENT_COLUMNS if c.title and c.name in names])


def record_type_of(scene: Any) -> np.dtype[np.void]:
    """The type of the events that the engine records of a scene."""
    absent = _absent(scene)
    return record_type([column.name for column in EVENT_COLUMNS if column.needs not in absent])


OPTIONAL = sorted({entry.needs for entry in (*MOVING, *EVENT_COLUMNS)} - {ALWAYS})


def _absent(scene: Any) -> tuple[str, ...]:
    """The fields that a scene may have, and does not."""
    return tuple([name for name in OPTIONAL if getattr(scene, name) is None])
