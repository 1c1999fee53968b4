"""Document -> Experiment, or everything that is wrong with it at once."""

import math
from collections.abc import Iterator
from dataclasses import replace

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from snooker_cli.config.axes import Axes, axes
from snooker_cli.config.document import Document
from snooker_cli.config.models import Experiment
from snooker_cli.config.paths import Data, rendered
from snooker_cli.config.problems import Complaint, ConfigError, Problem
from snooker_cli.config.sweep import tried, unswept
from snooker_cli.config.translation import complaints

MAX_REPEATS = 1_000_000
"""Repeats of all points of a run: as many files, in as many steps of whatever reads a run."""

BYTES_A_FILE = 12_000
"""As large as that of one ball and one collision."""


def validated(document: Document) -> Experiment:
    """The experiment a document describes, every swept value tried; raises ConfigError."""
    found: tuple[Complaint, ...]
    try:
        experiment = Experiment.model_validate(document.data)
    except ValidationError as error:
        wrong = complaints(error, document.written)
        data = {**document.data, "sweep": None}
        sweep = _sound_axes(document.data.get("sweep"))
        _, unfit = tried(data, sweep, document.written, wrong)
        found = (*_of_swept_keys(wrong, sweep), *unfit)
    else:
        sweep, unfit = tried(unswept(experiment), experiment.sweep, document.written)
        found = (*unfit, *_too_many(experiment))
        if not found and not document.problems:
            return experiment.model_copy(update={"sweep": sweep})
    # A key whose YAML is at fault has no value yet that could be judged.
    unreadable = {problem.key for problem in document.problems}
    raise ConfigError(
        (
            *document.problems,
            *(
                Problem(document.position(each.path, each.about_key), key, each.sentence)
                for each in found
                if (key := rendered(each.path)) not in unreadable
            ),
        )
    )


def _of_swept_keys(found: tuple[Complaint, ...], sweep: Axes) -> Iterator[Complaint]:
    """The complaints; about a key that is missing but swept they say that this is not enough."""
    swept = {key for axis in sweep for key, _ in axis}
    for each in found:
        key = rendered(each.path)
        keys = ("collisions", "time") if each.sentence.startswith("neither") else (key,)
        absent = each.sentence.startswith(("the key is missing", "neither"))
        if absent and (which := swept.intersection(keys)):
            sentence = (
                f"{each.sentence}; that {min(which)} is swept is not enough, it needs a value too"
            )
            each = replace(each, sentence=sentence)
        yield each


def _too_many(experiment: Experiment) -> Iterator[Complaint]:
    """What is wrong with the number of repeats of all points."""
    points = math.prod(len(axis[0][1]) for axis in experiment.sweep)
    total = points * experiment.repeats
    if total > MAX_REPEATS:
        of = f" of {points:,} points are {total:,}" if points > 1 else " are as many"
        sentence = (
            f"{experiment.repeats:,} repeats{of} files, {total * BYTES_A_FILE / 1e9:,.0f} GB or "
            f"more; a run has at most {MAX_REPEATS:,}, so give fewer"
        )
        yield Complaint(("repeats",), sentence)


def _sound_axes(sweep: Data) -> Axes:
    """The axes of a sweep whose values can be tried; the others have been complained about."""
    try:
        return axes(sweep)
    except PydanticCustomError as error:
        sound: Axes = (error.context or {})["axes"]
        return sound
