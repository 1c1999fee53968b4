"""The style, the size and the title that all figures have."""

import re
import textwrap
from contextlib import AbstractContextManager
from importlib.resources import files
from io import BytesIO

from snooker_cli.files import out_of_sight

with out_of_sight("matplotlibrc"):
    import matplotlib
    import matplotlib.style
    from matplotlib.figure import Figure

WIDTH = 3.4  # width of a figure, inches: a column of a two-column page
LINE_HEIGHT = 0.14  # height of a further line of text, inches
TITLE_WIDTH = 40  # characters of the bold title that fit in this width

# Spaces inside a number with its error or unit.
_UNBROKEN = re.compile(r" (?=[±%×])|(?<=[±×]) |(?<=\d) (?=[A-Za-z/⁻¹²]{1,4}\b)")


def styled() -> AbstractContextManager[None]:
    """While inside, matplotlib has our style and nothing of the user's own settings."""
    style = files("snooker_cli.figures") / "snooker.mplstyle"
    return matplotlib.style.context(["default", str(style)])


class SnookerFigure(Figure):
    """A figure that a notebook shows, without pyplot."""

    def _repr_png_(self) -> bytes:
        scratch = BytesIO()
        with styled():
            self.savefig(scratch, format="png")
        return scratch.getvalue()


def title_lines(title: str, width: float) -> list[str]:
    """The lines of a title for a figure of a width, inches."""
    most = int(TITLE_WIDTH * width / WIDTH)
    parts = title.replace(": ", ":\n").split("\n") if len(title) > most else [title]
    lines = [line for part in parts for line in textwrap.wrap(_UNBROKEN.sub("\xa0", part), most)]
    return [line.replace("\xa0", " ") for line in lines]
