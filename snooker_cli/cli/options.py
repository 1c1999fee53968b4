"""What the shell offers on Tab: runs, figures, templates and keys, loaded when asked."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable


# The commented configs that ``snooker init`` writes: which there are, and what each is for.


def templates() -> dict[str, Traversable]:
    """The templates by name, in the order in which to meet them."""
    names = ("report", "decay", "sweep", "exact", "dense")
    return {name: files("snooker_cli.cli") / "templates" / f"{name}.yaml" for name in names}


def purpose(template: Traversable) -> str:
    """What a template is for, its second line."""
    return template.read_text(encoding="utf-8").splitlines()[1].removeprefix("# ")


RUNS, MANIFEST = Path("runs"), "run.json"
"""As in ``results``, which takes a second to load: too long to wait for after a Tab."""

LINE = 72
"""Characters of an explanation: rich breaks longer ones, and fish takes a line for a candidate."""

Offer = tuple[str, str]
"""What can be typed, and what it means."""


def runs() -> list[str]:
    """Names of the runs in runs/."""
    return sorted(path.parent.name for path in RUNS.glob(f"*/{MANIFEST}"))


def figures(context: typer.Context) -> list[Offer]:
    """Figures that are not on the command line yet."""
    from snooker_cli.figures import FIGURES

    given = context.params.get("figures") or ()
    return [(name, _plain(kind.title)) for name, kind in FIGURES.items() if name not in given]


def complete_templates() -> list[Offer]:
    """Templates of ``init``."""

    return [(name, _plain(purpose(template))) for name, template in templates().items()]


def overrides() -> list[Offer]:
    """Keys for -o: those at the top, and those that can be swept."""
    from snooker_cli.config import schema

    top = schema()["properties"]
    keys = {**top, **top["sweep"]["properties"]}
    return [
        (f"{key}=", _plain(entry["description"]))
        for key, entry in keys.items()
        if key not in ("container", "balls", "sweep", "zip")
    ]


def _plain(text: str) -> str:
    """Text as Typer's scripts can show it: a line, no apostrophes for zsh, no markup for rich."""
    from textwrap import shorten

    from rich.markup import escape

    return escape(shorten(text.replace("'", "’"), LINE, placeholder="…"))
