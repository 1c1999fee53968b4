"""Runs that start from a state of another: the state, its digest, and that the source may go."""

from __future__ import annotations

import csv
import io
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Snooker

import snooker_cli
import snooker_cli as snooker
from snooker_cli.config import Config, Start, digest, to_json
from snooker_cli.errors import SnookerError
from snooker_cli.runs.starting_state import load, state_of

# Two balls overlap by 2e-14 m at the time of this collision, as it is stored.
TOUCHING = """
container: {shape: box, width: 40.0}
balls:
  list:
    - {position: [11.8, 2.3], velocity: [8.5, 1.4], radius: 1.0}
    - {position: [9.9, 6.0], velocity: [6.6, -8.2], radius: 1.0}
cor: 1
collisions: 100
"""
AT = 16.08000407750115

FREE = {
    "container": {"radius": 10.0, "mass": 20.0},
    "balls": {"rings": 2, "radius": 1.0, "speed": 10.0},
    "cor": 1.0,
    "collisions": 500,
}
PERIODIC = {
    "container": {"shape": "periodic", "packing": 0.3},
    "balls": [
        {"count": 30, "radius": 1.0, "speed": 10.0},
        {"count": 30, "radius": 0.5, "mass": 0.25, "speed": 10.0},
    ],
    "cor": 0.9,
    "collisions": 500,
    "repeats": 2,
}


def done(config: Any, out: str, **overrides: Any) -> snooker.Run:
    return snooker_cli.run(config, overrides, out=f"runs/{out}", progress=False)


def of_state(config: Any, *overrides: str) -> Config:
    """The experiment of a config that starts from a state."""
    return load(config, overrides).config


def test_an_exported_state_is_a_start(here: Path, snooker: Snooker) -> None:
    """The table of `export --states`, as a list of balls, although two of them overlap."""
    Path("source.yaml").write_text(TOUCHING)
    assert snooker("run", "source.yaml").code == 0
    table = snooker("export", "source", "--states", "--times", str(AT)).out
    balls = [
        {
            "position": [float(row["x"]), float(row["y"])],
            "velocity": [float(row["u"]), float(row["v"])],
            "radius": 1.0,
        }
        for row in csv.DictReader(io.StringIO(table))
        if row["ball"] != "-1"
    ]
    places = np.array([ball["position"] for ball in balls])
    assert np.hypot(*(places[0] - places[1])) < 2.0
    again = {"container": {"shape": "box", "width": 40.0}, "balls": {"list": balls}, "cor": 1.0}
    Path("list.yaml").write_text(json.dumps(again | {"collisions": 10}))
    assert snooker("run", "list.yaml").code == 0
    Path("start.yaml").write_text(f"start: {{run: source, time: {AT}}}\ncor: 1\ncollisions: 10\n")
    assert snooker("run", "start.yaml").code == 0
    shown = [snooker("show", name, "--hash", "--json").out for name in ("list", "start")]
    assert shown[0] == shown[1]


ROUGH = FREE | {"tangential_cor": 0.5, "inertia": 1.0}


@pytest.mark.parametrize(
    ("config", "part"), [(FREE, 0.5), (PERIODIC, 0.5), (PERIODIC, None), (ROUGH, 0.5)]
)
def test_the_state_is_that_of_the_repeat(config: Any, part: float | None, here: Path) -> None:
    """Also of a container that moves, seen from its centre, and in a periodic box."""
    repeat = done(config, "source")[0, 0]
    time = repeat.stop.time if part is None else part * repeat.stop.time
    start = {"run": "source"} | ({} if part is None else {"time": time})
    laws = {key: value for key, value in config.items() if key in ("tangential_cor", "inertia")}
    again = done({"start": start, "cor": 0.8, "collisions": 50, **laws}, "again")[0, 0]
    scene, state = again.scene, repeat.state(time)
    offsets = state.positions - state.container_position
    assert np.array_equal(scene.positions, scene.container.nearest_image(offsets))
    assert np.array_equal(scene.velocities, state.velocities)
    assert np.array_equal(scene.container_velocity, state.container_velocity)
    assert (scene.spins is not None) == (config is ROUGH)
    assert np.array_equal(scene.spins, state.spins)
    assert np.array_equal(scene.radii, state.radii)
    assert np.array_equal(scene.masses, state.masses)
    assert scene.container == state.container
    assert scene.container_mass == state.container_mass
    assert (scene.restitution, again.trace.collisions) == (0.8, 50)


