"""The commented configs that ``snooker init`` writes: which there are, and what each is for."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable


def templates() -> dict[str, Traversable]:
    """The templates by name, in the order in which to meet them."""
    names = ("report", "decay", "sweep", "exact", "dense")
    return {name: files(__name__) / f"{name}.yaml" for name in names}


def purpose(template: Traversable) -> str:
    """What a template is for, its second line."""
    return template.read_text(encoding="utf-8").splitlines()[1].removeprefix("# ")
