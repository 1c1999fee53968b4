"""A picture -> SVG, PNG and the JSON of the numbers it shows, the same bytes every time."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import TYPE_CHECKING

from snooker_cli.figures.draw import draw
from snooker_cli.figures.style import styled
from snooker_cli.gallery import plain

if TYPE_CHECKING:
    from pathlib import Path

    from snooker_cli.gallery import Picture


def save(picture: Picture, stem: Path) -> list[Path]:
    """Write ``stem.svg``, ``stem.png`` and ``stem.json``; the folder is made if need be.

    Title and caption are also in the metadata of the images.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    # Not with_suffix: a stem may have a point, as in `energy-fit-cor-0.8`.
    paths = [stem.with_name(f"{stem.name}.{ending}") for ending in ("svg", "png", "json")]
    svg, png, data = paths
    said = {"Title": picture.title, "Description": picture.caption}
    with styled():
        figure = draw(picture)
        figure.savefig(svg, metadata={**said, "Date": None, "Creator": "snooker"})
        figure.savefig(png, metadata={**said, "Software": None})
    data.write_text(to_json(picture), encoding="utf-8")
    return paths


def to_json(picture: Picture) -> str:
    """The picture as JSON: its words, its numbers, and the data of each layer.

    Numbers have the shortest decimals that mean the same doubles; what is not finite is null.
    """
    content = {each.name: plain(getattr(picture, each.name)) for each in fields(picture)}
    content["layers"] = [
        {"type": type(layer).__name__.lower()}
        | {each.name: plain(getattr(layer, each.name)) for each in fields(layer)}
        for layer in picture.layers
    ]
    return json.dumps(content, ensure_ascii=False, allow_nan=False, indent=1) + "\n"
