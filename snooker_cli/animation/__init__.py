"""Films of repeats: what they show, the page that plays them, and movie files."""

from snooker_cli.animation.film import Film, film, with_events
from snooker_cli.animation.html_player import embedded, page

__all__ = ["Film", "embedded", "film", "page", "with_events"]
