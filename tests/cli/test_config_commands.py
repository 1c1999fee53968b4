"""``snooker init``: every template runs, explains its keys and names the right commands."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import Snooker

from snooker_cli.config import digest, load
from snooker_cli.config.template_configs import SCHEMA, SCHEMA_FILE, templates
from snooker_cli.runs import open_run
from snooker_cli.theory import published_ratio

CONFIGS = Path(__file__).parents[2] / "configs"

SHORT = {
    "report": ("collisions=50", "repeats=1"),
    "haff": ("collisions=200", "repeats=2"),
    "sweep": ("collisions=50", "repeats=1", "cor=0.8", "balls.radius=0.4,0.8"),
    "exact": ("balls.list[1].mass=1.0,1e2,1e4,1e6",),
    "dense": ("collisions=500", "repeats=1"),
    "brownian": ("time=1", "repeats=1"),
    "rough": ("collisions=50", "repeats=1"),
    "driven": ("collisions=50", "repeats=1", "cor=0.9", "balls.radius=0.2,0.4"),
    "heat": ("time=1", "repeats=1"),
    "granular-heat": ("collisions=50", "repeats=1"),
}
"""What makes a template end in a moment."""


@pytest.mark.parametrize("name", templates())
def test_a_template_runs_and_its_commands_have_the_name_of_the_file(
    name: str, here: Path, snooker: Snooker
) -> None:
    (here / SCHEMA).write_text("an older schema")
    assert snooker("init", name, "--out", "my-gas.yaml").code == 0
    assert (here / SCHEMA).read_text() == SCHEMA_FILE.read_text()
    short = [f"--override={override}" for override in SHORT[name]]
    ended = snooker("run", "my-gas.yaml", *short, "--no-progress")
    assert ended.code == 0, ended.err
    run = open_run("my-gas")
    traces = [trace for point in run.points for trace in run.traces(point)]
    assert all(trace.stop.reason.complete for trace in traces)
    text = Path("my-gas.yaml").read_text(encoding="utf-8")
    commands = re.findall(r"^#   snooker (\w+) (\S+)", text, flags=re.MULTILINE)
    assert commands[0] == ("run", "my-gas.yaml")
    for command, about in commands:
        assert about == ("my-gas.yaml" if command == "run" else "my-gas")
        assert snooker(command, "--help").code == 0
    if name == "exact":  # digits of π
        assert [trace.collisions for trace in traces] == [3, 31, 314, 3141]


@pytest.mark.parametrize("name", templates())
def test_every_key_is_explained(name: str) -> None:
    lines = templates()[name].read_text(encoding="utf-8").splitlines()
    assert lines[0] == f"# yaml-language-server: $schema={SCHEMA}"
    keys = [line for line in lines if re.match(r"(# |) *(- )?[a-z_.]+(\[\d\]\S*)?:( |$)", line)]
    assert len(keys) > 10
    assert [line for line in keys if "  # " not in line] == []
    assert max(map(len, lines)) <= 100


def test_the_template_report_is_configs_decay(here: Path, snooker: Snooker) -> None:
    snooker("init", "report")
    ours, theirs = load("report.yaml").config, load(CONFIGS / "decay.yaml").config
    assert digest(ours) == digest(theirs)
    assert (ours.sweep, ours.repeats) == (theirs.sweep, theirs.repeats)


def test_the_pressure_in_dense_is_the_published_one() -> None:
    published = published_ratio(0.7)
    assert published is not None
    text = templates()["dense"].read_text(encoding="utf-8")
    assert f"of the literature, {published.ratio:.2f}," in text


def test_templates_count_the_collisions_of_each_ball() -> None:
    """Without walls each collision is of two balls."""
    said = {}
    for name, path in templates().items():
        if found := re.search(r"collisions: .* here after (\d+) per ball", path.read_text("utf-8")):
            config = load(path).config
            assert not config.container.shape_class.has_wall
            of_each = 2 * config.collisions / config.number
            assert float(found[1]) == of_each
            said[name] = of_each
    assert said.keys() >= {"dense", "haff", "rough"}


def test_a_terminal_shows_how_far_a_check_is(here: Path) -> None:
    """Many points, or many balls at random places, take a while."""
    read, write = pty.openpty()
    command = [sys.executable, "-m", "snooker_cli", "validate", "small.yaml"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=write, check=True, text=True)
    assert "placing balls: scene 1 of 1" in os.read(read, 100_000).decode()
    assert done.stdout.startswith("small.yaml: valid; ")
