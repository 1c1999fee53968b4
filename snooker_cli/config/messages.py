"""Pydantic's validation errors -> problems in plain sentences."""

import difflib
import math
import re
from collections.abc import Collection, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from snooker_cli.config.models import BALLS, Ball, Config, ContainerConfig, Species, Start
from snooker_cli.config.problems import (
    MOST_FOUND,
    ConfigError,
    KeyPath,
    Problem,
    excerpt,
    in_words,
    rendered,
)
from snooker_cli.config.yaml_document import is_number

_MODELS: dict[tuple[str, ...], type[BaseModel]] = {
    (): Config,
    ("container",): ContainerConfig,
    ("start",): Start,
    **{("balls", tag): model for tag, model in BALLS.items()},
    ("balls", "list", "list"): Ball,
    ("balls", "species", "count"): Species,
    ("balls", "species", "position"): Ball,
}
"""The model at each pydantic location, without its indices."""

_SYNONYMS = {"restitution": "cor", "e": "cor", "number": "count", "n": "count", "square": "box"}


def config_error(error: ValidationError, outer: tuple[str, ...] = ()) -> ConfigError:
    """The problems of a validation error, of a Config or its part `outer`; no positions."""
    problems: list[Problem] = []
    suggested: set[KeyPath] = set()
    missing: list[Problem] = []
    for fault in error.errors(include_url=False):
        if max(len(problems), len(missing) - len(suggested)) >= MOST_FOUND:
            break
        location, value = (*outer, *fault["loc"]), fault["input"]
        # The tag of a variant follows balls, and the index of a group.
        path = location[:1] + location[2:] if location[:1] == ("balls",) else location
        if location[:2] == ("balls", "species"):
            path = ("balls", *location[2:3], *location[4:])
        names = tuple(part for part in location[:-1] if isinstance(part, str))
        model = _MODELS.get(names, Config)
        match fault["type"]:
            case "value_error":
                problems.extend(fault["ctx"]["error"].problems)
            case "needs":
                needs, is_number = fault["ctx"].values()
                advice = _advice_on_number(value, path) if is_number else ""
                problems.append(_misfit(path, value, needs, advice))
            case "literal_error":
                expected = fault["ctx"]["expected"]
                near = _nearest(value, re.findall("'(.*?)'", expected))
                problems.append(_misfit(path, value, expected, near and f"did you mean {near}?"))
            case "union_tag_not_found":
                problems.append(_no_variant(path, value))
            case "missing":
                text = " ".join(str(model.model_fields[str(location[-1])].description).split())
                sentence = f"the key is missing; add it: {text[0].lower()}{text[1:].rstrip('.')}"
                missing.append(Problem(path, sentence, about_key=True))
            case "extra_forbidden":
                sentence, nearest = _unknown(str(location[-1]), in_words(value), model)
                problems.append(Problem(path, sentence, about_key=True))
                suggested.add((*path[:-1], nearest))
            # Pydantic counts only the valid items, so a list with a bad one can seem too short.
            case "too_short" if not value:
                problems.append(_misfit(path, value, "a list of at least one item"))
            case "tuple_type":
                problems.append(_misfit(path, value, "a list"))
            case name if name != "too_short":
                advice = "write {run: NAME, time: 10}; lattice and random belong to balls"
                advice *= path == ("start",)
                problems.append(_misfit(path, value, "a mapping of keys to values", advice))
    problems += (problem for problem in missing if problem.path not in suggested)
    return ConfigError(problems)