def test_smooth_balls_do_not_start_from_a_state_with_spins(here: Path, snooker: Snooker) -> None:
    """One sentence, not one for each ball."""
    done(ROUGH | {"collisions": 9}, "source")
    Path("again.yaml").write_text("start: {run: source}\ncor: 0.9\ncollisions: 9\n")
    ended = snooker("run", "again.yaml")
    advice = "the balls of this state spin; give tangential_cor (-1 to 1) too"
    assert (ended.code, ended.err) == (3, f"snooker: again.yaml:1:1: start: {advice}\n")
    assert snooker("run", "again.yaml", "-o", "tangential_cor=-1").code == 0


@pytest.mark.skipif(sys.platform == "win32", reason="it takes longer names")
def test_a_name_that_no_file_can_have_is_an_error_of_the_config(
    here: Path, snooker: Snooker
) -> None:
    name = 900 * "a"
    Path("long.yaml").write_text(f"cor: 0.9\nstart: {{run: {name}}}\ncollisions: 9\n")
    ended = snooker("validate", "long.yaml")
    reason = f"start.run: {name}: File name too long; check the name and its permissions"
    assert (ended.code, ended.err) == (3, f"snooker: long.yaml:2:14: {reason}\n")


def test_a_run_that_has_begun_does_not_need_its_source(here: Path, snooker: Snooker) -> None:
    source = done(PERIODIC, "source")
    Path("again.yaml").write_text("start: {run: source, repeat: 1}\ncor: 0.9\ncollisions: 80\n")
    assert snooker("run", "again.yaml").code == 0
    shutil.rmtree(source.directory)
    for command in ("show again", "fit again", "compare again", "verify again --replay"):
        assert snooker(*command.split()).code == 0
    ended = snooker("run", "again.yaml", "-o", "collisions=90")
    assert ended.code == 3
    assert ended.err.startswith("snooker: again.yaml:1:14: start.run: source: there is no run here")


def test_the_digest_is_that_of_the_state(here: Path) -> None:
    """Not of the name or the place of the source; another source is another run."""
    config = {"start": {"run": "source"}, "cor": 0.9, "collisions": 80}
    source = done(PERIODIC, "source")
    first = of_state(config)
    shutil.copytree(source.directory, "runs/copy")
    assert digest(of_state(config, "start.run=copy")) == digest(first)
    time = source[0, 0].stop.time / 2
    changed = of_state(config, "start.repeat=1"), of_state(config, f"start.time={time}")
    snooker_cli.run({**PERIODIC, "seed": 2}, out="runs/source", fresh=True, progress=False)
    other = of_state(config)
    assert len({digest(one) for one in (first, *changed, other)}) == 4
    assert first.start is not None
    assert other.start is not None
    assert other.start.content != first.start.content
    # What is stored is read back without the source.
    shutil.rmtree("runs/source")
    assert of_state(json.loads(to_json(first))) == first


def test_a_container_that_is_given_replaces_that_of_the_run(here: Path) -> None:
    """Its keys one by one; another shape needs all of them."""
    done(FREE, "source")
    config = {"start": {"run": "source"}, "cor": 1.0, "collisions": 10}
    velocity = of_state(config).container.velocity
    assert velocity not in (None, (0.0, 0.0))
    wide = of_state(config | {"container": {"radius": 20.0}}).container
    assert (wide.radius, wide.mass, wide.velocity) == (20.0, 20.0, velocity)
    box = of_state(config | {"container": {"shape": "box", "width": 30.0}}).container
    assert (box.shape, box.width, box.mass, box.velocity) == ("box", 30.0, float("inf"), None)
    with pytest.raises(SnookerError, match=r"container\.width: the key is missing"):
        of_state(config | {"container": {"shape": "box"}})


def test_repeats_differ_by_the_random_numbers_of_walls(here: Path) -> None:
    done(FREE | {"container": {"radius": 10.0}}, "source")
    config = {"start": {"run": "source"}, "cor": 0.9, "collisions": 20, "repeats": 2}

    first, second = done(config | {"wall_temperature": 20.0}, "again")
    assert np.array_equal(first.scene.velocities, second.scene.velocities)
    assert not np.array_equal(first.events.impulse, second.events.impulse)


def test_a_summary_has_its_ends(here: Path) -> None:
    repeat = done(FREE | {"record": "summary", "collisions": 2000}, "source")[0, 0]
    end = repeat.stop.time
    for time in (None, end):
        balls = state_of(Start(run="source", time=time))["balls"]["list"]
        assert balls[0]["velocity"] == repeat.trace.finish.velocities[0].tolist()
    assert state_of(Start(run="source", time=0.0))["container"]["velocity"] == [0.0, 0.0]
    with pytest.raises(SnookerError, match="the nearest stored state is at 0"):
        state_of(Start(run="source", time=end / 2))
