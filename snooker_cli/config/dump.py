"""An experiment -> canonical JSON text, which loads back to an equal experiment."""

import json
import math
from typing import Any

from snooker_cli.config.models import Experiment


def to_json(experiment: Experiment) -> str:
    """The experiment as one line of JSON (and so of YAML); an infinite mass is null."""
    return json.dumps(plain(experiment), allow_nan=False, ensure_ascii=False)


def plain(experiment: Experiment) -> dict[str, Any]:
    """The experiment as dicts, lists and scalars that JSON can hold; null for infinity."""
    data: dict[str, Any] = _finite(experiment.model_dump())
    return data


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and math.isinf(value) else value
