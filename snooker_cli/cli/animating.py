"""``snooker animate``: a repeat as a film, for a browser or as a picture that moves."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snooker_cli.cli.analysing import RunName
from snooker_cli.cli.inspecting import PointNumber, RepeatNumber
from snooker_cli.cli.running import AsJson

if TYPE_CHECKING:
    from snooker_cli.animation import Film
    from snooker_cli.results import Run
    from snooker_cli.trace import Trace

ENDINGS = (".html", ".gif", ".mp4")
SECONDS = 12.0
FRAMES_A_SECOND = 20
MOST_MAGNIFIED = 1e12


class Passing(StrEnum):
    """How time can pass in a film."""

    TIME = "time"
    EVENTS = "events"


def animate(
    run: RunName,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="FILE", help="The film: a name in .html, .gif or .mp4."),
    ],
    point: PointNumber = 0,
    repeat: RepeatNumber = 0,
    since: Annotated[
        float | None, typer.Option("--from", metavar="T", help="Time to begin at, s [0].")
    ] = None,
    until: Annotated[
        float | None, typer.Option("--to", metavar="T", help="Time to end at, s [the end].")
    ] = None,
    collisions: Annotated[
        int | None,
        typer.Option("--collisions", min=1, help="At most so many collisions [10,000]."),
    ] = None,
    pace: Annotated[
        Passing,
        typer.Option("--pace", help="Constant time, or each collision as long as any other."),
    ] = Passing.TIME,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds", help="How long it plays [12; a page: what is comfortable to watch]."
        ),
    ] = None,
    fps: Annotated[
        int | None, typer.Option("--fps", min=1, max=60, help="GIF, MP4: frames a second [20].")
    ] = None,
    magnify: Annotated[
        float, typer.Option("--magnify", help="Enlarge the container's motion so many times.")
    ] = 1.0,
    as_json: AsJson = False,
) -> None:
    """Show a repeat of RUN as a film: balls coloured by speed, contacts, energy and pressure.

    A .html is one page for any browser, without a network: it plays, pauses, goes to any time and
    from collision to collision. The balls are exactly where the stored collisions put them. The
    written file is printed.
    """
    from snooker_cli.animation import FilmError, film
    from snooker_cli.cli.endings import UserError
    from snooker_cli.cli.inspecting import trace_of
    from snooker_cli.cli.progress import say
    from snooker_cli.results import open_run

    _check(out, seconds, fps, magnify)
    opened = open_run(run)
    trace = trace_of(opened, point, repeat)
    if magnify > 1 and not trace.start.free:
        raise UserError(f"--magnify {magnify:g}: the container of {opened.name} does not move")
    try:
        made = film(
            trace,
            opened.experiment.title or opened.name,
            _subtitle(opened, trace, point, repeat),
            since=since or 0.0,
            until=until,
            most=collisions,
        )
    except FilmError as error:
        raise UserError(f"repeat {repeat} of {opened.name} {error}") from None
    if made.left_out and collisions is None:
        say(
            f"the film ends after {len(made):,} collisions, at {made.end:.6g} s; --from, --to and "
            "--collisions choose others"
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    frames = _write(made, out, pace, seconds, fps, magnify)
    if not as_json:
        typer.echo(out)
        return
    import json

    found = {
        "file": str(out),
        "bytes": out.stat().st_size,
        "point": point,
        "repeat": repeat,
        "from": made.start,
        "to": made.end,
        "collisions": len(made),
        "frames": frames,
    }
    typer.echo(json.dumps(found, allow_nan=False))


def _check(out: Path, seconds: float | None, fps: int | None, magnify: float) -> None:
    """Raise ``UserError`` for what the parser could not see."""
    from snooker_cli.cli.endings import UserError

    if out.suffix.lower() not in ENDINGS:
        raise UserError(f"--out {out}: give a name that ends in .html, .gif or .mp4")
    if fps is not None and out.suffix.lower() == ".html":
        raise UserError("--fps goes with a GIF or an MP4: a page is drawn as often as it can be")
    if seconds is not None and not 0.1 <= seconds <= 3600:
        raise UserError(f"--seconds {seconds}: give a number from 0.1 to 3600")
    if not 1 <= magnify <= MOST_MAGNIFIED:
        raise UserError(f"--magnify {magnify}: give a number from 1 to {MOST_MAGNIFIED:g}")


def _subtitle(run: Run, trace: Trace, point: int, repeat: int) -> str:
    """The setting and the repeat that a film shows."""
    from snooker_cli.words import counted

    setting = [f"{key}={value}" for key, value in run.points[point].parameters]
    if not any(part.startswith("cor=") for part in setting):
        setting.append(f"cor={trace.start.restitution:g}")
    balls = counted(trace.start.number, "ball")
    return ", ".join([*setting, balls, f"repeat {repeat}"])


def _write(
    film: Film, out: Path, pace: Passing, seconds: float | None, fps: int | None, magnify: float
) -> int | None:
    """Write the film; the number of its frames, which a page does not have."""
    from snooker_cli.animation import page, reel

    if out.suffix.lower() == ".html":
        text = page(film, pace=pace.value, seconds=seconds, magnify=magnify)
        out.write_text(text, encoding="utf-8")
        return None
    from snooker_cli.cli.endings import UserError
    from snooker_cli.figures import MovieError, save_movie

    try:
        return save_movie(
            film,
            reel(film, pace.value),
            out,
            seconds=seconds or SECONDS,
            rate=fps or FRAMES_A_SECOND,
            magnify=magnify,
        )
    except MovieError as error:
        raise UserError(str(error)) from None
