"""``snooker init``: templates that are valid, explained key by key, and do what they say."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from snooker_cli.cli.config_commands import SCHEMA, STDOUT, purpose, templates
from snooker_cli.config import digest, load
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

Snooker = Callable[..., Any]


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
def test_what_a_template_tells_to_do_is_about_itself(name: str, snooker: Snooker) -> None:
    text = templates()[name].read_text(encoding="utf-8")
    commands = re.findall(r"^#   snooker (\w+) (\S+)", text, flags=re.MULTILINE)
    assert commands[0] == ("run", f"{name}.yaml")
    for command, about in commands:
        assert about == (f"{name}.yaml" if command == "run" else name)
        assert snooker(command, "--help").code == 0


def test_the_report_is_the_reports_scene(here: Path, snooker: Snooker) -> None:
    snooker("init", "report")
    ours, theirs = load("report.yaml").experiment, load(CONFIGS / "decay.yaml").experiment
    assert digest(ours) == digest(theirs)
    assert (ours.sweep, ours.repeats) == (theirs.sweep, theirs.repeats)


def test_the_collisions_of_exact_are_the_digits_of_pi(here: Path, snooker: Snooker) -> None:
    snooker("init", "exact")
    assert snooker("run", "exact.yaml", "--no-progress").code == 0
    run = open_run("exact")
    traces = [trace for point in run.points for trace in run.traces(point)]
    assert [trace.collisions for trace in traces] == [3, 31, 314, 3141]
    assert {trace.stop.reason for trace in traces} == {StopReason.TIME}


def test_the_pressure_told_of_dense_is_the_published_one() -> None:
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


def test_an_unknown_template_gets_the_nearest_name(here: Path, snooker: Snooker) -> None:
    ended = snooker("init", "decey")
    assert (ended.code, ended.out) == (2, "")
    assert "there is no template decey; the nearest is decay" in ended.err
