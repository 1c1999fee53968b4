"""Runs side by side, with the analyses and figures that scripts use."""

from dataclasses import dataclass
from typing import Any

from snooker_cli.api.analyses import AnalysedRun
from snooker_cli.formatting import counted
from snooker_cli.runs.run import RUN
from snooker_cli.runs.side_by_side import FoldersSideBySide


@dataclass(frozen=True, eq=False, repr=False)
class SideBySide(FoldersSideBySide, AnalysedRun):
    """Runs side by side: their ``points`` as those of one run, whose first key is ``run``.

    ``snooker.open("A", "B")`` gives it. Its methods are those of ``Run`` that need no folder of
    their own: ``fit``, ``compare``, ``finding``, ``table``, ``plot``, ``save_figures``, ``films``
    and ``animate``.
    """

    def __repr__(self) -> str:
        return f"<runs {self.name}: {counted(len(self.points), 'point')}>"

    @property
    def _first(self) -> dict[str, Any]:
        """The names of all runs, which choose all points: a page refuses more than four films."""
        return {RUN: tuple(dict.fromkeys(dict(point.parameters)[RUN] for point in self.points))}
