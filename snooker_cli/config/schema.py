"""The JSON schema of a configuration file, for editors and other programs."""

import math
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from snooker_cli.config.axes import WHOLE_RUN, ZIP
from snooker_cli.config.models import Experiment

_SEVERAL = {
    "type": ["array", "string"],
    "minItems": 1,
    "pattern": r"^\s*(range\s*\(.*\)|[^:]+:[^:]+:[^:]+)\s*$",
}
"""A list of values, or the text of a range."""


class _Generator(GenerateJsonSchema):
    """Pydantic's generator without invented titles, and with null for the infinite default."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def encode_default(self, dft: Any) -> Any:
        return None if dft == math.inf else super().encode_default(dft)


def schema() -> dict[str, Any]:
    """A JSON schema (draft 2020-12) made from the models; `sweep` lists what can be swept."""
    document = Experiment.model_json_schema(schema_generator=_Generator)
    properties, definitions = document["properties"], document["$defs"]
    swept: dict[str, Any] = {}
    for key, entry in properties.items():
        homes = _models(entry)
        for inner, inner_entry in (
            pair for home in homes for pair in definitions[home]["properties"].items()
        ):
            if not _models(inner_entry.get("items", {})):
                swept[f"{key}.{inner}"] = _axis(inner_entry)
        words = [each for each in entry.get("oneOf", ()) if each.get("type") == "string"]
        if words:
            swept[key] = _axis({**words[0], "description": entry["description"]})
        elif not homes and key not in WHOLE_RUN:
            swept[key] = _axis(entry)
    patterns = {rf"^{key}\[[0-9]+\]\.": _SEVERAL for key in ("balls", r"balls\.list")}
    group = {
        "type": "object",
        "properties": {
            key: {**_SEVERAL, "items": {"$ref": f"#/properties/sweep/properties/{key}/items"}}
            for key in swept
        },
        "patternProperties": patterns,
        "additionalProperties": False,
    }
    zipped = {
        "description": "Keys that walk together: lists of as many values each, or several such "
        "groups as a list.",
        "anyOf": [group, {"type": "array", "items": group}],
    }
    properties["sweep"] = {
        "type": "object",
        "description": properties["sweep"]["description"],
        "properties": {**swept, ZIP: zipped},
        "patternProperties": patterns,
        "additionalProperties": False,
    }
    return {
        "$schema": GenerateJsonSchema.schema_dialect,
        **document,
        "title": "snooker experiment",
        "anyOf": [{"required": ["collisions"]}, {"required": ["time"]}],
    }


def _models(entry: dict[str, Any]) -> list[str]:
    """The models that a schema refers to, itself or as alternatives."""
    alternatives = (entry, *entry.get("oneOf", ()))
    return [each["$ref"].rsplit("/", 1)[1] for each in alternatives if "$ref" in each]


def _axis(entry: dict[str, Any]) -> dict[str, Any]:
    """The schema of a list of values of one key."""
    value = {name: part for name, part in entry.items() if name not in ("default", "description")}
    return {
        **_SEVERAL,
        "description": entry["description"],
        "items": value,
        "uniqueItems": True,
    }
