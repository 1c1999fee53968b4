"""The command line: what its commands do and print."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from snooker_cli import __version__, runs, store
from snooker_cli.cli import output, run_command
from snooker_cli.config import schema
from snooker_cli.engine import jit, replay
from snooker_cli.figures import FigureData
from snooker_cli.trace import StopReason, Trace

HEAVY = ("numba", "numpy", "scipy", "matplotlib", "h5py", "pydantic", "yaml", "jinja2", "typst")

Snooker = Callable[..., Any]
"""The fixture of that name: arguments in, code, out and err back."""


# The front door


def test_help_lists_the_commands_without_loading_heavy_libraries() -> None:
    """Loading them takes a second, for which nobody who asks for help should wait."""
    script = (
        "import sys\n"
        "from snooker_cli.cli import main\n"
        "sys.argv = ['snooker', '--help']\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        "    print(*sys.modules, file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    for command in ("run", "ls", "show", "verify", "export", "validate", "schema"):
        assert re.search(rf"\b{command}\b", done.stdout)
    loaded = {name.partition(".")[0] for name in done.stderr.split()}
    assert "typer" in loaded
    assert not loaded & set(HEAVY)


def test_python_m_tells_the_version() -> None:
    command = [sys.executable, "-m", "snooker_cli", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"snooker {__version__}\n", "")


@pytest.mark.parametrize("command", ["run", "ls", "show", "verify", "export", "validate", "schema"])
def test_every_command_has_help(command: str, snooker: Snooker) -> None:
    ended = snooker(command, "--help")
    assert (ended.code, ended.err) == (0, "")
    assert "Usage" in ended.out


# run


def test_run_tells_its_points_in_a_table(here: Path, snooker: Snooker) -> None:
    ended = snooker("run", "small.yaml", "--no-progress")
    assert ended.code == 0
    heading, first, second, *_, last = ended.out.splitlines()
    assert heading.split() == ["point", "repeats", "collisions", "ended"]
    run = runs.open_run("small")
    traces = {point.index: list(run.traces(point)) for point in run.points}
    for line, (index, cor) in zip((first, second), enumerate(("0.85", "1.0")), strict=True):
        name, repeats, collisions, *ended_as = line.split()
        assert (name, repeats) == (f"cor={cor}", "3")
        assert int(collisions.replace(",", "")) == sum(each.collisions for each in traces[index])
        reasons = [str(each.stop.reason) for each in traces[index]]
        assert sorted(" ".join(ended_as).split(", ")) == sorted(
            f"{reasons.count(reason)} {reason}" for reason in set(reasons)
        )
    total = sum(trace.collisions for each in traces.values() for trace in each)
    assert re.fullmatch(
        rf"{total:,} events in [\d.]+ s \([\d,]+ events/s\)( after \d+ s of compiling)?; "
        "results in runs.small",
        last,
    )


def test_run_tells_of_wall_traps(finished: Path, snooker: Snooker) -> None:
    ended = snooker("run", "small.yaml")
    run = runs.open_run("small")
    trapped = [
        f"point 0, repeat {repeat}: {trace.stop.message}"
        for repeat, trace in enumerate(run.traces(run.points[0]))
        if trace.stop.reason is StopReason.WALL_TRAP
    ]
    assert trapped
    assert [line for line in ended.out.splitlines() if "wall trap:" in line] == trapped
    assert ended.code == 0
    assert snooker("run", "small.yaml", "--no-collapse").code == 5
    assert snooker("run", "small.yaml", "-o", "cor=1", "--out", "one", "--no-collapse").code == 0
    assert "0 events in" in ended.out


def test_run_prints_json(here: Path, snooker: Snooker) -> None:
    first = snooker("run", "small.yaml", "--json", "--out", "elsewhere", "-j", "2")
    assert first.code == 0
    told = json.loads(first.out)
    assert set(told) == {
        "run",
        "events",
        "seconds",
        "compiling_seconds",
        "events_per_second",
        "points",
    }
    assert told["run"] == "elsewhere"
    assert told["seconds"] >= 0
    assert isinstance(told["events_per_second"], int)
    assert told["events"] == sum(point["collisions"] for point in told["points"])
    run = runs.open_run("elsewhere")
    for point, said in zip(run.points, told["points"], strict=True):
        traces = list(run.traces(point))
        reasons = [str(trace.stop.reason) for trace in traces]
        assert said == {
            "parameters": dict(point.parameters),
            "repeats": 3,
            "cached": 0,
            "collisions": sum(trace.collisions for trace in traces),
            "ended": {reason: reasons.count(reason) for reason in set(reasons)},
            "stops": [
                {
                    "repeat": repeat,
                    "reason": "wall_trap",
                    "time": trace.stop.time,
                    "balls": list(trace.stop.balls),
                    "message": trace.stop.message,
                }
                for repeat, trace in enumerate(traces)
                if trace.stop.reason is StopReason.WALL_TRAP
            ],
            "errors": [],
            "work": said["work"],
        }
        assert {"collisions", "wall_trap"} >= set(reasons)
    assert [bool(point["stops"]) for point in told["points"]] == [True, False]
    again = json.loads(snooker("run", "small.yaml", "--json", "--out", "elsewhere").out)
    assert (again["events"], again["seconds"], again["events_per_second"]) == (0, 0, 0)
    assert [point["stops"] for point in again["points"]] == [
        point["stops"] for point in told["points"]
    ]
    assert [point["cached"] for point in again["points"]] == [3, 3]
    assert [point["work"] for point in again["points"]] == [None, None]
    assert [point["ended"] for point in again["points"]] == [
        point["ended"] for point in told["points"]
    ]


def test_overrides_set_and_sweep(here: Path, snooker: Snooker) -> None:
    sweep = ["-o", "balls.rings=range(0,2)", "-o", "cor=0.5:1.0:3"]
    ended = snooker("run", "small.yaml", "--json", "-o", "repeats=1", "-o", "seed=7", *sweep)
    assert ended.code == 0
    assert [point["parameters"] for point in json.loads(ended.out)["points"]] == [
        {"cor": cor, "balls.rings": rings} for cor in (0.5, 0.75, 1.0) for rings in (0, 1)
    ]
    experiment = runs.open_run("small").experiment
    assert (experiment.repeats, experiment.seed) == (1, 7)


def test_a_sweep_to_a_fixed_container_is_told_in_json(here: Path, snooker: Snooker) -> None:
    masses = ["-o", "container.mass=1e7,.inf", "-o", "cor=1", "-o", "repeats=1"]
    ended = snooker("run", "small.yaml", "--json", *masses)
    assert ended.code == 0, ended.err
    told = json.loads(ended.out, parse_constant=pytest.fail)
    assert len(told["points"]) == 2
    assert snooker("run", "small.yaml", "--no-progress", *masses).code == 0


def test_a_failing_repeat_is_told_and_gives_its_own_code(finished: Path, snooker: Snooker) -> None:
    path = finished / "point-0001" / "repeat-0002.h5"
    path.unlink()
    path.mkdir()
    ended = snooker("run", "small.yaml", "--json")
    assert ended.code == 4
    (said,) = (line for line in ended.err.splitlines() if "failed" in line)
    assert re.fullmatch(
        r"snooker: point 1, repeat 2 failed: .*repeat-0002\.h5: cannot write .*", said
    )
    point = json.loads(ended.out)["points"][1]
    assert (point["repeats"], point["cached"], point["ended"]["failed"]) == (3, 2, 1)
    assert len(point["errors"]) == 1
    table = snooker("run", "small.yaml", "--no-progress")
    assert table.code == 4
    assert "1 failed" in table.out
    assert (table.out + table.err).count("cannot write") == 1
    path.rmdir()
    assert snooker("run", "small.yaml", "--no-progress").code == 0


def test_fresh_replaces_another_configs_results(finished: Path, snooker: Snooker) -> None:
    refused = snooker("run", "small.yaml", "-o", "seed=2")
    assert refused.code == 2
    assert "give --fresh" in refused.err
    assert snooker("run", "small.yaml", "-o", "seed=2", "--fresh", "--no-progress").code == 0
    assert runs.open_run("small").experiment.seed == 2


def test_fresh_removes_the_fit_of_the_old_results(finished: Path, snooker: Snooker) -> None:
    assert snooker("fit", "small").code == 0
    assert (finished / "fit.json").exists()
    assert snooker("run", "small.yaml", "--no-progress").code == 0
    assert (finished / "fit.json").exists()
    ended = snooker("run", "small.yaml", "--no-progress", "-o", "repeats=4")
    assert ended.code == 0
    assert "removed fit.json" in ended.err
    assert not (finished / "fit.json").exists()
    assert snooker("fit", "small").code == 0
    assert snooker("run", "small.yaml", "--no-progress", "--fresh").code == 0
    assert not (finished / "fit.json").exists()


def test_the_figures_of_a_run_are_known_by_what_is_written_beside_them() -> None:
    assert {field.name for field in fields(FigureData)} >= runs.FIGURE_KEYS


def test_many_points_do_not_fill_the_terminal(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_command, "MOST_ROWS", 3)
    ended = snooker("run", "small.yaml", "-o", "cor=0.9:1.0:5", "-o", "repeats=1")
    lines = ended.out.splitlines()
    assert [line.split()[0] for line in lines[1:5]] == ["cor=0.9", "cor=0.925", "cor=0.95", "..."]
    assert lines[4].startswith("... and 2 more points")
    told = json.loads(
        snooker("run", "small.yaml", "-o", "cor=0.9:1.0:5", "--json", "-o", "repeats=1").out
    )
    assert len(told["points"]) == 5


# The compiler


def test_a_command_that_compiles_says_so_once(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On stderr, and as soon as it has taken longer than users wait without wondering."""
    shown = threading.Event()

    @jit.kernel
    def added(a: int, b: int) -> int:
        return a + b

    def compiling(*_arguments: object) -> None:
        for number in (1, 1.0):
            added(number, 2)
            assert shown.wait(30), "no notice"

    monkeypatch.setattr(jit, "NOTICE_AFTER", 0.0)
    monkeypatch.setattr(jit, "cache_folder", lambda: None)
    monkeypatch.setattr(output, "notice", lambda message: (print(message), shown.set()))
    monkeypatch.setattr("snooker_cli.cli.export_command.open_run", compiling)
    jit.give_notice.cache_clear()
    assert snooker("export", "small").out.splitlines()[0] == jit.NOTICE
    assert snooker("export", "small").out.count("compiling") == 0


