"""What functions return that commands print: content for programs, which is also a text."""

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snooker_cli import options
from snooker_cli.errors import ArgumentError
from snooker_cli.formatting import listed

MOST_LINES = 201  # of a table of points, with its headings
WIDTH = 100  # characters of a line of text that is wrapped


class CommandResult(dict[str, Any]):
    """A result as ``--json`` prints it; ``print`` shows the text of the command.

    lines : of this text
    """

    def __init__(self, content: dict[str, Any], lines: Iterable[str]) -> None:
        super().__init__(content)
        self.lines = list(lines)

    def __str__(self) -> str:
        return "\n".join(self.lines)


class Plan(CommandResult):
    """What a run would do, as ``run --dry-run --json`` prints it; ``print`` shows it as a text.

    change : how the run would extend or reduce what is stored, as a sentence; empty if it does not
    """

    change: str


class Outcome(CommandResult):
    """What a run did, as ``run --json`` prints it; ``print`` shows it as a text.

    done : ``3 of 6 repeats done``
    errors : of repeats that failed
    interrupted : whether Ctrl-C ended it
    """

    done: str
    errors: list[str]
    interrupted: bool


class Verdicts(CommandResult):
    """What a check of repeats found, as ``verify --json`` prints it.

    sound : whether nothing is wrong
    interrupted : whether Ctrl-C ended it
    """

    sound: bool
    interrupted: bool = False


class CommandResults(list[dict[str, Any]]):
    """A list of results as ``--json`` prints it; ``print`` shows the text of the command.

    lines : of this text
    """

    def __init__(self, content: Iterable[dict[str, Any]], lines: Iterable[str]) -> None:
        super().__init__(content)
        self.lines = list(lines)

    def __str__(self) -> str:
        return "\n".join(self.lines)


class Records(list[dict[str, Any]]):
    """Rows of ``fit`` or ``compare``, each a record; ``print`` shows the tables of the command.

    ``pandas.DataFrame(records)`` is a table of all.

    notes : what a reader should know of the rows: records with ``parameters`` and ``note``
    unfinished : how many repeats an unfinished run has, as a sentence; else empty
    warning : if most repeats ended early, a sentence with what helps; else empty
    states : of ``compare``, what findings need of each point besides its rows
    """

    def __init__(
        self,
        rows: Iterable[dict[str, Any]],
        notes: list[dict[str, Any]],
        *,
        points: int,
        footer: Sequence[str] = (),
        unfinished: str = "",
        warning: str = "",
        states: Sequence[dict[str, Any]] = (),
    ) -> None:
        super().__init__(rows)
        self.states = list(states)
        self.notes, self.unfinished, self.warning = notes, unfinished, warning
        self._points, self._footer = points, footer

    def only(self, quantity: Sequence[str], model: Sequence[str]) -> "Records":
        """The rows with one of these parts in the name of their quantity, and of their model.

        Without parts, any name will do. Raises ``ArgumentError`` for a part that no name has.
        """
        from snooker_cli.analysis.tables import rows_with, short_name

        rows, notes = list(self), self.notes
        wanted = ("quantity", options.QUANTITY, quantity), ("model", options.MODEL, model)
        for field, option, parts in wanted:
            names = dict.fromkeys(f"'{short_name(row[field])}'" for row in rows)  # some have commas
            for part in parts or [""]:
                if names and not rows_with(rows, field, [part]):
                    problem = f"{option.of(part)}: no {field} contains this"
                    raise ArgumentError(f"{problem}; there are {listed([*names])}")
            rows = rows_with(rows, field, parts or [""])
            notes = rows_with(notes, field, parts or [""])
        return Records(
            rows,
            notes,
            points=self._points,
            unfinished=self.unfinished,
            warning=self.warning,
            states=self.states,
        )

    def lines(self, *, every: bool = False, brief: bool = False) -> list[str]:
        """The lines of the text above the remarks; the arguments are those of ``text``."""
        from snooker_cli.analysis.tables import table_lines

        return table_lines(self._rows(every), every, brief, self.states)

    def remarks(self, *, every: bool = False) -> list[str]:
        """The paragraphs below the tables: what the columns are, and the notes."""
        from snooker_cli.analysis.tables import main_rows, note_lines

        notes = note_lines(self.notes if every else main_rows(self.notes), self._points)
        has_table = any(not row.get("elastic") for row in self._rows(every))
        footer = self._footer if has_table else ()
        return [*footer, *notes]

    def _rows(self, every: bool) -> list[dict[str, Any]]:
        """The rows for most readers; all of them if there are no others."""
        from snooker_cli.analysis.tables import main_rows

        return self if every else main_rows(self) or self

    def text(self, *, every: bool = False, brief: bool = False) -> str:
        """What the command prints.

        every : also columns and rows for few readers, as with ``--all``
        brief : only what holds for each point, without tables
        """
        below = [] if brief else self.remarks(every=every)
        wrapped = (textwrap.fill(line, WIDTH, subsequent_indent="  ") for line in below)
        return "\n".join([*self.lines(every=every, brief=brief), *wrapped])

    def __str__(self) -> str:
        return self.text()


@dataclass(frozen=True)
class SavedFigure:
    """A figure that was drawn.

    files : an image for each format, and the JSON with its numbers
    table : lines of a table with the result of each of several points
    """

    name: str
    files: tuple[Path, ...]
    caption: str
    table: tuple[str, ...]


def first(
    lines: Sequence[str],
    most: int = MOST_LINES,
    noun: str = " points",
    rest: object = options.JSON_HAS_ALL,
) -> list[str]:
    """The first lines, and how many more there are; by default of a table of points.

    rest : what prints all
    """
    more = len(lines) - most
    return [*lines[:most], *([f"... and {more:,} more{noun}{rest}"] if more > 0 else [])]
