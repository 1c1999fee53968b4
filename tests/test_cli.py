"""The command line: what commands print, and how each mistake is told: a code and a sentence."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from snooker_cli import __version__, results, store
from snooker_cli.config import schema
from snooker_cli.engine import replay
from snooker_cli.results import Run
from snooker_cli.trace import StopReason, Trace

TABLE: dict[str, Any] = yaml.safe_load(
    (Path(__file__).parent / "data" / "bad_configs.yaml").read_text(encoding="utf-8")
)

HEAVY = ("numba", "numpy", "scipy", "matplotlib", "h5py", "pydantic", "yaml", "jinja2", "typst")

Snooker = Callable[..., Any]
"""The fixture of that name: arguments in, code, out and err back."""


@pytest.fixture
def here(tmp_path: Path, small_config: str, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with a good config, ``small.yaml``."""
    (tmp_path / "small.yaml").write_text(small_config)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def finished(here: Path, finished_run: Run) -> Path:
    """That directory with the config's run in it, ``runs/small``."""
    return Path(shutil.copytree(finished_run.directory, here / "runs" / "small"))


def tree(directory: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file()
    }


def real(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own."""
    command = [sys.executable, "-m", "snooker_cli", *arguments]
    return subprocess.run(command, text=True, check=False, stderr=subprocess.PIPE, **options)


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
    for command in ("run", "export", "validate", "schema"):
        assert re.search(rf"\b{command}\b", done.stdout)
    loaded = {name.partition(".")[0] for name in done.stderr.split()}
    assert "typer" in loaded
    assert not loaded & set(HEAVY)


def test_python_m_tells_the_version() -> None:
    done = real("--version", stdout=subprocess.PIPE)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"snooker {__version__}\n", "")


@pytest.mark.parametrize("command", ["run", "export", "validate", "schema"])
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
    run = results.open_run("small")
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
        rf"{total:,} events in [\d.]+ s \([\d,]+ events/s\); results in runs.small", last
    )


def test_run_tells_of_wall_traps(finished: Path, snooker: Snooker) -> None:
    ended = snooker("run", "small.yaml")
    run = results.open_run("small")
    trapped = [
        f"point 0, repeat {repeat}: {trace.stop.message}"
        for repeat, trace in enumerate(run.traces(run.points[0]))
        if trace.stop.reason is StopReason.WALL_TRAP
    ]
    assert trapped
    assert [line for line in ended.out.splitlines() if "wall trap:" in line] == trapped
    assert "0 events in" in ended.out
    assert "6 repeats were there already" in ended.out


def test_run_prints_json(here: Path, snooker: Snooker) -> None:
    first = snooker("run", "small.yaml", "--json", "--out", "elsewhere", "-j", "2")
    assert first.code == 0
    told = json.loads(first.out)
    assert set(told) == {"run", "events", "seconds", "events_per_second", "points"}
    assert told["run"] == "elsewhere"
    assert told["seconds"] >= 0
    assert isinstance(told["events_per_second"], int)
    assert told["events"] == sum(point["collisions"] for point in told["points"])
    run = results.open_run("elsewhere")
    for point, said in zip(run.points, told["points"], strict=True):
        traces = list(run.traces(point))
        reasons = [str(trace.stop.reason) for trace in traces]
        assert said == {
            "parameters": dict(point.parameters),
            "repeats": 3,
            "cached": 0,
            "collisions": sum(trace.collisions for trace in traces),
            "ended": {reason: reasons.count(reason) for reason in set(reasons)},
            "errors": [],
        }
    again = json.loads(snooker("run", "small.yaml", "--json", "--out", "elsewhere").out)
    assert again["events"] == 0
    assert [point["cached"] for point in again["points"]] == [3, 3]
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
    experiment = results.open_run("small").experiment
    assert (experiment.repeats, experiment.seed) == (1, 7)


def test_a_sweep_to_a_fixed_container_is_told_in_json(here: Path, snooker: Snooker) -> None:
    masses = ["-o", "container.mass=1e7,.inf", "-o", "cor=1", "-o", "repeats=1"]
    ended = snooker("run", "small.yaml", "--json", *masses)
    assert (ended.code, ended.err) == (0, "")
    told = json.loads(ended.out, parse_constant=pytest.fail)
    assert len(told["points"]) == 2
    assert snooker("run", "small.yaml", "--no-progress", *masses).code == 0


def test_a_failing_repeat_is_told_and_gives_its_own_code(
    finished: Path, snooker: Snooker
) -> None:
    path = finished / "point-0001" / "repeat-0002.h5"
    path.unlink()
    path.mkdir()
    ended = snooker("run", "small.yaml", "--json")
    assert ended.code == 4
    assert re.fullmatch(
        r"snooker: point 1, repeat 2 failed: .*repeat-0002\.h5: cannot write .*\n", ended.err
    )
    point = json.loads(ended.out)["points"][1]
    assert (point["repeats"], point["cached"], point["ended"]["failed"]) == (3, 2, 1)
    assert len(point["errors"]) == 1
    table = snooker("run", "small.yaml", "--no-progress")
    assert table.code == 4
    assert "1 failed" in table.out
    path.rmdir()
    assert snooker("run", "small.yaml", "--no-progress").code == 0


def test_fresh_replaces_another_configs_results(finished: Path, snooker: Snooker) -> None:
    refused = snooker("run", "small.yaml", "-o", "seed=2")
    assert refused.code == 2
    assert "give --fresh" in refused.err
    assert snooker("run", "small.yaml", "-o", "seed=2", "--fresh", "--no-progress").code == 0
    assert results.open_run("small").experiment.seed == 2


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
    assert list(tree(here)) == ["small.yaml"]


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
            (entry,) = (each for each in map(resolved, entry["oneOf"]) if keys & {*each["required"]})
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
    return store.read(finished / "point-0001" / "repeat-0002.h5").trace


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
    assert (ended.code, ended.err) == (0, "")
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


# Mistakes

MISTAKES: dict[str, tuple[list[str], int, str]] = {
    "no config": (["run", "absent.yaml"], 3, r"absent\.yaml: there is no such file"),
    "folder as config": (["run", "runs"], 3, r"runs: this is a directory"),
    "value": (["run", "small.yaml", "-o", "cor=2"], 3, r"-o cor=2: .*a number from 0 to 1"),
    "key": (["run", "small.yaml", "-o", "coor=1"], 3, r"-o coor=1: .*did you mean cor"),
    "no value": (["run", "small.yaml", "-o", "cor"], 3, r"-o cor: "),
    "validate": (["validate", "small.yaml", "-o", "cor=-1"], 3, r"-o cor=-1: "),
    "other results": (["run", "small.yaml", "-o", "seed=2"], 2, r".*small: holds results of another"),
    "not a run": (["run", "small.yaml", "--out", "."], 2, r"\.: is not empty and not a run"),
    "file as folder": (["run", "small.yaml", "--out", "small.yaml"], 2, r".*: cannot be written"),
    "inside a file": (["run", "small.yaml", "--out", "small.yaml/a"], 2, r".*: cannot be written"),
    "fresh in no run": (["run", "small.yaml", "--out", ".", "--fresh"], 2, r"\.: is not empty"),
    "no run": (["export", "absent"], 2, r"absent: there is no run here"),
    "config as run": (["export", "small.yaml"], 2, r"small\.yaml: there is no run here"),
    "no point": (["export", "small", "--point", "2"], 2, r"--point 2: small has points 0 to 1"),
    "no repeat": (["export", "small", "--repeat", "3"], 4, r".*repeat-0003\.h5: there is no such"),
    "damaged": (["export", "small", "--repeat", "1"], 4, r".*repeat-0001\.h5: not a readable"),
    "events at times": (["export", "small", "--times", "0"], 2, r"--times goes with --states"),
    **{
        f"times {times}": (["export", "small", "--states", "--times", times], 2, rf"--times {times}: ")
        for times in ("x", "0,", "1,0", "-1", "0,1e9", "nan", "0,nan", "0:1", "0:1:-2", "0:1:0.5")
    },
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_told_in_a_sentence(name: str, finished: Path, snooker: Snooker) -> None:
    (finished / "point-0000" / "repeat-0001.h5").write_text("not HDF5")
    before = tree(finished.parents[1])
    arguments, code, sentence = MISTAKES[name]
    ended = snooker(*arguments)
    assert ended.code == code
    assert ended.out == ""
    said = ended.err.removesuffix("\n")
    assert said.isprintable(), said
    assert re.match(f"snooker: {sentence}", said), said
    assert tree(finished.parents[1]) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["run"],
        ["run", "small.yaml", "-j", "0"],
        ["run", "small.yaml", "-j", "many"],
        ["run", "small.yaml", "--unknown"],
        ["unknown"],
        ["export", "small", "--point", "-1"],
    ],
)
def test_wrong_usage_has_its_code(arguments: list[str], finished: Path, snooker: Snooker) -> None:
    ended = snooker(*arguments)
    assert (ended.code, ended.out) == (2, "")
    assert "Error" in ended.err
    assert "Traceback" not in ended.err


def test_a_summary_has_no_events_to_export(here: Path, snooker: Snooker) -> None:
    assert snooker("run", "small.yaml", "-o", "record=summary", "--no-progress").code == 0
    for options in ([], ["--states"]):
        ended = snooker("export", "small", *options)
        assert (ended.code, ended.out) == (2, "")
        assert re.fullmatch(r"snooker: small was run with `record: summary`.*\n", ended.err)


def test_a_damaged_manifest_is_told_in_a_sentence(finished: Path, snooker: Snooker) -> None:
    (finished / "run.json").write_text('{"experiment": {"cor": 2}}')
    ended = snooker("export", "small")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.removesuffix("\n").isprintable(), ended.err
    assert "run.json: cannot be read" in ended.err


def text_of(case: dict[str, Any]) -> str:
    """The config of a case of the table; see its head."""
    if "text" in case:
        return str(case["text"])
    lines = dict(enumerate(TABLE["base"].splitlines(), start=1)) | case.get("line", {})
    text = "".join(f"{lines[number]}\n" for number in sorted(lines))
    return text.replace("{zeros}", "0" * 300).replace("{nines}", "9" * 5000)


@pytest.mark.parametrize("name", TABLE["cases"])
def test_bad_configs_are_told_with_their_position(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, snooker: Snooker
) -> None:
    case = TABLE["cases"][name]
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_bytes(text_of(case).encode())
    overrides = [f"--override={override}" for override in case.get("overrides", ())]
    ended = snooker("run", "bad.yaml", *overrides)
    assert ended.code == 3
    assert ended.out == ""
    assert "Traceback" not in ended.err
    lines = ended.err.removeprefix("snooker: ").splitlines()
    assert len(lines) == len(case["says"])
    for line, expected in zip(lines, case["says"], strict=True):
        assert re.match(".*".join(map(re.escape, expected.split("..."))), line)
    assert list(tree(tmp_path)) == ["bad.yaml"]
    assert list(tmp_path.iterdir()) == [tmp_path / "bad.yaml"]


# Readers that go away


@pytest.mark.parametrize("arguments", [["schema"], ["export", "small"]])
def test_a_reader_that_has_gone_ends_a_command_quietly(
    arguments: list[str], finished: Path
) -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        done = real(*arguments, stdout=write)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


def test_interrupted_commands_have_their_code(here: Path, snooker: Snooker) -> None:
    """While its reader waits, an export hangs in a write until it is interrupted."""
    long = ["-o", "cor=1", "-o", "repeats=1", "-o", "collisions=20000", "--out", "long"]
    assert snooker("run", "small.yaml", "--no-progress", *long).code == 0
    process = subprocess.Popen(
        [sys.executable, "-m", "snooker_cli", "export", "long"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "time,i,j,impulse\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 130
    assert "Traceback" not in said