# validate and schema


def test_validate_tells_what_a_config_holds(here: Path, snooker: Snooker) -> None:
    ended = snooker("validate", "small.yaml")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == "small.yaml: valid; points: 2, repeats of each: 3, balls: 7\n"
    swept = snooker("validate", "small.yaml", "-o", "balls.rings=0,2,1", "--json")
    assert json.loads(swept.out) == {
        "config": "small.yaml",
        "valid": True,
        "points": 6,
        "repeats": 3,
        "balls": [1, 7, 19],
    }
    assert list(here.iterdir()) == [here / "small.yaml"]


def test_validate_finds_the_scene_that_cannot_exist(here: Path, snooker: Snooker) -> None:
    ended = snooker("validate", "small.yaml", "-o", "balls.radius=1.0,3.0")
    assert ended.code == 3
    assert ended.out == ""
    assert re.fullmatch(
        r"snooker: .*balls\.radius: 1 rings within .* \(at the point cor=0\.85, "
        r"balls\.radius=3\.0\)\n",
        ended.err,
    )
    (here / "tight.yaml").write_text((here / "small.yaml").read_text().replace("1.0, s", "3.0, s"))
    ended = snooker("run", "tight.yaml")
    assert ended.code == 3
    assert ended.err.startswith("snooker: tight.yaml:2:27: balls.radius: 1 rings within 0.8 of")
    assert not (here / "runs").exists()


