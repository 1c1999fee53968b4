"""Films of repeats: what they show, the page that plays them, and movie files."""

from snooker_cli.animation.film import Film, film
from snooker_cli.animation.html_player import embedded, page

__all__ = ["Film", "embedded", "film", "page"]
