"""Films of repeats: what they show, the page that plays them, and movie files."""

from snooker_cli.animation.film import (
    MOST_COLLISIONS,
    MOST_FILMS,
    Film,
    check_film_file,
    film,
    page,
    save_films,
    with_events,
)

__all__ = ["MOST_COLLISIONS", "MOST_FILMS", "Film", "check_film_file", "film"]
__all__ += ["page", "save_films", "with_events"]
