"""Notices and progress bars on stderr."""

import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any, Self, TypeVar

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, TextColumn

from snooker_cli.engine.compilation import COMPILATION, seconds_left
from snooker_cli.errors import notice
from snooker_cli.formatting import duration

Item = TypeVar("Item")

SOON = 0.2  # seconds after which a bar is drawn again, and speeds are known


class _Notices(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        notice(record.getMessage())


@contextmanager
def showing_notices() -> Iterator[None]:
    """Inside, the package's log records are printed on stderr."""
    logger, handler = logging.getLogger("snooker_cli"), _Notices()
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    showing = _Compiling()
    COMPILATION.watchers.append(showing)
    try:
        yield
    finally:
        COMPILATION.watchers.remove(showing)
        logger.removeHandler(handler)


_bars: list["Bar"] = []
"""The bars that are open, the inner ones last."""


class Bar(rich.progress.Progress):
    """A bar of a terminal or a notebook; inside, a compilation has a line of its own in it.

    shown : whether to show it there at all
    moves : whether stderr can show a bar
    """

    def __init__(self, shown: bool = True) -> None:
        console = Console(stderr=True)
        # Without ipywidgets, rich cannot move a bar in a notebook.
        moves = find_spec("ipywidgets") is not None if console.is_jupyter else sys.stderr.isatty()
        self.moves = moves
        super().__init__(
            BarColumn(),
            TextColumn("{task.description}", markup=False),
            console=console,
            disable=not (shown and moves),
            transient=True,
        )

    def __enter__(self) -> Self:
        _bars.append(self)
        return super().__enter__()

    def __exit__(self, *error: Any) -> None:
        _bars.remove(self)
        super().__exit__(*error)


class _Compiling:
    """Shows how many functions are compiled, in the bar that is open or in one of its own."""

    def __init__(self) -> None:
        self._bar: Bar | None = None
        self._began = 0.0
        self._own = False

    def __call__(self, done: int, total: int) -> bool:
        if self._bar is None:
            self._own, self._bar = not _bars, _bars[-1] if _bars else Bar()
            self._began = time.perf_counter()
            if self._own:
                self._bar.start()
            self._task = self._bar.add_task("compiling", total=total)
        bar = self._bar
        if done == total:
            bar.remove_task(self._task)
            if self._own:
                bar.stop()
            self._bar = None
            return not bar.disable
        text = compiling_text(done, total, time.perf_counter() - self._began)
        bar.update(self._task, completed=done, total=total, description=text)
        return not bar.disable


def compiling_text(done: int, total: int, seconds: float) -> str:
    """How far a compilation is after some seconds, with the time that is left."""
    text = f"compiling, first use on this machine: {done}/{total} functions"
    if done and seconds > SOON:
        text += f", {duration(seconds_left(done, total, seconds))} left"
    return text


def counting(repeats: Iterable[Item], label: str, total: int) -> Iterator[Item]:
    """The repeats in order; a terminal shows how many have been read."""
    with Bar() as bar:
        task = bar.add_task(label, total=total)
        for number, repeat in enumerate(repeats, 1):
            yield repeat
            text = f"{label} {number:,}/{total:,}".strip()
            bar.update(task, completed=number, description=text)


@contextmanager
def reporting() -> Iterator[Callable[[str], None]]:
    """Inside, a terminal shows the last text that the given function got."""
    with Bar() as bar:
        task = bar.add_task("", total=None)
        yield lambda text: bar.update(task, description=text)
