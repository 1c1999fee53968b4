"""A value -> what a message calls it, short enough for a sentence."""

import math
from collections.abc import Mapping
from itertools import islice
from typing import Any

from snooker_cli.config.paths import shown
from snooker_cli.config.scalars import resolved

_MOST_ITEMS = 30
"""More fill a sentence's room for a value, whatever they are."""


def given(value: Any, written: str = "") -> str:
    """A value, named so that its author recognises it.

    written : a scalar as its author wrote it, if that is known
    """
    if value is None:
        return "nothing (null)"
    if isinstance(value, bool):
        return f"the truth value {str(value).lower()}"
    if isinstance(value, str):
        quoted = written if written[:1] in ("'", '"') else value
        return f"the text {shown(quoted)}" if quoted else "an empty text"
    if isinstance(value, Mapping):
        return f"the mapping {shown(_flow(value))}" if value else "an empty mapping"
    if isinstance(value, tuple | list):
        return f"the list {shown(_flow(value))}" if value else "an empty list"
    return shown(written or _flow(value))


def _flow(value: Any) -> str:
    """A value on one line as YAML has it, of lists and mappings the first items."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case str():
            return value if _is_plain(value) else f"'{value}'"
        case float() if math.isnan(value):
            return ".nan"
        case float() if math.isinf(value):
            return ".inf" if value > 0 else "-.inf"
        case Mapping():
            items = (f"{key}: {_flow(item)}" for key, item in islice(value.items(), _MOST_ITEMS))
            return f"{{{', '.join(items)}}}"
        case list() | tuple():
            return f"[{', '.join(map(_flow, islice(value, _MOST_ITEMS)))}]"
        case _:
            return str(value)


def _is_plain(text: str) -> bool:
    """Whether a text without quotes would be read as that text."""
    try:
        return isinstance(resolved(text), str)
    except ValueError:
        return False
