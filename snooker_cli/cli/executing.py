"""``--executor``: who simulates a run's repeats."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from snooker_cli.cli.endings import UserError

if TYPE_CHECKING:
    from snooker_cli.runner.cluster import Cluster

THREADS = "threads"


def scheduler_of(executor: str) -> str | None:
    """The address of the dask scheduler that ``--executor`` names; none for threads.

    Raises ``UserError`` for another kind and ``ClusterError`` for what is no address.
    """
    kind, _, address = executor.partition("=")
    if executor == THREADS:
        return None
    if kind != "dask":
        raise UserError(
            f"--executor {executor}: there is no such executor; say {THREADS}, or "
            "dask=tcp://HOST:PORT for the workers of a dask scheduler"
        )
    from snooker_cli.runner.cluster import check_address

    check_address(address)
    return address


def reached(address: str, at_once: int | None, cancelled: threading.Event) -> Cluster:
    """The workers of a scheduler; tells that none are there. Raises ``ClusterError``."""
    from snooker_cli.cli.progress import say
    from snooker_cli.runner.cluster import Cluster

    cluster = Cluster(address, at_once, cancelled)
    if cluster.threads == 0:
        say(f"the dask scheduler at {address} has no workers yet; waiting for them")
    return cluster
