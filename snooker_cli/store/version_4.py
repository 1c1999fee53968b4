"""Files of schema version 4: how they differ from those that are written today."""

from collections.abc import Mapping
from typing import Any

from snooker_cli.laws import Constant

LAWS = {"pair_law": "restitution", "wall_law": "wall_restitution"}
"""The entries of the laws' CoR. A law of further numbers has an entry of its own name too."""


def rules(written: Mapping[str, Any]) -> dict[str, Any]:
    """The rules of collisions as files have them today."""
    laws = {name: {"name": Constant.name, "cor": written[cor]} for name, cor in LAWS.items()}
    return laws | {key: value for key, value in written.items() if key not in LAWS.values()}
