"""Files of the schema version before, as that version stored them, are read and continued."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

import snooker_cli
from snooker_cli import store
from snooker_cli.laws import Constant, Sides, Viscoelastic
from snooker_cli.runs import RunFolder, open_run
from snooker_cli.runs.run import RepeatState
from snooker_cli.runs.verification import verify

STORED = Path(__file__).parents[1] / "data/version_4"


@pytest.fixture(params=["plain", "rough"])
def run(request: pytest.FixtureRequest, tmp_path: Path) -> RunFolder:
    """A copy of a run with one law for all walls, or with all that has numbers of its own."""
    copy = tmp_path / request.param
    shutil.copytree(STORED / request.param, copy)
    return open_run(copy)


def test_its_rules_are_those_of_its_config(run: RunFolder) -> None:
    (path,) = run.batches(0)
    with h5py.File(path) as file:
        parameters = file["parameters/snooker"].attrs
        assert parameters["schema_version"] == store.READABLE[0]
        assert "restitution" in json.loads(parameters["scene"])
    wanted = run.points[0].config.collision_rules
    assert type(wanted.pair_law) is (Constant if wanted.surface is None else Viscoelastic)
    assert type(wanted.wall_law) is (Constant if wanted.surface is None else Sides)
    for trace, header in store.read(path):
        assert header.rules == trace.start.rules == wanted


def test_simulating_it_again_gives_the_same_bits(run: RunFolder) -> None:
    assert {status.state for status in verify(run, replay=True, workers=1)} == {RepeatState.DONE}


def test_its_content_has_the_same_hash_in_this_version(run: RunFolder) -> None:
    (path,) = run.batches(0)
    before = store.read(path)
    store.write(path, [(header.repeat, trace) for trace, header in before], before[0][1].provenance)
    with h5py.File(path) as file:
        assert file["parameters/snooker"].attrs["schema_version"] == store.SCHEMA_VERSION
    assert [h.fingerprint for _, h in store.read(path)] == [h.fingerprint for _, h in before]


def test_a_longer_run_has_its_events(run: RunFolder) -> None:
    before = [trace.events.time for trace, _ in store.read(*run.batches(0))]
    config = json.loads((run.directory / "run.json").read_text("utf-8"))["experiment"]
    longer = snooker_cli.run(config, {"collisions": 30}, out=run.directory, progress=False)
    for times, (trace, _) in zip(before, store.read(*longer.batches(0)), strict=True):
        assert np.array_equal(trace.events.time[:20], times)
