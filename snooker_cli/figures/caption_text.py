"""The parts of a caption and their order, and the sentences on the scene at its end."""

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from snooker_cli import facts
from snooker_cli.analysis.decay import early_endings
from snooker_cli.config import Point
from snooker_cli.containers import Circle
from snooker_cli.errors import FigureError
from snooker_cli.figures.declared_result import with_units_of_axes
from snooker_cli.figures.series import SCENE_WORDS, described
from snooker_cli.formatting import least_to_most
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection, distinct, statuses, unfinished, unlisted, value_at


class Caption(NamedTuple):
    """The parts of a caption in the order in which a reader needs them, each of sentences.

    shows : what y is
    result : the result with its error, and how far it is from theory
    theory : which theory is drawn, and where it is from
    drawn : what lines, bands, markers and bars are
    scene : the scene, and its repeats
    """

    shows: Sequence[str]
    result: Sequence[str]
    theory: Sequence[str]
    drawn: Sequence[str]
    scene: Sequence[str]

    @property
    def text(self) -> str:
        """All sentences, with the units of axes."""
        return with_units_of_axes(" ".join(filter(None, itertools.chain(*self))))


def theory_sentence(sources: Mapping[str, str]) -> str:
    """A sentence on theories by their names, with their sources; empty without one."""
    named = [f"{name} ({source})" for name, source in sources.items()]
    return f"Theory: {'; '.join(named)}." if named else ""


def setting(run: RunFolder, points: Sequence[Point], selection: Selection) -> str:
    """The sentences that end a caption: the scene's constants, the repeats and their endings."""
    ended = [status for point in points for status in statuses(run, point, selection)]
    for status in ended:
        status.raise_if_unusable()
    early = early_endings(Counter(status.header.stop.reason for status in ended if status.header))
    numbers = {run.requested(point) for point in points}
    number = least_to_most(numbers, str)
    single = numbers == {1} or selection.repeat is not None
    repeats = f"{number} repeats" if numbers != {1} else "one repeat"
    if selection.repeat is not None:
        repeats = f"repeat {selection.repeat} of {number}"
    ends = [
        described(points[0], key)
        for key in ("collisions", "time")
        if len(distinct(points, key)) == 1 and value_at(points[0], key) is not None
    ]
    length = f", {'at most ' if early else ''}{' or '.join(ends)}" if ends else ""
    scene = f"Scene: {', '.join(_constants(points))}; {repeats}{length}"
    sentences = [
        f"{scene}: {early or ('complete' if single else 'all complete')}.",
        f"T{missing[1:]}." if (missing := unfinished(run, selection)) else "",
        f"T{others[1:]}." if (others := unlisted(run)) and not selection.where else "",
    ]
    return " ".join(filter(None, sentences))


def _constants(points: Sequence[Point]) -> Iterator[str]:
    config = points[0].config
    if isinstance(config.balls, tuple):
        yield f"N = {config.number} of several species"
    elif balls := getattr(config.balls, "list", None):
        yield f"N = {len(balls)}"
    wall = any(facts.hold(point.config, "walls") for point in points)
    for key in SCENE_WORDS:
        try:
            first, *others = distinct(points, key)
        except FigureError:
            continue  # not a key of these balls
        is_default = first is None or first == Circle.name or (key == "wall_cor" and not wall)
        if not others and not is_default:
            yield described(points[0], key, SCENE_WORDS)
