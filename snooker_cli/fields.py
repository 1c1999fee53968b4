"""What moves in a scene, and what an event has: each quantity once, with its unit and its names.

Scenes, states, files, hashes, exports and starts from a state go through these tables in order. So
a new quantity of balls is an entry here, a field of ``Scene`` and of ``States``, and what the
engine does with it.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ALWAYS = "positions"
"""The field of ``Scene`` that all scenes have."""


class MovingField(NamedTuple):
    """A quantity of balls, or of the container, that changes in a repeat.

    name : the field of ``Scene``
    in_states : the field of ``States``
    key : of a ball in a config
    element : its name in H5MD
    unit : as in files
    titles : of its columns in exported tables; a vector has two
    of_container : whether it is the container's
    needs : the field of ``Scene`` that is ``None`` where there is no such quantity
    """

    name: str
    in_states: str
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
    MovingField("positions", "positions", "position", "position", "m", ("x", "y")),
    MovingField("velocities", "velocities", "velocity", "velocity", "m s-1", ("u", "v")),
    MovingField(
        *("container_position", "container_positions", "position", "position", "m", ("x", "y")),
        of_container=True,
    ),
    MovingField(
        *("container_velocity", "container_velocities", "velocity", "velocity", "m s-1"),
        *(("u", "v"), True),
    ),
    MovingField("spins", "spins", "spin", "angular_velocity", "s-1", ("spin",), needs="surface"),
)


OPTIONAL = sorted({field.needs for field in MOVING} - {ALWAYS})


def moving_fields(scene: Any) -> Sequence[MovingField]:
    """The quantities that a scene has."""
    return _without(tuple([name for name in OPTIONAL if getattr(scene, name) is None]))


@cache
def _without(absent: tuple[str, ...]) -> Sequence[MovingField]:
    """The quantities that do not need any of these fields of a scene."""
    return tuple(field for field in MOVING if field.needs not in absent)


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