def test_schema_knows_the_keys_of_a_config(snooker: Snooker, small_config: str) -> None:
    ended = snooker("schema")
    assert (ended.code, ended.err) == (0, "")
    document = json.loads(ended.out)
    assert document == schema()

    def described(data: Any, entry: dict[str, Any]) -> None:
        """Every key of the data is among the entry's properties, all required ones are there."""
        if "oneOf" in entry:
            keys = set(data)
            (entry,) = (
                each
                for each in map(resolved, entry["oneOf"])
                if {*each.get("required", ["none"])} <= keys
            )
        entry = resolved(entry)
        if entry.get("type") == "object":
            assert entry["additionalProperties"] is False
            assert set(entry.get("required", ())) <= set(data) <= set(entry["properties"])
            for key, value in data.items():
                described(value, entry["properties"][key])

    def resolved(entry: dict[str, Any]) -> dict[str, Any]:
        if "$ref" not in entry:
            return entry
        home, _, name = entry["$ref"].rpartition("/")
        assert home == "#/$defs"
        return dict(document["$defs"][name])

    described(yaml.safe_load(small_config), document)


# export


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


@pytest.fixture
def trace(finished: Path) -> Trace:
    """Point 1, repeat 2."""
    return store.read(finished / "point-0001" / "repeat-0002.h5")[0]


