"""Pictures -> matplotlib figures and files; the one home of matplotlib."""

from snooker_cli.figures.draw import draw
from snooker_cli.figures.movie import MovieError, save_movie
from snooker_cli.figures.save import save, to_json

__all__ = ["MovieError", "draw", "save", "save_movie", "to_json"]
