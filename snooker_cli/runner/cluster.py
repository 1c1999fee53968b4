"""Workers on other machines, as a dask scheduler has them; the only home of ``distributed``."""

from __future__ import annotations

import re
import secrets
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from itertools import takewhile
from typing import Any, Self

from snooker_cli.results import Run, RunError
from snooker_cli.runner.ledger import Job
from snooker_cli.runner.remote import Order, fulfil, software, stop
from snooker_cli.runner.repeat import Outcome, unforeseen
from snooker_cli.runner.workers import Result, Workers

MOST = 1024
"""Repeats that the scheduler has at a time, if not told otherwise."""

ANSWERS = 10.0
"""Seconds in which a scheduler must answer."""

SAVES = 30.0
"""Seconds for which an interrupted run waits at most for what workers are saving."""

_ADDRESS = re.compile(r"(?:tcp|tls)://(?:\[[0-9A-Fa-f:.%]+\]|[^\s/:\[\]]+):(\d{1,5})")


class ClusterError(RunError):
    """Workers that cannot be had; one sentence."""


def check_address(address: str) -> None:
    """Raise ``ClusterError`` for what cannot be a scheduler's address."""
    match = _ADDRESS.fullmatch(address)
    if match is None or not 0 < int(match[1]) < 65536:
        raise ClusterError(
            f"--executor dask={address}: no address of a scheduler; it looks like "
            "dask=tcp://HOST:8786, as `dask scheduler` says when it starts"
        )


class Cluster(Workers):
    """The workers of a dask scheduler, which does the repeats of one that dies elsewhere.

    at_once : repeats that the scheduler has at a time
    threads : of all workers that are there at the beginning; others may come and go

    Raises ``ClusterError`` if there is no scheduler or a worker has other software.
    """

    def __init__(self, address: str, at_once: int | None, cancelled: threading.Event) -> None:
        check_address(address)
        try:
            import distributed
            from distributed.utils import silence_logging_cmgr
        except ImportError:
            raise ClusterError(
                "--executor dask needs dask: install it with `pip install 'snooker[cluster]'`"
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
        except ClusterError:
            self._exits.close()
            raise
        except Exception as error:
            self._exits.close()
            raise ClusterError(
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
        """Raise ``ClusterError`` for a worker with other software than this process has."""
        mine = software()
        for address, theirs in self._client.run(software, on_error="return").items():
            if theirs == mine or isinstance(theirs, OSError):  # of a worker that has just gone
                continue
            what = (
                f"has {theirs}"
                if isinstance(theirs, tuple)
                else f"has no such snooker ({_short(theirs)})"
            )
            raise ClusterError(
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
