"""Films -> one HTML page, which simulates them again, or a movie file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from snooker_cli.animation.film import Film, Pace
from snooker_cli.engine.page_kernels import boundary_name
from snooker_cli.errors import UserError
from snooker_cli.files import write_text
from snooker_cli.formatting import counted
from snooker_cli.live_page.page import (
    LIVE,
    engine_source,
    measuring_source,
    packed_modules,
    stored_start,
)
from snooker_cli.options import OUT
from snooker_cli.pages.html_page import (
    PAGES,
    SHARED,
    SPEED_COLOURS,
    html_page,
    script_data,
    script_of,
)
from snooker_cli.trace import event_hashes

SCRIPTS = ("gas.js", "charts.js", "film.js")
MOST_FILMS = 4  # on a page: more have too little room


def page(*films: Film, pace: Pace = "time", seconds: float | None = None) -> str:
    """The page that plays films side by side, in step; always the same bytes for the same films.

    It has the start of each repeat, and the hash of what is stored: it simulates them again.

    films : from the same time on; one to ``MOST_FILMS``, which have different subtitles
    pace : at the beginning
    seconds : length at speed 1; without it, the page chooses
    """
    boundaries = {boundary_name(film.trace.start) for film in films}
    laws = [law for film in films for law in film.trace.start.rules.laws]
    data = {
        "pace": pace,
        "seconds": seconds,
        "films": [_content(film) for film in films],
        "colours": SPEED_COLOURS,
    }
    parts = {
        "data": script_data(data),
        "modules": script_data(packed_modules(boundaries, laws)),
        "script": engine_source(laws=laws)
        + measuring_source()
        + script_of(PAGES, *SHARED)
        + script_of(LIVE, *SCRIPTS),
    }
    return html_page(LIVE, "film", films[0].title, parts, simulates=True)


def _content(film: Film) -> dict[str, Any]:
    """What the page has of a film. Places are relative to the centre of a fixed container."""
    trace, scene = film.trace, film.trace.start
    assert trace.events is not None
    shown = trace.events[: film.before + len(film)]
    left, right, bottom, top = film.extent
    x, y = (0.0, 0.0) if scene.free else scene.container_position.tolist()
    return {
        "scene": stored_start(scene),
        "title": film.title,
        "subtitle": film.subtitle,
        "ending": film.ending,
        "start": film.start,
        "end": film.end,
        "before": film.before,
        "collisions": len(shown),
        "hash": event_hashes([shown])[-1][1],
        "extent": [left - x, right - x, bottom - y, top - y],
        "follow": film.follow,
        "topSpeed": film.top_speed,
        "decimals": film.decimals,
    }


def check_film_file(path: Path, number: int) -> None:
    """Raise ``UserError`` unless films of a number of repeats can be saved under a name."""
    ending = path.suffix.lower()
    if ending not in (".html", ".gif", ".mp4"):
        raise UserError(f"{OUT.of(path)}: give a name that ends in .html, .gif or .mp4")
    most = MOST_FILMS if ending == ".html" else 1
    if number > most:
        few = f"shows at most {counted(most, 'repeat')}, not {number}"
        raise UserError(f"{path}: {few}", "give fewer points or repeats")


def save_films(
    path: Path,
    films: Sequence[Film],
    *,
    pace: Pace,
    seconds: float | None,
    rate: int,
    given: bool = True,
) -> None:
    """Write films as a page, or one film as a GIF or MP4, by the ending of the path.

    given : whether a user gave the path, as of `atomic_write`
    seconds : length [12; of a page its own choice]
    rate : frames per second of a GIF or MP4

    Raises ``UserError`` as ``check_film_file`` and ``save_movie`` do.
    """
    check_film_file(path, len(films))
    if path.suffix.lower() == ".html":
        write_text(path, page(*films, pace=pace, seconds=seconds), given)
        return
    from snooker_cli.animation.movie import save_movie  # loads matplotlib

    save_movie(films[0], path, pace=pace, seconds=seconds or 12.0, rate=rate)
