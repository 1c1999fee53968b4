"""The page in which a gas runs, for notebooks and as a file."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from snooker_cli import options
from snooker_cli.api.arguments import with_options
from snooker_cli.api.configs import ConfigSource, Overrides, load
from snooker_cli.api.output_files import check_free
from snooker_cli.files import write_text
from snooker_cli.formatting import counted, point_label
from snooker_cli.pages.html_page import in_notebook

GAS = Path("gas.html")  # the name of a page that has none

_log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class LivePage:
    """A page that simulates a gas in the browser; a notebook shows it.

    html : the page
    """

    html: str

    def __repr__(self) -> str:
        return "<live page: save it, or show it in a notebook>"

    def _repr_html_(self) -> str:
        # Users save tables and pictures.
        rights = "allow-scripts allow-downloads"
        return in_notebook(self.html, "Live page of a gas", 62, rights)

    def save(self, out: str | PathLike[str] | None = None, *, replace: bool = True) -> Path:
        """Write the page, by default gas.html; its file.

        replace : also a file that is not a page of snooker; else such a file raises ``UserError``
        """
        path = GAS if out is None else Path(out)
        check_free(path, replace)
        write_text(path, self.html, given=out is not None)
        return path


@with_options(options.CONTROLS, options.BEGINNER, options.LANGUAGE)
def live(
    config: ConfigSource | None = None,
    overrides: Overrides = None,
    *,
    controls: Sequence[str] | None = None,
    beginner: bool = False,
    language: str = "en",
) -> LivePage:
    """The page of ``snooker live``, which simulates the first point of a config.

    config, overrides : as of ``run``; without a config the source report's scene

    Raises ``ConfigError``, also for what the page cannot show, such as more than 2,000 balls, and
    ``UserError`` for a name that no control or language has.
    """
    from snooker_cli.live_page import live_page, report_scene

    loaded = load(report_scene() if config is None else config, overrides)
    page = live_page(loaded, controls=controls, beginner=beginner, language=language)
    points = loaded.points()
    if len(points) > 1:
        number, first = counted(len(points), "point"), point_label(points[0].as_json())
        _log.info("the page shows the first of %s, %s; -o sets others", number, first)
    return LivePage(page)
