"""Document -> Experiment, or everything that is wrong with it at once."""

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from snooker_cli.config.axes import Axes, axes
from snooker_cli.config.document import Document
from snooker_cli.config.models import Experiment
from snooker_cli.config.paths import Data, rendered
from snooker_cli.config.problems import Complaint, ConfigError, Problem
from snooker_cli.config.sweep import tried, unswept
from snooker_cli.config.translation import complaints


def validated(document: Document) -> Experiment:
    """The experiment a document describes, every swept value tried; raises ConfigError."""
    found: tuple[Complaint, ...]
    try:
        experiment = Experiment.model_validate(document.data)
    except ValidationError as error:
        wrong = complaints(error, document.written)
        data = {**document.data, "sweep": None}
        _, unfit = tried(data, _sound_axes(document.data.get("sweep")), document.written, wrong)
        found = (*wrong, *unfit)
    else:
        sweep, found = tried(unswept(experiment), experiment.sweep, document.written)
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


def _sound_axes(sweep: Data) -> Axes:
    """The axes of a sweep whose values can be tried; the others have been complained about."""
    try:
        return axes(sweep)
    except PydanticCustomError as error:
        sound: Axes = (error.context or {})["axes"]
        return sound
