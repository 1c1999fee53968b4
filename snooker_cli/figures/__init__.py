"""Pictures -> matplotlib figures and files; the one home of matplotlib."""

from snooker_cli.figures.draw import draw
from snooker_cli.figures.save import save

__all__ = ["draw", "save"]
