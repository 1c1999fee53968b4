"""The types of scenes that tests use: each needs kernels of its own, some seconds of compiling.

A scene's type is the classes of its boundary, its balls and their surface, and of the search and
the samples of a run. A test takes scenes of the types listed here. If its subject is another one,
the list gets that type.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

CLASSES = (
    *(
        "FixedCircle",
        "FreeCircle",
        "SlidingCircle",
        "StraightWalls",
        "ChannelSides",
        "PeriodicSides",
    ),
    *("EqualBalls", "UnequalBalls", "Smooth", "Rough", "Everyone", "Neighbours"),
    *("NoSamples", "Grid"),
)

EVERYONE, NEIGHBOURS, EVENTS, SUMMARIES = "Everyone", "Neighbours", "NoSamples", "Grid"
BOTH = (EVENTS, SUMMARIES)

RUNS: dict[str, dict[str, tuple[str, ...]]] = {
    "FixedCircle EqualBalls Smooth": {EVERYONE: BOTH, NEIGHBOURS: BOTH},
    "FixedCircle EqualBalls Rough": {EVERYONE: BOTH, NEIGHBOURS: BOTH},
    "FixedCircle UnequalBalls Smooth": {EVERYONE: BOTH, NEIGHBOURS: BOTH},
    "FixedCircle UnequalBalls Rough": {EVERYONE: (EVENTS,), NEIGHBOURS: (EVENTS,)},
    "FixedCircle SlidingCircle EqualBalls Smooth": {EVERYONE: BOTH},
    "FixedCircle SlidingCircle EqualBalls Rough": {EVERYONE: (EVENTS,)},
    "FreeCircle EqualBalls Smooth": {EVERYONE: BOTH, NEIGHBOURS: BOTH},
    "FreeCircle EqualBalls Rough": {EVERYONE: BOTH, NEIGHBOURS: (EVENTS,)},
    "FreeCircle UnequalBalls Smooth": {EVERYONE: BOTH, NEIGHBOURS: BOTH},
    "FreeCircle UnequalBalls Rough": {EVERYONE: (EVENTS,)},
    "StraightWalls EqualBalls Smooth": {NEIGHBOURS: BOTH},
    "StraightWalls EqualBalls Rough": {NEIGHBOURS: BOTH},
    "StraightWalls UnequalBalls Smooth": {NEIGHBOURS: BOTH},
    "StraightWalls UnequalBalls Rough": {NEIGHBOURS: (EVENTS,)},
    "ChannelSides EqualBalls Smooth": {NEIGHBOURS: BOTH},
    "ChannelSides EqualBalls Rough": {NEIGHBOURS: BOTH},
    "ChannelSides UnequalBalls Smooth": {NEIGHBOURS: BOTH},
    "PeriodicSides EqualBalls Smooth": {NEIGHBOURS: BOTH},
    "PeriodicSides EqualBalls Rough": {NEIGHBOURS: BOTH},
    "PeriodicSides UnequalBalls Smooth": {NEIGHBOURS: BOTH},
    "PeriodicSides UnequalBalls Rough": {NEIGHBOURS: (EVENTS,)},
}
"""Scenes that tests simulate, how their contacts are found, and what is recorded. ``compile_ahead``
compiles those that many tests have."""

LISTED = {
    *RUNS,  # replays
    *(
        f"{scene} {search} {record}"
        for scene, searches in RUNS.items()
        for search, records in searches.items()
        for record in records
    ),
}


class CompiledTypes:
    """The types for which this process has compiled kernels although they are in no list."""

    def __init__(self) -> None:
        self.unlisted: list[str] = []

    def watch(self) -> None:
        """Note each kernel that Numba compiles from now on."""
        from numba.core import event

        types = self

        class Listener(event.Listener):  # type: ignore[misc]  # Numba has no types
            depth = 0

            def on_start(self, event: Any) -> None:
                self.depth += 1
                if self.depth == 1:
                    types.note(event.data["dispatcher"].py_func, event.data["args"])

            def on_end(self, event: Any) -> None:
                self.depth -= 1

        event.register("numba:compile", Listener())

    def note(self, kernel: Callable[..., Any], arguments: Sequence[Any]) -> None:
        """Note a kernel that is compiled for some types of arguments."""
        name = type_of_scene(arguments)
        if kernel.__module__.startswith("snooker_cli.engine") and name and name not in LISTED:
            self.unlisted.append(name)


def type_of_scene(arguments: Sequence[Any]) -> str:
    """The classes of a scene in Numba's types of arguments, in the order of ``CLASSES``."""
    names, parts = set(), [*arguments]
    for part in parts:
        if hasattr(part, "instance_class"):
            names.add(part.instance_class.__name__)
            parts.extend(part.types)
    return " ".join(name for name in CLASSES if name in names)
