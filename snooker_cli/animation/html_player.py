"""A film -> one HTML page with its data and the player; it needs no other file or network."""

from __future__ import annotations

import base64
import html
import json
import re
from importlib.resources import files
from typing import Any

import numpy as np

from snooker_cli.animation.film import Film
from snooker_cli.animation.frames import SPEED_COLOURS, Pace, view

SCRIPTS = ("motion.js", "charts.js", "arena.js", "player.js")


def embedded(page: str, label: str) -> str:
    """An ``iframe`` with a film's page, for the body of another page.

    The page inside may run its script and nothing else.

    label : a description for people who cannot see it
    """
    return (
        f'<iframe class="player" title="{html.escape(label)}" loading="lazy" '
        f'sandbox="allow-scripts" srcdoc="{html.escape(page)}"></iframe>'
    )


def page(
    film: Film,
    *,
    pace: Pace = "time",
    seconds: float | None = None,
    magnify: float = 1.0,
) -> str:
    """The page that plays a film; always the same bytes for the same film.

    pace : at the beginning
    seconds : length at speed 1; without it, the player chooses
    magnify : factor by which the container's motion is enlarged at first
    """
    parts = {
        "title": html.escape(film.title),
        "style": _part("player.css"),
        "film": _as_json(_content(film, pace, seconds, magnify)),
        "script": "\n".join(_part(name) for name in SCRIPTS),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _part("player.html"))


def _content(film: Film, pace: Pace, seconds: float | None, magnify: float) -> dict[str, Any]:
    """The player's data: arrays as base64."""
    scene, opening, seen = film.trace.start, film.opening, view(film, magnify)
    return {
        "title": film.title,
        "subtitle": film.subtitle,
        "ending": film.ending,
        "outline": scene.container.outline.tolist(),
        "periodic": not scene.container.has_wall,
        "size": scene.container.size,
        "free": scene.free,
        "start": film.start,
        "end": film.end,
        "before": film.before,
        "pace": pace,
        "seconds": seconds,
        "magnify": magnify,
        "magnifications": seen.magnifications,
        "follow": seen.follow,
        "farthest": seen.farthest,
        "view": seen.extent,
        "topSpeed": film.top_speed,
        "colours": SPEED_COLOURS,
        "container": [*opening.container_positions[0], *opening.container_velocities[0]],
        # Rows, ball by ball: position, velocity, radius.
        "balls": _packed(np.vstack([opening.positions[0].T, opening.velocities[0].T, scene.radii])),
        "time": _packed(film.time),
        "i": _packed(film.i, "<i4"),
        "j": _packed(film.j, "<i4"),
        "after": _packed(film.after),
        "contacts": _packed(film.contacts, "<f4"),
        "kineticEnergy": _packed(film.kinetic_energy),
        "pressureSum": _packed(film.pressure_sum),
        "pressureGain": _packed(film.pressure_gain) if film.pressure_gain.any() else "",
        "wallCor": scene.wall_restitution,
        "sliding": film.sliding,
        "settling": film.settling,
    }


def _packed(values: Any, kind: str = "<f8") -> str:
    """The bytes of an array, row after row, as base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def _as_json(content: dict[str, Any]) -> str:
    """JSON that cannot end the script element around it."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _part(name: str) -> str:
    return (files("snooker_cli.animation") / "player" / name).read_text(encoding="utf-8")
