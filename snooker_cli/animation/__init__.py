"""A repeat -> a film: what is shown of it when, and the page that plays it."""

from snooker_cli.animation.colours import SPEED_COLOURS
from snooker_cli.animation.embedding import embedded
from snooker_cli.animation.film import MOST_BALLS, MOST_COLLISIONS, Film, FilmError, film
from snooker_cli.animation.frames import FLASH, MOST_FLASHES, Frame, frames
from snooker_cli.animation.page import page
from snooker_cli.animation.reel import Reel, reel
from snooker_cli.animation.view import view

__all__ = [
    "FLASH",
    "MOST_BALLS",
    "MOST_COLLISIONS",
    "MOST_FLASHES",
    "SPEED_COLOURS",
    "Film",
    "FilmError",
    "Frame",
    "Reel",
    "embedded",
    "film",
    "frames",
    "page",
    "reel",
    "view",
]
