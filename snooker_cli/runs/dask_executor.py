"""Workers on other machines, as a dask scheduler has them; the only home of ``distributed``."""

from __future__ import annotations

import platform
import re
import secrets
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import takewhile
from pathlib import Path
from typing import Any, NamedTuple, Self

from snooker_cli import __version__
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import RunError, SceneError
from snooker_cli.runs.execution import RepeatExecutor, Result
from snooker_cli.runs.folder import open_run
from snooker_cli.runs.plan import arranged
from snooker_cli.runs.repeat import LeftError, Outcome, compile_for, do, unforeseen
from snooker_cli.runs.run import Run, State
from snooker_cli.runs.status import Job, entry
from snooker_cli.store import SCHEMA_VERSION

# What a worker on another machine does: repeats as they are ordered, into the run's folder.


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


MOST = 1024
"""Repeats that the scheduler has at a time, if not told otherwise."""

ANSWERS = 10.0
"""Seconds in which a scheduler must answer."""

SAVES = 30.0
"""Seconds for which an interrupted run waits at most for what workers are saving."""

_ADDRESS = re.compile(r"(?:tcp|tls)://(?:\[[0-9A-Fa-f:.%]+\]|[^\s/:\[\]]+):(\d{1,5})")


def check_address(address: str) -> None:
    """Raise ``RunError`` for what cannot be a scheduler's address."""
    match = _ADDRESS.fullmatch(address)
    if match is None or not 0 < int(match[1]) < 65536:
        raise RunError(
            f"--executor dask={address}: no address of a scheduler; it looks like "
            "dask=tcp://HOST:8786, as `dask scheduler` says when it starts"
        )


class DaskExecutor(RepeatExecutor):
    """The workers of a dask scheduler, which does the repeats of one that dies elsewhere.

    at_once : repeats that the scheduler has at a time
    threads : of all workers that are there at the beginning; others may come and go

    Raises ``RunError`` if there is no scheduler or a worker has other software.
    """

    def __init__(self, address: str, at_once: int | None, cancelled: threading.Event) -> None:
        check_address(address)
        try:
            import distributed
            from distributed.utils import silence_logging_cmgr
        except ImportError:
            raise RunError(
                "--executor dask needs dask: install it with `pip install 'snooker-cli[cluster]'`"
            ) from None
        self.address = address
        self._name = secrets.token_hex(8)
        self._lost = False
        self._stopping: Future[dict[str, list[Order]]] | None = None
        self._until = 0.0
        self._exits = ExitStack()
        self._exits.enter_context(silence_logging_cmgr("critical"))
        try:
            self._client = distributed.Client(address, timeout=ANSWERS, set_as_default=False)
            self._exits.callback(self._client.close, 1.0)
            self._check_software()
            self.threads = sum(self._client.nthreads().values())
        except RunError:
            self._exits.close()
            raise
        except Exception as error:
            self._exits.close()
            raise RunError(
                f"no dask scheduler answers at {address} ({_short(error)}); start one with "
                "`dask scheduler` and its workers with `dask worker`, or correct the address"
            ) from None
        super().__init__(self._client.get_executor(pure=False), at_once or MOST, cancelled)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        with suppress(Exception):  # of a scheduler that is gone
            self._executor.shutdown(wait=False)
        with suppress(Exception):
            self._exits.close()

    def repeats(self, run: Run, jobs: Sequence[Job], command: str) -> Iterator[Outcome | None]:
        """The outcomes of a run's repeats as they come."""
        directory, identity = run.directory.absolute(), run.identity
        orders = (
            Order(
                under_way=self._name,
                software=software(),
                directory=directory,
                identity=identity,
                engine=run.engine,
                command=command,
                point=job.point.index,
                repeat=job.repeat,
            )
            for job in jobs
        )
        yield from self.each(fulfil, takewhile(lambda _: not self._lost, orders))
        if not self._cancelled.is_set():
            _clear_away(run, jobs)

    def _check_software(self) -> None:
        """Raise ``RunError`` for a worker with other software than this process has."""
        mine = software()
        for address, theirs in self._client.run(software, on_error="return").items():
            if theirs == mine or isinstance(theirs, OSError):  # of a worker that has just gone
                continue
            what = (
                f"has {theirs}"
                if isinstance(theirs, tuple)
                else f"has no such snooker ({_short(theirs)})"
            )
            raise RunError(
                f"the worker at {address} {what}, where this is {mine}; install the same snooker "
                "everywhere and start the workers again"
            )

    def _submit(self, function: Callable[..., Result], item: Any) -> Future[Result]:
        return self._executor.submit(function, item)

    def _leaves(self, under_way: Mapping[Future[Any], Any]) -> bool:
        """All repeats are stopped; those are waited for whose workers have something to save."""
        if self._stopping is None:
            self._until = time.monotonic() + SAVES
            asking = ThreadPoolExecutor(1)
            self._stopping = asking.submit(self._client.run, stop, self._name, on_error="ignore")
        if time.monotonic() > self._until:
            return True
        if not self._stopping.done():
            return False
        if self._stopping.exception() is not None:
            return True
        saving = {order for orders in self._stopping.result().values() for order in orders}
        return saving.isdisjoint(under_way.values())

    def _result(self, future: Future[Any], item: Any) -> Any:
        try:
            return future.result()
        except CancelledError:
            self._lost = True
            error = f"the dask scheduler at {self.address} is gone; start it and run again"
        except Exception as unknown:
            from distributed import KilledWorker

            if not isinstance(unknown, KilledWorker):
                return unforeseen(item.point, item.repeat, unknown)
            error = (
                f"the scheduler gave it up after {unknown.allowed_failures + 1} of its workers had "
                f"died, the last at {unknown.last_worker.address}; their logs may say why"
            )
        return Outcome(item.point, item.repeat, None, 0, error=error)


def _clear_away(run: Run, jobs: Iterable[Job]) -> None:
    """Remove what workers that died have begun to write of repeats that are now there."""
    there = {path for job in jobs if (path := run.path(job.point.index, job.repeat)).exists()}
    for part in run.directory.glob("point-*/*.part"):
        if part.with_name(f"{part.name.partition('.h5.')[0]}.h5") in there:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def _short(error: BaseException) -> str:
    """An error's first line."""
    return (str(error).splitlines() or [type(error).__name__])[0]
