"""Pydantic's validation errors -> complaints in plain sentences."""

import difflib
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from snooker_cli.config.field_types import Form
from snooker_cli.config.models import BALLS, REGULARISED, Ball, ContainerConfig, Experiment, Species
from snooker_cli.config.problems import Complaint, KeyPath, given, rendered
from snooker_cli.config.yaml_document import is_number

_INFINITE = re.compile(r"[-+]?(inf|infinity)", re.IGNORECASE)

_MODELS: dict[KeyPath, type[BaseModel]] = {
    ("container",): ContainerConfig,
    **{("balls", tag): model for tag, model in BALLS.items()},
    ("balls", "list", "list"): Ball,
    ("balls", "species"): Species,
    **{("collapse", tag): model for tag, model in REGULARISED.items()},
}
"""The model at each pydantic location, without its indices; of others it is Experiment."""

_NO_END = "neither collisions nor time is given; give at least one, so that the run ends"


def complaints(
    error: ValidationError, written: Callable[[KeyPath], str] = lambda path: ""
) -> tuple[Complaint, ...]:
    """The complaints of an Experiment's validation error, missing keys last.

    `written` gives the scalar at a path as its author wrote it, or an empty string.
    """
    found: list[Complaint] = []
    suggested: set[KeyPath] = set()
    missing: list[Complaint] = []
    for each in error.errors(include_url=False):
        location, value = each["loc"], each["input"]
        # The name of a union's variant follows balls or collapse.
        path = location[:1] + location[2:] if location[0] in ("balls", "collapse") else location
        model = _MODELS.get(_names(location[:-1]), Experiment)
        match each["type"]:
            case "complaints":
                found.extend(each["ctx"]["complaints"])
            case "needs":
                needs, form = each["ctx"]["needs"], each["ctx"]["form"]
                found.append(_misfit(path, value, written(path), needs, form))
            case "endless":
                found.append(Complaint(("collisions",), _NO_END, missing=("collisions", "time")))
            case "balls":
                found.append(Complaint(path, _no_variant(value, written(path))))
            case "missing":
                text = model.model_fields[str(location[-1])].description or ""
                description = (text[:1].lower() + text[1:]).rstrip(".")
                sentence = f"the key is missing; add it: {description}"
                missing.append(Complaint(path, sentence, True, missing=(rendered(path),)))
            case "extra_forbidden":
                named = given(value, written(path))
                sentence, nearest = _unknown(str(location[-1]), named, model)
                found.append(Complaint(path, sentence, about_key=True))
                suggested.add((*path[:-1], nearest))
            # Pydantic counts only the valid items, so a list with a bad one can seem too short.
            case kind if kind != "too_short" or not value:
                needs = _structure(kind, path)
                found.append(_misfit(path, value, written(path), needs, "other"))
    return (*found, *(each for each in missing if each.path not in suggested))


def _names(location: KeyPath) -> KeyPath:
    """A location without its indices."""
    return tuple(part for part in location if isinstance(part, str))


def _unknown(key: str, named: str, model: type[BaseModel]) -> tuple[str, str]:
    """The sentence about an unknown key, and the known key that was probably meant, if any.

    named : its value, as a sentence calls it
    """
    known = list(model.model_fields)
    choice = f"the keys here are {', '.join(known)}"
    if "." in key:
        return f"{named} is given, but dotted keys are for sweep and -o only; {choice}", ""
    if close := difflib.get_close_matches(key.lower(), known, n=1):
        return f"there is no such key for {named}; did you mean {close[0]}?", close[0]
    homes = {
        "container": ContainerConfig,
        **{f"balls with {variant}": each for variant, each in BALLS.items()},
        "the top level, without indentation": Experiment,
    }
    for name, home in homes.items():
        if key in home.model_fields and home is not model:
            return f"{named} is given, but this key belongs to {name}; {choice}", ""
    return f"there is no such key for {named}; {choice}", ""


def _no_variant(value: Any, written: str) -> str:
    """The sentence about balls that are given in no way or in several."""
    if not isinstance(value, Mapping):
        return (
            f"{given(value, written)} is given where a mapping is needed; write count, rings or "
            "list in it"
        )
    if several := [key for key in BALLS if key in value]:
        both = " and ".join(several)
        return f"both {both} are given; keep one of them, or replace balls as a whole"
    return (
        "neither count, rings nor list is given; give count (any number of balls), rings (a "
        "number) or list (single balls)"
    )


def _structure(kind: str, path: KeyPath) -> str:
    """What is needed where pydantic found another structure."""
    balls = path[-1] == "list"
    if kind == "too_short":
        return f"a list of at least one {'ball' if balls else 'species'}"
    return "a list of balls" if balls else "a mapping of keys to values"


def _misfit(path: KeyPath, value: Any, written: str, needs: str, form: Form) -> Complaint:
    """The complaint about a value that is not what is needed."""
    advice = _advice_on_number(value, form, path) if "number" in form else "give one"
    return Complaint(path, f"{given(value, written)} is given where {needs} is needed; {advice}")


def _advice_on_number(value: Any, form: Form, path: KeyPath) -> str:
    """What to do about a value that is not the number that is needed."""
    if isinstance(value, tuple | list):
        key = rendered(path)
        return f"to run several values, list them under sweep, or write -o {key}=VALUE,VALUE"
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return "give one"
    if not isinstance(value, str):
        return "give a number" if math.isnan(value) else "choose one in that range"
    if is_number(value):
        return "remove the quotes"
    if _INFINITE.fullmatch(value.strip()):
        return "infinity is written .inf" if "infinity" in form else "give a finite one"
    if value.strip().lower().lstrip("+-.") == "nan":
        return "nan is not a number"
    if is_number(value.replace(",", ".", 1)):
        return "write a decimal point"
    if is_number(value.replace("_", "")):
        return "remove the underscores"
    if re.match(r"[-+]?[0-9.]", value):
        return "write the number alone, without a unit or anything else"
    return "give one"
