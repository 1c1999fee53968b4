"""The JSON schema of configs, made from their models.

``python tests/make_schema.py`` writes it beside the configs, where `snooker schema` reads it.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema

from snooker_cli.config.axes import WHOLE_RUN, ZIP
from snooker_cli.config.models import Config

FILE = Path(__file__).parents[1] / "configs" / "schema.json"


class _Generator(GenerateJsonSchema):
    """Pydantic's generator without invented titles, and with null for the infinite default."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def encode_default(self, dft: Any) -> Any:
        return None if dft == math.inf else super().encode_default(dft)


_SEVERAL = {
    "type": ["array", "string"],
    "minItems": 1,
    "pattern": r"^\s*(range\s*\(.*\)|[^:]+:[^:]+:[^:]+)\s*$",
}
"""A list of values, or the text of a range."""


def made_schema() -> dict[str, Any]:
    """The schema (draft 2020-12); `sweep` lists what can be swept."""
    document = Config.model_json_schema(schema_generator=_Generator)
    properties, definitions = document["properties"], document["$defs"]
    swept: dict[str, tuple[str, dict[str, Any]]] = {}
    for key, entry in properties.items():
        if key in WHOLE_RUN:
            continue
        variants = (entry, *entry.get("oneOf", ()), *entry.get("anyOf", ()))
        homes = [variant["$ref"] for variant in variants if "$ref" in variant]
        for home in homes:
            for inner, part in definitions[home.rpartition("/")[2]]["properties"].items():
                if "$ref" not in part.get("items", {}):
                    swept[f"{key}.{inner}"] = f"{home}/properties/{inner}", part
        words = any(variant.get("type") == "string" for variant in variants)
        if words or not homes:
            swept[key] = f"#/properties/{key}", entry
    group = {"$ref": "#/properties/sweep"}
    sweep = {
        "description": properties["sweep"]["description"],
        "type": "object",
        "properties": {
            **{
                key: {**_SEVERAL, "description": entry["description"], "items": {"$ref": place}}
                for key, (place, entry) in swept.items()
            },
            ZIP: {
                "description": "Keys that change together: lists of equal length, or several such "
                "groups as a list.",
                "anyOf": [group, {"type": "array", "items": group}],
            },
        },
        "patternProperties": {r"^balls(\.list)?\[[0-9]+\]\.": _SEVERAL},
        "additionalProperties": False,
    }
    return {
        "$schema": GenerateJsonSchema.schema_dialect,
        **document,
        "properties": {**properties, "sweep": sweep},
        "title": "snooker experiment",
        "required": ["cor"],
        "allOf": [
            {"anyOf": [{"required": ["collisions"]}, {"required": ["time"]}]},
            {"anyOf": [{"required": ["container", "balls"]}, {"required": ["start"]}]},
        ],
    }


def text() -> str:
    """The content of the file."""
    return json.dumps(made_schema(), indent=2) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
