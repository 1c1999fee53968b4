"""Films -> one HTML page with their data and the player; it needs no other file or network."""

import base64
import html
import json
import re
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli.animation.film import Film
from snooker_cli.animation.frames import SPEED_COLOURS, Pace, view

SCRIPTS = ("drawing.js", "motion.js", "arena.js", "charts.js", "player.js")

MOST_FILMS = 4  # on a page: more have too little room


def embedded(page: str, label: str) -> str:
    """An ``iframe`` with a film's page, which may only run its script; ``label`` describes it."""
    return (
        f'<iframe class="player" title="{html.escape(label)}" loading="lazy" '
        f'sandbox="allow-scripts" allow="fullscreen" srcdoc="{html.escape(page)}"></iframe>'
    )


def page(*films: Film, pace: Pace = "time", seconds: float | None = None) -> str:
    """The page that plays films side by side, in step; always the same bytes for the same films.

    films : from the same time on; one to ``MOST_FILMS``, which have different subtitles
    pace : at the beginning
    seconds : length at speed 1; without it, the player chooses
    """
    data = {"pace": pace, "seconds": seconds, "films": [_content(film) for film in films]}
    content = json.dumps(
        data, ensure_ascii=False, allow_nan=False, separators=(",", ":"), default=_packed
    )
    parts = {
        "title": html.escape(films[0].title),
        "style": _part("player.css"),
        "film": content.replace("<", "\\u003c"),  # it cannot end the script element around it
        "script": "\n".join(_part(name) for name in SCRIPTS),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _part("player.html"))


def _content(film: Film) -> dict[str, Any]:
    """The player's data: the film's own, the view's, and the scene's."""
    scene, opening = film.trace.start, film.opening
    own = {
        re.sub(r"_(\w)", lambda found: found[1].upper(), name): value
        for name, value in (vars(film) | vars(view(film))).items()
        if name not in ("trace", "opening", "container_path")
    }
    # Rows, ball by ball: position, velocity, radius.
    balls = np.vstack([opening.positions[0].T, opening.velocities[0].T, scene.radii])
    return own | {
        "contacts": film.contacts.astype(np.float32),
        "pressureGain": film.pressure_gain if film.pressure_gain.any() else "",
        "pressureTop": film.pressure_top,
        "startEnergy": scene.kinetic_energy,
        "balls": balls,
        "masses": scene.masses,
        "container": [*opening.container_positions[0], *opening.container_velocities[0]],
        "outline": scene.container.outline.tolist(),
        "periodic": not scene.container.has_wall,
        "size": scene.container.size,
        "free": scene.free,
        "wallCor": scene.wall_restitution,
        "colours": SPEED_COLOURS,
    }


def _packed(values: NDArray[Any]) -> str:
    """The bytes of an array, row after row and little-endian, as base64."""
    data = values.astype(values.dtype.newbyteorder("<")).tobytes()
    return base64.b64encode(data).decode("ascii")


def _part(name: str) -> str:
    return (files("snooker_cli.animation") / "player" / name).read_text(encoding="utf-8")
