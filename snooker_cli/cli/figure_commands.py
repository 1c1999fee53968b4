"""``snooker animate``: a repeat as a film, for a browser or as a picture that moves."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli import options
from snooker_cli.cli.analysis_commands import RUN, RunName
from snooker_cli.cli.config_commands import PointNumber, RepeatNumber
from snooker_cli.cli.output import tell
from snooker_cli.cli.run_command import AsJson

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from snooker_cli.animation import Film
    from snooker_cli.figures import FigureSpec, Selection
    from snooker_cli.runs import Run
    from snooker_cli.trace import Trace


# ``snooker plot``: draw the figures that a run can give.


def plot(
    run: Annotated[str | None, RUN] = None,
    figures: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FIGURE]...",
            help="Names of figures [all that RUN can give].",
            autocompletion=options.figures,
        ),
    ] = None,
    list_kinds: Annotated[
        bool, typer.Option("--list", help="List the figures and what each needs.")
    ] = False,
    where: Annotated[
        list[str] | None,
        typer.Option(
            "--where",
            metavar="KEY=VALUE",
            help="Only points with this value, as `cor=0.8` or `cor=0.8,0.9`. May be given "
            "several times.",
        ),
    ] = None,
    repeat: Annotated[
        int | None,
        typer.Option(
            "--repeat", metavar="K", min=0, help="This repeat alone, from 0 [first or all]."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder [RUN/figures]."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Draw figures of RUN as SVG and PNG, with the numbers they show as JSON beside them.

    Without names, all figures that RUN can give; the others are said with what they lack. Figures
    of single points are drawn for each. The written files are printed.
    """
    import json

    from snooker_cli.cli.progress_bar import say
    from snooker_cli.errors import UserError

    if list_kinds:
        _show_kinds(as_json)
        return
    if run is None:
        raise UserError("give the RUN to plot, or --list for the names of the figures")
    kinds = _kinds(figures or ())

    from snooker_cli.analysis.run_analysis import shorter_note
    from snooker_cli.errors import FigureError
    from snooker_cli.figures import Selection, selected, unfinished
    from snooker_cli.figures.drawing import save
    from snooker_cli.runs import open_run

    opened = open_run(run)
    folder = out or opened.figures_folder
    selection = Selection(_conditions(where or ()), repeat)
    drawn: list[dict[str, Any]] = []
    lacking: dict[tuple[str, str], int] = {}
    try:
        points = selected(opened, selection)
    except FigureError as error:
        raise UserError(f"{opened.name}: {error}") from None
    if what := unfinished(opened, selection):
        say(what)
    there = sum(len(opened.present(point)) for point in points)
    if what := shorter_note(sum(map(opened.shorter, points)), there):
        say(what)
    for kind, one, stem in _jobs(opened, kinds, selection):
        try:
            picture = kind.make(opened, one)
        except FigureError as error:
            because = kind.name, str(error)
            lacking[because] = lacking.get(because, 0) + 1
            continue
        try:
            paths = [str(path) for path in save(picture, folder / stem)]
        except OSError as error:
            raise UserError(
                f"{folder}: cannot be written ({error.strerror or error}); give --out for another "
                "folder"
            ) from None
        shown = {name: getattr(picture, name) for name in ("kind", "title", "caption", "numbers")}
        drawn.append({**shown, "files": paths})
        if not as_json:
            tell("\n".join(paths))
    given = {each["kind"] for each in drawn}
    for (name, why), number in lacking.items():
        where_not = f" at {number} of {len(opened.points)} points" if name in given else ""
        say(f"{name} left out{where_not}: {why}")
    if as_json:
        skipped = [{"kind": name, "why": why, "times": n} for (name, why), n in lacking.items()]
        tell(json.dumps({"figures": drawn, "skipped": skipped}, allow_nan=False))
    refused = [kind.name for kind in kinds if kind.name not in given]
    if refused and (figures or not drawn):
        raise UserError(f"{opened.name} cannot give {', '.join(refused)}; what it lacks is above")


def _show_kinds(as_json: bool) -> None:
    """Print the registry of figures."""
    from snooker_cli.cli.output import print_table
    from snooker_cli.figures import FIGURES
    from snooker_cli.formatting import Column

    if as_json:
        import json

        names = ("name", "title", "needs", "report_figures")
        records = [{name: getattr(kind, name) for name in names} for kind in FIGURES.values()]
        tell(json.dumps(records))
        return
    print_table(
        [Column("figure"), Column("report's"), Column("shows"), Column("needs")],
        [
            [kind.name, ", ".join(map(str, kind.report_figures)) or "–", kind.title, kind.needs]
            for kind in FIGURES.values()
        ],
    )


def _kinds(names: Sequence[str]) -> list[FigureSpec]:
    """The kinds of figures with these names, all of them for none. Raises ``UserError``."""
    import difflib

    from snooker_cli.errors import UserError
    from snooker_cli.figures import FIGURES

    for name in names:
        if name not in FIGURES:
            near = difflib.get_close_matches(name, FIGURES, n=1, cutoff=0.0)[0]
            raise UserError(
                f"there is no figure {name}; the nearest is {near}, and `snooker plot --list` "
                "shows all"
            )
    return [FIGURES[name] for name in dict.fromkeys(names)] or list(FIGURES.values())


def _conditions(texts: Sequence[str]) -> dict[str, Any]:
    """What ``--where`` asks for: a value of each key, or a tuple of several."""
    from snooker_cli.errors import UserError

    found: dict[str, Any] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator or not key or not value:
            raise UserError(f"--where {text}: give KEY=VALUE, as in cor=0.8")
        values = tuple(_value(each.strip()) for each in value.split(","))
        found[key.strip()] = values if len(values) > 1 else values[0]
    return found


def _value(text: str) -> Any:
    """A value as a config writes it: a number, null, or text."""
    import json

    try:
        return float("inf") if text == ".inf" else json.loads(text)
    except ValueError:
        return text


def _jobs(
    run: Run, kinds: Sequence[FigureSpec], selection: Selection
) -> Iterator[tuple[FigureSpec, Selection, str]]:
    """Every picture to make: its kind, what it shows, and the name of its files."""
    from snooker_cli.figures import Selection, selected

    asked = _stem(selection.where.items(), selection.repeat)
    for kind in kinds:
        if not kind.each_point:
            yield kind, selection, kind.name + asked
            continue
        for point in selected(run, selection):
            one = Selection(dict(point.parameters), selection.repeat)
            yield kind, one, kind.name + _stem(point.parameters, selection.repeat)


def _stem(conditions: Iterable[tuple[str, Any]], repeat: int | None) -> str:
    """The part of a file's name that tells what is selected."""
    import re

    parts = []
    for key, value in conditions:
        values = value if isinstance(value, tuple) else (value,)
        parts += [key, *("null" if each is None else str(each) for each in values)]
    if repeat is not None:
        parts += ["repeat", str(repeat)]
    return "".join("-" + re.sub(r"[^A-Za-z0-9._-]", "_", part) for part in parts)


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
    from snooker_cli.animation import film
    from snooker_cli.cli.config_commands import trace_of
    from snooker_cli.cli.progress_bar import say
    from snooker_cli.errors import FigureError, UserError
    from snooker_cli.runs import open_run

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
    except FigureError as error:
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
    from snooker_cli.errors import UserError

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
    from snooker_cli.formatting import counted

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
    from snooker_cli.animation.movie import save_movie

    return save_movie(
        film,
        reel(film, pace.value),
        out,
        seconds=seconds or SECONDS,
        rate=fps or FRAMES_A_SECOND,
        magnify=magnify,
    )
