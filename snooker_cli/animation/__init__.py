"""Films of repeats: what they show, the page that plays them, and movie files."""

from snooker_cli.animation.film import (
    MOST_COLLISIONS,
    MOST_FILMS,
    Film,
    embedded,
    film,
    page,
    with_events,
)

__all__ = ["MOST_COLLISIONS", "MOST_FILMS", "Film", "embedded", "film", "page", "with_events"]
