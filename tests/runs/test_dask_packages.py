"""A run with the law of a package on a real scheduler, whose workers have the package or do not."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from installed import PACKAGES, Installed, with_yielding
from repeating import contents

from snooker_cli import runs

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The package, and a run by threads."""
    return with_yielding(tmp_path_factory.mktemp("law"), "--out", "threads")


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[distributed.LocalCluster]:
    """A scheduler without workers."""
    with distributed.LocalCluster(
        n_workers=0,
        dashboard_address=":0",
        silence_logs=logging.CRITICAL,
        local_directory=str(tmp_path_factory.mktemp("workers")),
    ) as started:
        yield started


@contextmanager
def worker(scheduler: distributed.LocalCluster, *sites: Path) -> Iterator[None]:
    """Inside, a worker is there, which has the packages of these folders and no others."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", scheduler.scheduler_address]
    command += ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    paths = {"PYTHONPATH": os.pathsep.join(map(str, sites))}
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with (
        subprocess.Popen(command, env=os.environ | paths, **options) as process,
        distributed.Client(scheduler.scheduler_address, set_as_default=False) as client,
    ):
        try:
            client.wait_for_workers(1, timeout=60)
            yield
        finally:
            process.terminate()


@pytest.fixture
def run(
    installed: Installed, scheduler: distributed.LocalCluster
) -> Callable[[Path], subprocess.CompletedProcess[str]]:
    """The run by the worker that is there, into a folder."""

    def started(out: Path) -> subprocess.CompletedProcess[str]:
        executor = f"dask={scheduler.scheduler_address}"
        command = ["-m", "snooker_cli", "run", "gas.yaml", "--out", str(out), "--no-progress"]
        return installed.ended(*command, "--executor", executor)

    return started


def test_a_worker_with_the_package_gives_the_bits_of_threads(
    installed: Installed,
    scheduler: distributed.LocalCluster,
    run: Callable[[Path], subprocess.CompletedProcess[str]],
    tmp_path: Path,
) -> None:
    with worker(scheduler, installed.site):
        done = run(tmp_path / "far")
    assert (done.returncode, done.stderr) == (0, "")
    assert contents(runs.open_run(tmp_path / "far")) == contents(
        runs.open_run(installed.here / "threads")
    )


@pytest.mark.parametrize("changed", [False, True])
def test_a_worker_without_the_same_package_simulates_nothing(
    changed: bool,
    installed: Installed,
    scheduler: distributed.LocalCluster,
    run: Callable[[Path], subprocess.CompletedProcess[str]],
    tmp_path: Path,
) -> None:
    """The law has the hash of its sources in the config of the run."""
    sites = []
    if changed:
        other = Installed(tmp_path)
        other.add(PACKAGES / "yielding")
        module = other.site / "snooker_yielding.py"
        module.write_text(module.read_text("utf-8") + "# another one\n", "utf-8")
        sites = [other.site]
    with worker(scheduler, *sites):
        done = run(tmp_path / "far")
    assert done.returncode == 4
    of = "the law yielding is of snooker-yielding 0.1"
    assert of in done.stderr
    with_others = "with other sources than snooker-yielding 0.1"
    assert (with_others if changed else "which is not installed") in done.stderr
    assert "install the same packages everywhere and start the workers again" in done.stderr
    assert "bug" not in done.stderr
    assert not list((tmp_path / "far").rglob("*.h5"))