def test_exported_events_read_back_as_the_same_doubles(trace: Trace, snooker: Snooker) -> None:
    ended = snooker("export", "small", "--point", "1", "--repeat", "2")
    assert (ended.code, ended.err) == (0, "")
    found, events = rows(ended.out), trace.events
    assert events is not None
    assert list(found[0]) == ["time", "i", "j", "impulse"]
    for name, kind in (("time", float), ("impulse", float), ("i", int), ("j", int)):
        assert [kind(row[name]) for row in found] == getattr(events, name).tolist()
    assert "-1" in {row["j"] for row in found}


@pytest.mark.parametrize("asked", [None, "0,0.5,1.25", "0:1:5"])
def test_exported_states_read_back_as_the_same_doubles(
    asked: str | None, trace: Trace, snooker: Snooker
) -> None:
    times = {None: [0.0, trace.stop.time], "0:1:5": [0.0, 0.25, 0.5, 0.75, 1.0]}.get(
        asked, [0.0, 0.5, 1.25]
    )
    options = [] if asked is None else ["--times", asked]
    ended = snooker("export", "small", "--point", "1", "--repeat", "2", "--states", *options)
    assert ended.code == 0, ended.err
    found = rows(ended.out)
    assert list(found[0]) == ["time", "ball", "x", "y", "u", "v"]
    assert [int(row["ball"]) for row in found] == len(times) * [-1, 0, 1, 2, 3, 4, 5, 6]
    assert [float(row["time"]) for row in found] == np.repeat(times, 8).tolist()
    numbers = np.array([[float(row[name]) for name in "xyuv"] for row in found])
    states = replay(trace, times)
    expected = np.concatenate(
        [
            np.concatenate([states.container_positions[:, None], states.positions], axis=1),
            np.concatenate([states.container_velocities[:, None], states.velocities], axis=1),
        ],
        axis=2,
    )
    assert np.array_equal(numbers, expected.reshape(-1, 4))
    if asked is None:
        assert np.array_equal(numbers[1:8, :2], trace.start.positions)
        assert np.array_equal(numbers[9:, 2:], trace.finish.velocities)
