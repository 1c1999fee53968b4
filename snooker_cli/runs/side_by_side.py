"""Several runs as one: their points are those of a sweep whose first key is the run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from snooker_cli.config import Point
from snooker_cli.config.points import LIMITS, single_values
from snooker_cli.errors import RunError
from snooker_cli.formatting import listed
from snooker_cli.runs.run import RUN, Check, RepeatStatus, RunFolder

NOT_COMPARED = {
    *("title", "repeats", "sweep", "seed", "common_random", "record", "snapshots"),
    *LIMITS,
}
"""Keys in which runs may differ without being other experiments."""


@dataclass(frozen=True)
class FoldersSideBySide(RunFolder):
    """Several runs as one, for analyses and figures. Their folders stay as they are.

    The parameters of a point are its run's name, the keys that a run sweeps, and the single values
    in which the runs differ. A key that an experiment does not have is ``None`` there.

    runs : these runs; ``directory`` and ``experiment`` are those of the first
    """

    runs: tuple[RunFolder, ...] = ()

    @classmethod
    def of(cls, runs: Sequence[RunFolder]) -> Self:
        """These runs as one. Raises ``RunError`` for a run that is given twice."""
        folders = [run.directory.resolve() for run in runs]
        for folder in folders:
            if folders.count(folder) > 1:
                raise RunError(f"{folder.name}: this run is given twice; give each run once")
        names = _names(runs)
        keys = _keys(runs)
        points = [
            replace(point, parameters=((RUN, name), *((key, _value(point, key)) for key in keys)))
            for run, name in zip(runs, names, strict=True)
            for point in run.points
        ]
        numbered = tuple(replace(point, index=index) for index, point in enumerate(points))
        return cls(runs[0].directory, runs[0].config, numbered, runs=tuple(runs))

    @property
    def name(self) -> str:
        """The names of the runs: ``A and B``."""
        return listed(list(dict.fromkeys(str(dict(p.parameters)[RUN]) for p in self.points)))

    @property
    def unlisted(self) -> int:
        """How many points are stored that the sweeps of these runs no longer list."""
        return sum(run.unlisted for run in self.runs)

    @cached_property
    def _origins(self) -> list[tuple[RunFolder, Point]]:
        """The run and its point, of each point."""
        return [(run, point) for run in self.runs for point in run.points]

    def origin(self, point: Point) -> tuple[RunFolder, Point]:
        """The run that has a point, and the point as this run has it."""
        return self._origins[point.index]

    def batches(self, point: int) -> list[Path]:
        """The files of a point's batches, in the folder of its run."""
        run, own = self._origins[point]
        return run.batches(own.index)

    def statuses(self, point: int, *, check: Check | None = None) -> list[RepeatStatus]:
        """Whether each repeat of a point is done, as its run has it."""
        run, own = self._origins[point]
        return run.statuses(own.index, check=check)

    @property
    def can_be_replayed(self) -> bool:
        """Whether the repeats of all runs are those of this engine."""
        return all(run.can_be_replayed for run in self.runs)

    @property
    def common_random_notes(self) -> list[str]:
        """None: points of different runs have different random numbers."""
        return []


def _names(runs: Sequence[RunFolder]) -> list[str]:
    """The names of the runs' folders; with the folder above where two have one name."""
    names = [run.name for run in runs]
    return [
        str(Path(*run.directory.resolve().parts[-2:])) if names.count(run.name) > 1 else run.name
        for run in runs
    ]


def _keys(runs: Sequence[RunFolder]) -> list[str]:
    """The keys that a run sweeps, then those whose single values differ between the runs."""
    swept = dict.fromkeys(key for run in runs for key, _ in run.points[0].parameters)
    settings = [single_values(run.config) for run in runs]
    named = dict.fromkeys(
        key for values in settings for key in values if key not in {*swept, *NOT_COMPARED}
    )
    differing = [key for key in named if len({repr(values.get(key)) for values in settings}) > 1]
    return [*swept, *differing]


def _value(point: Point, key: str) -> Any:
    """A point's value of a key; ``None`` if its experiment does not have this key."""
    parameters = dict(point.parameters)
    if key in parameters:
        return parameters[key]
    return single_values(point.config).get(key)
