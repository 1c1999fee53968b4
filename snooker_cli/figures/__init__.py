"""Pictures -> matplotlib figures and files; the one home of matplotlib."""

from snooker_cli.figures.draw import draw
from snooker_cli.figures.save import save, to_json

__all__ = ["draw", "save", "to_json"]
