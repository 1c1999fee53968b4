"""``snooker init``, ``validate`` and ``schema``: templates, and how bad configs are refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from command_line import Snooker

from snooker_cli.cli.config_commands import SCHEMA, STDOUT, purpose, templates
from snooker_cli.config import digest, load, schema
from snooker_cli.runs import open_run
from snooker_cli.theory import published_ratio
from snooker_cli.trace import StopReason

CONFIGS = Path(__file__).parents[2] / "configs"

NAMES = list(templates())

SHORT = {
    "report": ("collisions=50", "repeats=1"),
    "decay": ("collisions=200", "repeats=2"),
    "sweep": ("collisions=50", "repeats=1", "cor=0.8", "balls.radius=0.4,0.8"),
    "exact": ("balls.list[1].mass=1.0,1e2,1e4",),
    "dense": ("collisions=500", "repeats=1"),
}
"""What makes a template end in a moment."""

TABLE: dict[str, Any] = yaml.safe_load(
    (Path(__file__).parents[1] / "data" / "bad_configs.yaml").read_text(encoding="utf-8")
)


def test_all_templates_are_listed(here: Path, snooker: Snooker) -> None:
    folder = templates()["report"]
    assert isinstance(folder, Path)
    assert {path.stem for path in folder.parent.glob("*.yaml")} == set(NAMES)
    ended = snooker("init")
    assert (ended.code, ended.err) == (0, "")
    assert [line.split()[0] for line in ended.out.splitlines()[1:]] == NAMES
    assert all(purpose(template) in ended.out for template in templates().values())
    assert list(here.iterdir()) == [here / "small.yaml"]


@pytest.mark.parametrize("name", NAMES)
def test_a_template_runs(name: str, here: Path, snooker: Snooker) -> None:
    ended = snooker("init", name)
    assert (ended.code, ended.out.splitlines()) == (0, [f"{name}.yaml", SCHEMA])
    assert snooker("validate", f"{name}.yaml").code == 0
    short = [part for override in SHORT[name] for part in ("-o", override)]
    ran = snooker("run", f"{name}.yaml", *short, "--no-progress")
    assert ran.code == 0, ran.err
    assert all(
        trace.stop.reason.complete for trace in open_run(name).traces(open_run(name).points[0])
    )


@pytest.mark.parametrize("name", NAMES)
def test_every_key_is_explained(name: str) -> None:
    text = templates()[name].read_text(encoding="utf-8")
    lines = text.splitlines()
    assert lines[0] == f"# yaml-language-server: $schema={SCHEMA}"
    keys = [line for line in lines if re.match(r"(# |) *(- )?[a-z_.]+(\[\d\]\S*)?:( |$)", line)]
    assert len(keys) > 10
    assert [line for line in keys if "  # " not in line] == []
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize("name", NAMES)
def test_the_commands_in_a_template_use_its_name(name: str, snooker: Snooker) -> None:
    text = templates()[name].read_text(encoding="utf-8")
    commands = re.findall(r"^#   snooker (\w+) (\S+)", text, flags=re.MULTILINE)
    assert commands[0] == ("run", f"{name}.yaml")
    for command, about in commands:
        assert about == (f"{name}.yaml" if command == "run" else name)
        assert snooker(command, "--help").code == 0


def test_the_template_report_is_configs_decay(here: Path, snooker: Snooker) -> None:
    snooker("init", "report")
    ours, theirs = load("report.yaml").experiment, load(CONFIGS / "decay.yaml").experiment
    assert digest(ours) == digest(theirs)
    assert (ours.sweep, ours.repeats) == (theirs.sweep, theirs.repeats)


def test_the_collision_numbers_of_exact_are_the_digits_of_pi(here: Path, snooker: Snooker) -> None:
    snooker("init", "exact")
    assert snooker("run", "exact.yaml", "--no-progress").code == 0
    run = open_run("exact")
    traces = [trace for point in run.points for trace in run.traces(point)]
    assert [trace.collisions for trace in traces] == [3, 31, 314, 3141]
    assert {trace.stop.reason for trace in traces} == {StopReason.TIME}


def test_the_pressure_in_dense_is_the_published_one() -> None:
    published = published_ratio(0.7)
    assert published is not None
    text = templates()["dense"].read_text(encoding="utf-8")
    assert f"of the literature, {published.ratio:.2f}," in text


def test_out_names_the_file_and_the_schema_goes_beside_it(here: Path, snooker: Snooker) -> None:
    ended = snooker("init", "decay", "--out", "study/cooling.yaml")
    assert ended.out.splitlines() == ["study/cooling.yaml", f"study/{SCHEMA}"]
    assert "snooker run study/cooling.yaml --dry-run" in ended.err
    assert (here / "study" / SCHEMA).read_text() == snooker("schema").out
    assert {path.name for path in here.iterdir()} == {"small.yaml", "study"}


def test_an_old_schema_is_renewed(here: Path, snooker: Snooker) -> None:
    (here / SCHEMA).write_text("{}")
    assert snooker("init", "decay").code == 0
    assert "properties" in json.loads((here / SCHEMA).read_text())


def test_a_file_is_never_overwritten(here: Path, snooker: Snooker) -> None:
    before = (here / "small.yaml").read_text()
    ended = snooker("init", "decay", "--out", "small.yaml")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith("snooker: small.yaml: ")
    assert (here / "small.yaml").read_text() == before
    assert list(here.iterdir()) == [here / "small.yaml"]


def test_stdout_is_the_template_and_nothing_else(here: Path, snooker: Snooker) -> None:
    ended = snooker("init", "exact", "--out", str(STDOUT))
    assert ended.code == 0
    assert ended.out == templates()["exact"].read_text(encoding="utf-8")
    assert list(here.iterdir()) == [here / "small.yaml"]


def test_validate_finds_the_scene_that_cannot_exist(here: Path, snooker: Snooker) -> None:
    ended = snooker("validate", "small.yaml", "-o", "balls.radius=1.0,3.0")
    assert ended.code == 3
    assert ended.out == ""
    assert "balls.radius: " in ended.err
    assert "cor=0.85, balls.radius=3.0" in ended.err
    (here / "tight.yaml").write_text((here / "small.yaml").read_text().replace("1.0, s", "3.0, s"))
    ended = snooker("run", "tight.yaml")
    assert ended.code == 3
    assert ended.err.startswith("snooker: tight.yaml:2:27: balls.radius: ")
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


def test_repeats_of_given_balls_are_refused_at_their_line(here: Path, snooker: Snooker) -> None:
    (here / "list.yaml").write_text(
        "container: {radius: 10.0}\n"
        "balls: {list: [{position: [0, 0], velocity: [1, 0], radius: 1}]}\n"
        "cor: 1\ncollisions: 10\nrepeats: 2\n"
    )
    for command in ("validate", "run"):
        ended = snooker(command, "list.yaml")
        assert (ended.code, ended.out) == (3, "")
        assert ended.err.startswith("snooker: list.yaml:5:10: repeats: ")
        overridden = snooker(command, "list.yaml", "-o", "repeats=3")
        assert overridden.err.startswith("snooker: -o repeats=3: repeats: ")
    assert not (here / "runs").exists()
    assert snooker("validate", "list.yaml", "-o", "repeats=1").code == 0


def text_of(case: dict[str, Any]) -> str:
    """The config of a case of the table; see its head."""
    if "text" in case:
        return str(case["text"])
    lines = dict(enumerate(TABLE["base"].splitlines(), start=1)) | case.get("line", {})
    text = "".join(f"{lines[number]}\n" for number in sorted(lines))
    return text.replace("{zeros}", "0" * 300).replace("{nines}", "9" * 5000)


@pytest.mark.parametrize("name", TABLE["cases"])
def test_bad_configs_are_refused_with_position(
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
    assert list(tmp_path.iterdir()) == [tmp_path / "bad.yaml"]
