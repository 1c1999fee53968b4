"""Kernels that are compiled before they are needed: by `warm-up`, and beside a run."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from concurrent.futures import Future
from pathlib import Path
from typing import Any, ClassVar

import pytest
from command_line import SMALL, output_of
from repeating import done, made

from snooker_cli.config import parse
from snooker_cli.engine.compilation import COMPILATION
from snooker_cli.errors import UserError
from snooker_cli.runs import warm_up

WARMED = """
from pathlib import Path
from snooker_cli.analysis.measurement import measure
from snooker_cli.config import load
from snooker_cli.engine import replay, simulate
from snooker_cli.engine.replay import repeat_events, repeat_states
from snooker_cli.runs import warm_up
from snooker_cli.runs.plan import first_scene

experiment = load(Path({config!r})).points()[0].config
for step in warm_up.STEPS:
    step(experiment)
kernels = repeat_events, repeat_states
types = [len(kernel.compiled.signatures) for kernel in kernels]
traces = [simulate(first_scene(experiment, k), collisions=9) for k in range(2)]
measure(traces[:1])
measure(traces)
replay(traces[0], [0.0, traces[0].stop.time])
assert [len(kernel.compiled.signatures) for kernel in kernels] == types, types
print(*types)
"""


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled")
def test_analyses_need_no_other_kernels_than_those_that_were_compiled(tmp_path: Path) -> None:
    """A repeat without events has the types of any other."""
    config = tmp_path / "small.yaml"
    config.write_text(SMALL)
    assert output_of(WARMED.format(config=str(config))).split()[0] == "1"


class Pool:
    """Notes what a second process would compile, and whether it was ended."""

    made: ClassVar[list[Pool]] = []

    def __init__(self, workers: int, *_begin: Any) -> None:
        assert workers == 1
        self.calls: list[Any] = []
        self.ended = False
        self.made.append(self)

    def submit(self, *call: Any) -> Future[Any]:
        self.calls.append(call)
        return Future()

    def kill(self) -> None:
        self.ended = True

    def shutdown(self, **how: Any) -> None:
        assert how == {"cancel_futures": True}


@pytest.fixture
def pools(monkeypatch: pytest.MonkeyPatch) -> list[Pool]:
    monkeypatch.setattr(warm_up, "BESIDE", True)
    monkeypatch.setattr(warm_up, "processors", lambda: 2)
    monkeypatch.setattr(warm_up, "Processes", Pool)
    monkeypatch.setattr(Pool, "made", [])
    return Pool.made


def test_kernels_of_analyses_are_compiled_beside_those_of_a_run(pools: list[Pool]) -> None:
    """From the first function on, and no longer than the block; summaries need none."""
    events = parse(SMALL).config
    many = SMALL.replace("collisions: 150", "collisions: 100000")
    summary = parse(f"{many}record: summary\n").config
    with warm_up.compiling_beside([events, summary]):
        assert not pools
        for done_functions in range(3):
            for watcher in COMPILATION.watchers:
                watcher(done_functions, 3)
        (pool,) = pools
        assert pool.calls == [(warm_up.compile_for_analyses, events)]
        assert not pool.ended
    assert pool.ended
    with warm_up.compiling_beside([summary]):
        for watcher in COMPILATION.watchers:
            watcher(0, 3)
    assert pools == [pool]


def test_a_run_that_compiles_nothing_begins_no_second_process(
    pools: list[Pool], tmp_path: Path
) -> None:
    done(made(tmp_path / "first", SMALL), workers=2)
    pools.clear()
    done(made(tmp_path / "second", SMALL), workers=2, processes=True)
    assert not pools


def test_without_a_second_processor_nothing_is_compiled_beside(
    pools: list[Pool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(warm_up, "processors", lambda: 1)
    before = [*COMPILATION.watchers]
    with warm_up.compiling_beside([parse(SMALL).config]):
        assert before == COMPILATION.watchers
    assert not pools


def test_warm_up_compiles_in_processes(caplog: pytest.LogCaptureFixture) -> None:
    """All steps of a scene; a real process takes them."""
    with caplog.at_level(logging.WARNING):
        assert [*warm_up.compiled_steps([parse(SMALL).config])] == [3, 1, 2, 3]
    assert not caplog.records


def test_warm_up_needs_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warm_up, "cache_folder", lambda: None)
    with pytest.raises(UserError):
        next(warm_up.compiled_steps([parse(SMALL).config]))


INTERRUPTED = """
import os
from snooker_cli.config import parse
from snooker_cli.engine.compilation import COMPILATION
from snooker_cli.runs import warm_up

if __name__ == "__main__":
    warm_up.processors = lambda: 2
    with warm_up.compiling_beside([parse({config!r}).config]):
        for watcher in COMPILATION.watchers:
            watcher(0, 2)
    os._exit(0)  # as after an interrupt
"""


def test_a_second_process_leaves_nothing_that_an_exit_would_warn_of(tmp_path: Path) -> None:
    """A command that was interrupted ends without Python's own cleaning."""
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED.format(config=SMALL))
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
