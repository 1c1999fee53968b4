"""Simulate batches by the workers of a dask scheduler; only this file imports ``distributed``."""

import platform
import re
import secrets
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, InvalidStateError, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.metadata import version
from itertools import chain, takewhile
from pathlib import Path
from typing import Any

from snooker_cli import __version__, store
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import RunError, StoreError, error_text, install_advice
from snooker_cli.files import discard
from snooker_cli.formatting import listed
from snooker_cli.laws import Law, PackageLaw
from snooker_cli.options import EXECUTOR, OUT
from snooker_cli.runs.batch import (
    Batch,
    BatchResults,
    Begun,
    Job,
    Progress,
    RepeatResult,
    simulate_and_store,
    stored_result,
    unexpected,
)
from snooker_cli.runs.execution import Executor, Watcher, asking
from snooker_cli.runs.folder import open_run
from snooker_cli.runs.run import RunFolder
from snooker_cli.runs.status import target_of
from snooker_cli.runs.warm_up import compile_for
from snooker_cli.store import SCHEMA_VERSION

AT_ONCE = 1024  # batches that the scheduler has at a time, by default
ANSWER_TIMEOUT = 10.0  # seconds within which a scheduler must answer
CANCEL_TIMEOUT = 1.0  # seconds within which dask cancels what a lost scheduler cannot do
SAVE_TIMEOUT = 30.0  # seconds that an interrupted run waits for its workers to store repeats

_ADDRESS = re.compile(r"(?:tcp|tls)://(?:\[[0-9A-Fa-f:.%]+\]|[^\s/:\[\]]+):(\d{1,5})")


# On the worker.


def software() -> str:
    """What must be the same wherever repeats of one run are simulated; of this process."""
    own = (
        f"snooker {__version__} with engine version {ENGINE_VERSION}, files of schema "
        f"{SCHEMA_VERSION}"
    )
    names = ("numba", "NumPy", "dask", "distributed")
    return listed([own, *(f"{name} {version(name.lower())}" for name in names)])


@dataclass(frozen=True)
class RemoteRun:
    """What a worker must know of a run; it reads the rest in the folder's manifest.

    name : unique for one `snooker run`
    directory : the run's folder, the same on all machines
    identity : of the run, to notice another run in the folder
    command, interval : as in ``Job``
    """

    name: str
    software: str
    directory: Path
    identity: str
    command: str
    interval: float


_begun: dict[str, Begun] = {}  # the repeats of each run that are simulated in this process


def begun(name: str) -> Begun:
    """The repeats of a run in this process."""
    return _begun.setdefault(name, Begun(threading.Event()))


def stop(name: str) -> set[Batch]:
    """Stop an interrupted run in this process; the batches that are or will be stored."""
    return begun(name).stop()


_reached: dict[str, dict[Batch, Progress]] = {}  # of each run in this process


def reached(name: str) -> list[Progress]:
    """How far the batches of a run are that are simulated in this process."""
    return list(_reached.get(name, {}).values())


def simulate_remotely(remote: RemoteRun, batch: Batch) -> BatchResults:
    """Simulate and store a batch; None if its run was interrupted before that.

    A batch is not simulated again if a worker stored it and died before it could report.
    """
    mine, news = begun(remote.name), _reached.setdefault(remote.name, {})
    if mine.stopped.is_set():
        return None
    try:
        if remote.software != software():
            raise _other_software(f"the worker on {platform.node()}", software(), remote.software)
        run = _opened(remote)
        stored = list(map(stored_result, run.file_statuses(run.path(*batch), check=store.check)))
        if len(stored) == len(batch.repeats) and all(stored):
            return [replace(result, cached=False) for result in stored if result]
        config = run.by_number[batch.point].config
        _check_laws(config.collision_rules.laws)
        compile_for(config)
        job = Job(run, remote.command, remote.interval)
        return simulate_and_store(job, batch, mine, partial(news.__setitem__, batch))
    except RunError as error:
        return [RepeatResult(batch.point, repeat, error=str(error)) for repeat in batch.repeats]
    except Exception as error:  # as in ``simulate_and_store``
        return unexpected(batch, error)
    finally:
        news.pop(batch, None)


def _other_software(worker: str, theirs: object, mine: str) -> RunError:
    return RunError(
        f"{worker} has {theirs}, not {mine}",
        "install the same versions everywhere and start the workers again",
    )


def _check_laws(laws: Iterable[Law]) -> None:
    """Raise ``RunError`` for a law of a package that this worker does not have like this."""
    for law in laws:
        if isinstance(law, PackageLaw) and law.problem:
            raise RunError(
                f"on the worker on {platform.node()}, {law.problem}",
                "install the same packages everywhere and start the workers again",
            )


@lru_cache(maxsize=1)
def _opened(remote: RemoteRun) -> RunFolder:
    """The run in a folder as this machine sees it. Raises ``RunError`` for another one."""
    try:
        run = open_run(remote.directory)
        if run.identity == remote.identity:
            return run
        problem = f"{remote.directory}: holds another run"
    except (RunError, StoreError) as error:
        problem = error.problem
    raise RunError(
        f"{problem} as the worker on {platform.node()} sees it",
        f"{OUT} must name a folder on a file system that all workers share",
    )


# On the machine of the user.