def _unknown(key: str, named: str, model: type[BaseModel]) -> tuple[str, str]:
    """The sentence about an unknown key, and the known key that was probably meant, if any.

    named : its value, as a sentence calls it
    """
    known = list(model.model_fields)
    if key == "gravity":
        return "snooker has no gravity; remove this key", ""
    if key.isdecimal():
        return "a comma ends the number before; write a decimal point, such as 0.5", ""
    choice = f"the keys here are {', '.join(known)}"
    if "." in key:
        return f"{named} is given, but dotted keys are for sweep and -o only; {choice}", ""
    homes = [place for place, home in _MODELS.items() if key in home.model_fields]
    homes.sort(key=lambda place: place == ())  # `start` of balls, before that of a state
    if homes and model is Config:
        parts = dict.fromkeys(place[0] for place in homes)
        dotted = " or ".join(f"{part}.{key}" for part in parts)
        where = f"{' or '.join(parts)}; with -o it is {dotted}"
        return f"{named} is given, but this key belongs to {where}", ""
    if homes:
        name = " with ".join(homes[0][:2]) or "the top level, without indentation"
        return f"{named} is given, but this key belongs to {name}; {choice}", ""
    if near := _nearest(key, known):
        return _meant(key, near), near
    return f"there is no such key; {choice}", ""


def _nearest(text: Any, known: Collection[str]) -> str:
    """The known word that a text probably means; empty if none is near."""
    word = str(text).partition(":")[0].lower()
    near = [_SYNONYMS.get(word, ""), *difflib.get_close_matches(word, known, n=1)]
    return next((key for key in near if key in known), "")


def _meant(key: str, near: str) -> str:
    """The sentence about a key that probably means another, or holds its value too."""
    _, joined, value = key.partition(":")
    if joined:
        return f"a space after the colon is missing; write {near}: {excerpt(value)}"
    return f"there is no such key; did you mean {near}?"


def _no_variant(path: KeyPath, value: Any) -> Problem:
    """The problem of balls that are given in no way or in several."""
    ways = "count (any number of balls), rings (a number) or list (single balls)"
    if not isinstance(value, Mapping):
        sentence = f"{in_words(value)} is given where a mapping is needed; write in it {ways}"
        return Problem(path, sentence)
    if several := [key for key in BALLS if key in value]:
        both = " and ".join(several)
        sentence = f"both {both} are given; keep one of them, or replace balls as a whole"
        return Problem(path, sentence)
    for key in map(str, value):
        if near := _nearest(key, BALLS):
            return Problem((*path, key), _meant(key, near), about_key=True)
    return Problem(path, f"neither count, rings nor list is given; give {ways}")


def _misfit(path: KeyPath, value: Any, needs: str, advice: str = "") -> Problem:
    return Problem(
        path, f"{in_words(value)} is given where {needs} is needed; {advice or 'give one'}"
    )


def _advice_on_number(value: Any, path: KeyPath) -> str:
    if isinstance(value, Mapping):  # a number for each side
        texts = [number for number in value.values() if isinstance(number, str)]
        return _advice_on_number(texts[0], path) if texts else "give one"
    if isinstance(value, tuple | list):
        key = rendered(path)
        return f"to run several values, list them under sweep, or write -o {key}=VALUE,VALUE"
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return "give one"
    if not isinstance(value, str):
        return "give a number" if math.isnan(value) else "choose one in that range"
    if is_number(value):
        return "remove the quotes"
    if re.fullmatch(r"[-+]?(inf|infinity)", value.strip(), re.IGNORECASE):
        return "infinity is written .inf"
    if ":" in value or ".." in value:
        return "write a range, in a sweep or after -o, as start:stop:count, such as 0.5:1.0:11"
    if is_number(value.replace(",", ".", 1)):
        return "write a decimal point"
    if is_number(value.replace("_", "")):
        return "remove the underscores"
    if re.match(r"[-+]?[0-9.]", value):
        unit = _unit(path)
        return f"write the number{f' in {unit}' if unit else ''} alone, without a unit"
    return "give one"


def _unit(path: KeyPath) -> str:
    """The unit in the description of the innermost key that has one; empty without one."""
    for key in reversed([part for part in path if isinstance(part, str)]):
        fields = (model.model_fields.get(key) for model in _MODELS.values())
        texts = (field.description or "" for field in fields if field)
        if units := [unit for text in texts for unit in re.findall(r", (m/s|kg|[msJ])\b", text)]:
            return str(units[0])
    return ""
