"""The folder of a report: figures that a second process draws, players, and the pages."""

from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import AbstractContextManager
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

from snooker_cli.animation import embedded, film, page
from snooker_cli.config import Point
from snooker_cli.errors import FigureError
from snooker_cli.figures import FigureData
from snooker_cli.figures.drawing import save
from snooker_cli.formatting import point_label, printable
from snooker_cli.report.document import document, require_libraries, unbroken, write_html, write_pdf
from snooker_cli.runs import Run
from snooker_cli.runs.execution import follow_parent


class Pages(AbstractContextManager["Pages"]):
    """Collects a report's figures and players. Raises ``UserError`` without its libraries.

    figures : label, caption and alt text by file
    other : the process that draws; it ignores Ctrl-C and ends with this one
    """

    def __init__(self, out: Path) -> None:
        require_libraries()
        self.out, self.players = out, list[str]()
        self.figures: dict[str, dict[str, str]] = {}
        self.other = ProcessPoolExecutor(
            max_workers=1,
            mp_context=get_context("spawn"),
            initializer=follow_parent,
        )
        self._drawing: list[Future[list[Path]]] = []

    def __exit__(self, error: object, *_: object) -> None:
        for process in active_children() if error else ():
            process.kill()  # it may be at a figure that takes a minute
        self.other.shutdown()

    def add_figure(
        self, file: str, picture: FigureData, label: str = "", known: str = ""
    ) -> FigureData:
        """Let a figure be drawn: by default with the next number, and all of its caption."""
        label = label or f"Figure {len(self.figures) + 1}"
        caption = unbroken(" ".join(picture.caption.replace(known, "").split()))
        self.figures[file] = {"label": label, "caption": caption, "alt": picture.alt}
        self._drawing.append(self.other.submit(save, picture, self.out / "figures" / file))
        return picture

    def add_player(self, run: Run, point: Point) -> str:
        """Add a player of a point's first repeat; the reason if there can be none, else empty."""
        repeat = run.present(point)[0]
        where = f"{point_label({'cor': point.experiment.cor} | point.as_json())}, repeat {repeat}"
        title = printable(run.experiment.title or run.name)
        try:
            shown = page(film(run.read(point, repeat), title, where))
        except FigureError as error:
            return f"repeat {repeat} {error}"
        self.players.append(embedded(shown, f"Player, {printable(run.name)}, {where}"))
        return ""

    def write(self, template: str, values: dict[str, Any]) -> list[Path]:
        """Write ``report.html`` and ``report.pdf`` when all figures are drawn."""
        for each in self._drawing:
            each.result()
        content = document(template, values, self.figures)
        return [write_html(content, self.players, self.out), write_pdf(content, self.out)]
