"""Films of repeats: what they show, the page that plays them, and movie files."""

from snooker_cli.animation.film import MOST_COLLISIONS, Film, film, with_events
from snooker_cli.animation.html_player import embedded, page

__all__ = ["MOST_COLLISIONS", "Film", "embedded", "film", "page", "with_events"]
