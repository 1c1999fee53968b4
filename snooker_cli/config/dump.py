"""An experiment -> canonical YAML or JSON text, which loads back to an equal experiment."""

import json
import math
from typing import Any

import yaml

from snooker_cli.config.models import Experiment
from snooker_cli.config.scalars import resolved


def to_yaml(experiment: Experiment) -> str:
    """The experiment as YAML, defaults written out, keys that are null left out."""
    data = experiment.model_dump(exclude_none=True)
    text = yaml.dump(
        data,
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        default_flow_style=None,
        width=100,
    )
    return str(text)


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


class _Dumper(yaml.SafeDumper):
    """Writes YAML that means the same under YAML 1.1 and 1.2: doubtful text is quoted."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    style = None if isinstance(resolved(text), str) else "'"
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _text)
