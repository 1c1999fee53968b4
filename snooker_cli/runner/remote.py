"""What a worker on another machine does: repeats as they are ordered, into the run's folder."""

from __future__ import annotations

import platform
import threading
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

from snooker_cli import __version__
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.results import Run, RunError, State, open_run
from snooker_cli.runner.compiling import compile_for
from snooker_cli.runner.kinds import arranged
from snooker_cli.runner.ledger import Job, entry
from snooker_cli.runner.repeat import LeftError, Outcome, do, unforeseen
from snooker_cli.scene import SceneError
from snooker_cli.store import SCHEMA_VERSION


class Software(NamedTuple):
    """What must be the same wherever repeats of one run are made."""

    snooker: str
    engine: int
    schema: int

    def __str__(self) -> str:
        return (
            f"snooker {self.snooker} with engine version {self.engine} and files of schema "
            f"{self.schema}"
        )


@dataclass(frozen=True)
class Order:
    """A repeat to do. What it is the worker reads in the folder's manifest.

    under_way : names the `snooker run` that orders it
    directory : the run's folder, the same on all machines
    identity, engine : of the run, to tell it from another one
    command : what the file is to say that it was made by
    """

    under_way: str
    software: Software
    directory: Path
    identity: str
    engine: str | None
    command: str
    point: int
    repeat: int


_lock = threading.Lock()
_stopped: set[str] = set()
"""Runs that were interrupted."""

_saving: set[Order] = set()
"""Orders under way that have something to save."""


def software() -> Software:
    """What this process has."""
    return Software(__version__, ENGINE_VERSION, SCHEMA_VERSION)


def stop(under_way: str) -> list[Order]:
    """Stop an interrupted run's repeats in this process; those that are now being saved."""
    with _lock:
        _stopped.add(under_way)
        return [order for order in _saving if order.under_way == under_way]


def fulfil(order: Order) -> Outcome | None:
    """Do a repeat; None if its run was interrupted before there was anything to save.

    One that is there already, of a worker that died before it could say so, is not done again.
    """
    with _lock:
        if order.under_way in _stopped:
            return None
    try:
        _check(order.software)
        run = _opened(order.under_way, order.directory, order.identity, order.engine)
        point = run.points[order.point]
        job = Job(point, order.repeat, run.digests[order.point])
        there = entry(run, job)
        if there.state is State.DONE and there.told is not None:
            return Outcome(order.point, order.repeat, there.told.stop, there.told.collisions)
        compile_for(arranged(point.experiment, order.repeat), run.engine)
        return do(run, job, partial(_watch, order), order.command)
    except (RunError, SceneError) as error:
        return Outcome(order.point, order.repeat, None, 0, error=str(error))
    except Exception as error:  # as in ``do``
        return unforeseen(order.point, order.repeat, error)
    finally:
        with _lock:
            _saving.discard(order)


def _watch(order: Order, _events: int) -> bool:
    """Whether a repeat that has now something to save is to be ended."""
    with _lock:
        stopped = order.under_way in _stopped
        if stopped and order not in _saving:
            raise LeftError
        _saving.add(order)
        return stopped


def _check(wanted: Software) -> None:
    """Raise ``RunError`` for other software than the one who orders has."""
    if wanted != software():
        raise RunError(
            f"the worker on {platform.node()} has {software()}, not {wanted}; install the same "
            "snooker everywhere and start the workers again"
        )


@lru_cache(maxsize=1)
def _opened(_under_way: str, directory: Path, identity: str, engine: str | None) -> Run:
    """The run in a folder as this machine sees it. Raises ``RunError`` if it is not the one."""
    try:
        run = open_run(directory)
    except RunError as error:
        reason = str(error).removeprefix(f"{directory}: ").rpartition(";")[0]
    else:
        if (run.identity, run.engine) == (identity, engine):
            return run
        reason = "holds another run"
    raise RunError(
        f"{directory}: {reason} as the worker on {platform.node()} sees it; --out must name a "
        "folder on a file system that all workers share"
    )
