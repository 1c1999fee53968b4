"""A repeat -> a film: what is shown of it when, and the page that plays it."""

from snooker_cli.animation.film import MOST_BALLS, MOST_COLLISIONS, Film, film
from snooker_cli.animation.frames import (
    FLASH,
    MOST_FLASHES,
    SPEED_COLOURS,
    Frame,
    Reel,
    frames,
    reel,
    view,
)
from snooker_cli.animation.html_player import embedded, page

__all__ = [
    "FLASH",
    "MOST_BALLS",
    "MOST_COLLISIONS",
    "MOST_FLASHES",
    "SPEED_COLOURS",
    "Film",
    "Frame",
    "Reel",
    "embedded",
    "film",
    "frames",
    "page",
    "reel",
    "view",
]
