"""``snooker plot``: draw the figures that a run can give."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snooker_cli.cli import completion
from snooker_cli.cli.analysing import RUN, not_extended
from snooker_cli.cli.running import AsJson
from snooker_cli.cli.tables import tell

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from snooker_cli.gallery import Kind, Selection
    from snooker_cli.results import Run


def plot(
    run: Annotated[str | None, RUN] = None,
    figures: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FIGURE]...",
            help="Names of figures [all that RUN can give].",
            autocompletion=completion.figures,
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

    from snooker_cli.cli.endings import UserError
    from snooker_cli.cli.progress import say

    if list_kinds:
        _show_kinds(as_json)
        return
    if run is None:
        raise UserError("give the RUN to plot, or --list for the names of the figures")
    kinds = _kinds(figures or ())

    from snooker_cli.figures import save
    from snooker_cli.gallery import PictureError, Selection, selected, unfinished
    from snooker_cli.results import open_run

    opened = open_run(run)
    folder = out or opened.figures_folder
    selection = Selection(_conditions(where or ()), repeat)
    drawn: list[dict[str, Any]] = []
    lacking: dict[tuple[str, str], int] = {}
    try:
        points = selected(opened, selection)
    except PictureError as error:
        raise UserError(f"{opened.name}: {error}") from None
    if what := unfinished(opened, selection):
        say(what)
    there = sum(len(opened.present(point)) for point in points)
    if what := not_extended(sum(map(opened.shorter, points)), there):
        say(what)
    for kind, one, stem in _jobs(opened, kinds, selection):
        try:
            picture = kind.make(opened, one)
        except PictureError as error:
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
    from snooker_cli.cli.tables import Column, print_table
    from snooker_cli.gallery import KINDS

    if as_json:
        import json

        names = ("name", "title", "needs", "report_figures")
        records = [{name: getattr(kind, name) for name in names} for kind in KINDS.values()]
        tell(json.dumps(records))
        return
    print_table(
        [Column("figure"), Column("report's"), Column("shows"), Column("needs")],
        [
            [kind.name, ", ".join(map(str, kind.report_figures)) or "–", kind.title, kind.needs]
            for kind in KINDS.values()
        ],
    )


def _kinds(names: Sequence[str]) -> list[Kind]:
    """The kinds of figures with these names, all of them for none. Raises ``UserError``."""
    import difflib

    from snooker_cli.cli.endings import UserError
    from snooker_cli.gallery import KINDS

    for name in names:
        if name not in KINDS:
            near = difflib.get_close_matches(name, KINDS, n=1, cutoff=0.0)[0]
            raise UserError(
                f"there is no figure {name}; the nearest is {near}, and `snooker plot --list` "
                "shows all"
            )
    return [KINDS[name] for name in dict.fromkeys(names)] or list(KINDS.values())


def _conditions(texts: Sequence[str]) -> dict[str, Any]:
    """What ``--where`` asks for: a value of each key, or a tuple of several."""
    from snooker_cli.cli.endings import UserError

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
    run: Run, kinds: Sequence[Kind], selection: Selection
) -> Iterator[tuple[Kind, Selection, str]]:
    """Every picture to make: its kind, what it shows, and the name of its files."""
    from snooker_cli.gallery import Selection, selected

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
