"""Pydantic's validation errors -> complaints in plain sentences."""

import difflib
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from snooker_cli.config.models import BALLS, REGULARISED, Ball, ContainerConfig, Experiment, Species
from snooker_cli.config.problems import Complaint, KeyPath, rendered
from snooker_cli.config.yaml_document import given, is_number

_INFINITE = re.compile(r"[-+]?(inf|infinity)", re.IGNORECASE)


def complaints(
    error: ValidationError, written: Callable[[KeyPath], str] = lambda path: ""
) -> tuple[Complaint, ...]:
    """What an Experiment's validation error says, in its order.

    `written` gives the scalar at a path as its author wrote it, or an empty string.
    """
    found: list[Complaint] = []
    suggested: set[KeyPath] = set()
    missing: list[Complaint] = []
    for each in error.errors(include_url=False):
        location = each["loc"]
        path = _untagged(location)
        kind, value, context = each["type"], each["input"], each.get("ctx", {})
        if kind == "complaints":
            found.extend(context["complaints"])
        elif kind == "needs":
            sentence = _misfit(value, context["needs"], written(path), path)
            found.append(Complaint(path, sentence))
        elif kind == "endless":
            sentence = (
                "neither collisions nor time is given; give at least one, so that the run ends"
            )
            found.append(Complaint(("collisions",), sentence))
        elif kind == "balls":
            found.append(Complaint(path, _no_variant(value, written(path))))
        elif kind == "missing":
            field = _model(location[:-1]).model_fields[str(location[-1])]
            sentence = f"the key is missing; add it: {_phrase(field.description)}"
            missing.append(Complaint(path, sentence, about_key=True))
        elif kind == "extra_forbidden":
            named = given(value, written(path))
            sentence, nearest = _unknown(str(location[-1]), named, _model(location[:-1]))
            found.append(Complaint(path, sentence, about_key=True))
            if nearest:
                suggested.add((*path[:-1], nearest))
        elif kind != "too_short" or not value:
            # Pydantic counts only the valid items, so a list with a bad one can seem too short.
            needs = _structure(kind, path)
            found.append(Complaint(path, _misfit(value, needs, written(path), path)))
    return (*found, *(each for each in missing if each.path not in suggested))


def _untagged(location: KeyPath) -> KeyPath:
    """A pydantic location without the variant's name that follows `balls` or `collapse`."""
    tagged = location[0] in ("balls", "collapse")
    return (location[0], *location[2:]) if tagged else location


def _model(location: KeyPath) -> type[BaseModel]:
    """The model of the mapping at a pydantic location."""
    match location:
        case ("container",):
            return ContainerConfig
        case ("balls", "species", int()):
            return Species
        case ("balls", str(variant)):
            return BALLS[variant]
        case ("balls", *_):
            return Ball
        case ("collapse", str(variant)):
            return REGULARISED[variant]
        case _:
            return Experiment


def _phrase(description: str | None) -> str:
    """A field's description, to stand in the middle of a sentence."""
    text = (description or "").rstrip(".")
    return text[:1].lower() + text[1:]


def _unknown(key: str, named: str, model: type[BaseModel]) -> tuple[str, str | None]:
    """The sentence about an unknown key, and the known key it was probably meant to be.

    named : its value, as a message calls it
    """
    known = list(model.model_fields)
    choice = f"the keys here are {', '.join(known)}"
    if "." in key:
        return f"{named} is given, but dotted keys are for sweep and -o only; {choice}", None
    close = difflib.get_close_matches(key.lower(), known, n=1)
    if close:
        return f"there is no such key for {named}; did you mean {close[0]}?", close[0]
    for name, home in (
        ("container", ContainerConfig),
        *(("balls", each) for each in BALLS.values()),
    ):
        if key in home.model_fields and home is not model:
            other = "" if name == "container" else f" with {next(iter(home.model_fields))}"
            return f"{named} is given, but this key belongs to {name}{other}; {choice}", None
    if key in Experiment.model_fields:
        top = "the top level, without indentation"
        return f"{named} is given, but this key belongs to {top}; {choice}", None
    return f"there is no such key for {named}; {choice}", None


def _no_variant(value: Any, written: str) -> str:
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
    """What is needed where pydantic found another kind of structure."""
    if kind == "too_short":
        return f"a list of at least one {'ball' if path[-1] == 'list' else 'species'}"
    return "a list of balls" if path[-1] == "list" else "a mapping of keys to values"


def _misfit(value: Any, needs: str, written: str, path: KeyPath) -> str:
    """The sentence about a value that is not what is needed."""
    advice = _advice(value, needs, path)
    return f"{given(value, written)} is given where {needs} is needed; {advice}"


def _advice(value: Any, needs: str, path: KeyPath) -> str:
    if isinstance(value, str):
        return _advice_on_text(value, needs)
    if isinstance(value, tuple | list) and "number" in needs and "pair" not in needs:
        key = rendered(path)
        return f"to run several values, list them under sweep, or write -o {key}=VALUE,VALUE"
    if isinstance(value, bool) or not isinstance(value, int | float) or "number" not in needs:
        return "give one"
    if math.isnan(value):
        return "give a number"
    return "choose one in that range"


def _advice_on_text(value: str, needs: str) -> str:
    if "number" not in needs:
        return "give one"
    if is_number(value):
        return "remove the quotes"
    if _INFINITE.fullmatch(value.strip()):
        return "infinity is written .inf" if ".inf" in needs else "give a finite one"
    if value.strip().lower().lstrip("+-.") == "nan":
        return "nan is none"
    if is_number(value.replace(",", ".", 1)):
        return "write a decimal point"
    if is_number(value.replace("_", "")):
        return "remove the underscores"
    if re.match(r"[-+]?[0-9.]", value):
        return "write the number alone, without a unit or anything else"
    return "give one"