class DaskExecutor(Executor):
    """The workers of a dask scheduler, which gives the repeats of one that dies to others.

    at_once : batches that the scheduler has at a time
    threads : of all workers at the beginning; others may come and go

    Raises ``RunError`` if there is no scheduler or a worker has other software.
    """

    def __init__(self, address: str, at_once: int | None, cancelled: threading.Event) -> None:
        match, executor = _ADDRESS.fullmatch(address), EXECUTOR.of(f"dask={address}")
        if match is None or not 0 < int(match[1]) < 65536:
            raise RunError(
                f"{executor}: no address of a scheduler",
                "it looks like dask=tcp://HOST:8786, as `dask scheduler` says when it starts",
            )
        try:
            import distributed
            from distributed.utils import silence_logging_cmgr
        except ImportError:
            raise RunError(f"{EXECUTOR} dask needs dask", install_advice("cluster")) from None
        self.address = address
        self._name = secrets.token_hex(8)
        self._lost = False
        self._stopping: Future[dict[str, set[Batch]]] | None = None
        self._deadline = 0.0
        with ExitStack() as exits:
            exits.enter_context(silence_logging_cmgr("critical"))
            try:
                security = distributed.Security().get_connection_args("client")
                if address.startswith("tls:") and not security.get("ssl_context"):
                    # A client that begins without certificates cannot be closed.
                    raise RunError(
                        f"{executor}: dask's configuration names no certificates for TLS",
                        "set distributed.comm.tls as docs/cluster.md shows",
                    )
                self._client = distributed.Client(
                    address, timeout=ANSWER_TIMEOUT, set_as_default=False
                )
                exits.callback(self._client.close, 1.0)
                self._check_software()
                self.threads = sum(self._client.nthreads().values())
            except RunError:
                raise
            except Exception as error:
                raise RunError(
                    f"no dask scheduler answers at {address} ({error_text(error)})",
                    "start one with `dask scheduler` and its workers with `dask worker`, or "
                    "correct the address",
                ) from None
            self._exits = exits.pop_all()
        self._connection, self._gone = self._client.scheduler_comm, 0.0
        super().__init__(self._client.get_executor(pure=False), at_once or AT_ONCE, cancelled)
        self._exits.callback(self._pool.shutdown, wait=False)

    def __exit__(self, *_error: object) -> None:
        with suppress(Exception):  # of a scheduler that is gone
            self._exits.close()

    def simulate(
        self, job: Job, missing: Sequence[Batch], watcher: Watcher
    ) -> Iterator[BatchResults]:
        watcher.simulating(0.0)  # each worker compiles what it needs
        run, folder = job.run, job.run.directory.absolute()
        remote = RemoteRun(self._name, software(), folder, run.identity, job.command, job.interval)
        items = takewhile(lambda _: not self._lost, missing)
        with asking(self._news, watcher):
            yield from self.results(partial(simulate_remotely, remote), items)
        if not self._cancelled.is_set():
            # Workers that died may have left parts of batches that others have stored.
            stored = {path for batch in missing if (path := run.path(*batch)).exists()}
            for part in run.directory.glob("point-*/*.part"):
                if target_of(part) in stored:
                    discard(part)

    def _check_software(self) -> None:
        """Raise ``RunError`` for a worker with other software than this process has."""
        mine = software()
        for address, theirs in self._client.run(software, on_error="return").items():
            if theirs == mine or isinstance(theirs, OSError):  # of a worker that has just gone
                continue
            if not isinstance(theirs, str):
                theirs = f"no such snooker ({error_text(theirs)})"
            raise _other_software(f"the worker at {address}", theirs, mine)

    def _news(self) -> Iterator[Progress]:
        """How far the workers are."""
        answers = self._client.run(reached, self._name, on_error="ignore")
        return chain.from_iterable(answers.values())

    def _give_up(self, pending: Iterable[Future[Any]]) -> None:
        if self._client.scheduler_comm is self._connection:
            return
        # Dask now cancels what it waits for, but never ends a result that it was just fetching.
        self._gone = self._gone or time.monotonic()
        for future in pending if time.monotonic() > self._gone + CANCEL_TIMEOUT else ():
            with suppress(InvalidStateError):  # it has just ended
                future.set_exception(CancelledError())

    def _stop_and_ask(self, pending: Iterable[Any]) -> bool:
        if self._stopping is None:
            self._deadline = time.monotonic() + SAVE_TIMEOUT
            asking = ThreadPoolExecutor(1)  # ``Client.run`` waits for an answer of each worker
            self._stopping = asking.submit(self._client.run, stop, self._name, on_error="ignore")
        if time.monotonic() > self._deadline:
            return False
        if not self._stopping.done():
            return True
        if self._stopping.exception() is not None:
            return False
        return not set().union(*self._stopping.result().values()).isdisjoint(pending)

    def _result(self, future: Future[Any], item: Any) -> Any:
        try:
            return future.result()
        except CancelledError:
            self._lost = True
            error = f"the dask scheduler at {self.address} is gone; start it and run again"
        except Exception as unknown:
            from distributed import KilledWorker

            if not isinstance(unknown, KilledWorker):
                return unexpected(item, unknown)
            error = "the workers that simulated this batch died; their logs may say why"
        return [RepeatResult(item.point, repeat, error=error) for repeat in item.repeats]
