"""Films of repeats: what they show, the page that simulates them again, and movie files."""

from snooker_cli.animation.film import MOST_COLLISIONS, Film, film, with_events
from snooker_cli.animation.film_files import MOST_FILMS, check_film_file, page, save_films

__all__ = ["MOST_COLLISIONS", "MOST_FILMS", "Film", "check_film_file", "film"]
__all__ += ["page", "save_films", "with_events"]
