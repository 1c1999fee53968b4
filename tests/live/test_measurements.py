"""Measurements of the live page: theory as theory.py, results as `snooker fit` and `compare`."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_scripts import LiveScripts

import snooker_cli as snooker
from snooker_cli import config as configs
from snooker_cli.engine.page_kernels import SEARCHES
from snooker_cli.live_page.page import presets, stored_start
from snooker_cli.placement.starting_scene import starting_scene

COMPARED = """((row) => {
  const of = (key) => Object.values(THEORIES[key])
    .map((theory) => [theory.model, valueAtRow(theory, row)]);
  const keys = ["pressure", "ratio", "alpha"];
  return [row, Object.fromEntries(keys.map((key) => [key, Object.fromEntries(of(key))]))];
})"""

MEASURE = """(() => {
  const measured = (scene) => measureScene(storedScene(scene), config);
  return tableRow(config, scenes.map(measured), storedScene(scenes[0]));
})()"""

CASES: dict[str, dict[str, Any]] = {
    "report": {"cor": 0.8},  # some repeats end in a wall trap
    "ideal": {"collisions": 4300},  # some have fewer collisions than the relaxation needs
    "periodic": {
        "container": {"shape": "periodic"},
        "balls": {"count": 50, "packing": 0.2, "radius": 1.0, "speed": 2.0},
        "cor": 0.9,
        "collisions": 2000,
    },
}


@pytest.mark.parametrize("name", CASES)
def test_a_measurement_is_that_of_the_program(
    name: str, javascript: LiveScripts, tmp_path: Path
) -> None:
    """From the same starts.

    T, P and PV/NT are sums over the same collisions: they differ by rounding. Python fits means of
    255 groups of collisions, the page all of them. The largest group has 2/255 of the collisions.
    Where ln E falls by d in it, its mean is d²/24 above the law; a rate changes by less than twice.
    """
    known = {scene["name"]: scene["config"] for scene in presets()}
    config, starts = known.get(name, {}) | CASES[name], 5
    config |= {"repeats": starts}
    valid_config = configs.load(config).config
    complete = json.loads(configs.to_json(valid_config))
    given = {
        "config": complete,
        "scenes": [stored_start(starting_scene(valid_config, k)) for k in range(starts)],
    }
    row, theories = javascript.value(f"{COMPARED}({MEASURE})", **given)
    run = snooker.run(config, out=tmp_path / "run", progress=False)
    rows = run.compare()
    compared = {found["quantity"]: found for found in rows}
    quantities = {"temperature": "temperature", "pressure": "pressure", "ratio": "PV/NT"}
    for key, quantity in quantities.items():
        assert row[key] == pytest.approx(compared[quantity]["measured"], rel=1e-11)
        if compared[quantity]["error"]:
            assert row[f"{key}Error"] == pytest.approx(
                compared[quantity]["error"], rel=1e-9, abs=1e-11
            )
    fall = float(np.max(-np.log(run.table()["energy_ratio"])))
    allowed = max((2 / 255 * fall) ** 2 / 12, 1e-9)
    fitted = {found["model"]: found for found in run.fit() if found["quantity"] == "kinetic_energy"}
    for key, law in (("k", "exponential"), ("alpha", "haff")):
        value, error = fitted[law]["value"], fitted[law]["error"]
        if value is None:
            assert row[key] is None
        else:
            assert row[key] == pytest.approx(value, rel=allowed)
            assert row[f"{key}Error"] == pytest.approx(error, abs=allowed * value)
    ended = run.table()["ending"]
    assert row["early"] == np.count_nonzero(ended == "wall trap")
    assert row["N"] == run[0, 0].scene.number
    # A theory has the same name and the same value in both.
    quantities["alpha"] = "Haff's α"
    for key, known_theories in theories.items():
        for model, value in known_theories.items():
            predicted = [
                found["predicted"]
                for found in rows
                if (found["quantity"], found["model"]) == (quantities[key], model)
            ]
            assert predicted == ([] if value is None else [pytest.approx(value, rel=1e-9)])


def test_the_running_gas_measures_as_a_repeat_does(javascript: LiveScripts) -> None:
    """The decay constants of its thinned series, and the means over all its time."""
    live, decay, whole, most = javascript.value(
        """(() => {
          const config = configOf("cooling"), { collisions } = config, gas = new Gas(config);
          gas.advance(Infinity, collisions);
          const simulation = new Simulation(startingScene(config, 0), { collisions });
          const meter = new Meter(simulation.scene, simulation), first = meter.sums();
          for (let stop = null; !stop;) {
            stop = simulation.advance(Infinity);
            for (let row = 0; row < simulation.eventCount; row++) meter.follow(row);
          }
          const whole = meter.means(first, meter.sums());
          return [gas.means(), gas.decay(), whole, gas.series.rows.length];
        })()"""
    )
    measured = javascript.value("measureRepeat(configOf('cooling'), 0)")
    assert live == pytest.approx(whole, rel=1e-12)
    assert most <= 2000
    for name in ("k", "alpha"):
        assert decay[name] == pytest.approx(measured[name], rel=0.02)  # other weights of the times


def test_balls_of_one_speed_are_one_bar_that_is_as_high_as_it_says(
    javascript: LiveScripts,
) -> None:
    """The speed over √(2T/m) is 1 but for rounding, at an edge; the axis ends at 100 %."""
    shares, top = javascript.value(
        """(() => {
          const { shares } = new Gas(configOf("report"));
          return [shares, speedsTop(shares)];
        })()"""
    )
    assert shares == [0.0] * 5 + [1.0] + [0.0] * 9
    assert top == 1


@pytest.mark.parametrize(("mass", "digits"), [(1, 3), (1e6, 3141)])
def test_galperins_billiard_counts_digits_of_pi(
    mass: float, digits: int, javascript: LiveScripts
) -> None:
    """Up to its end; then it continues."""
    seen = javascript.value(
        """(() => {
          const config = configOf("galperin");
          config.balls.list[1].mass = mass;
          const gas = new Gas(config);
          gas.advance(Infinity);
          const seen = [gas.collisions, gas.time, gas.stop.reason, gas.continuation];
          gas.continueWith("on");
          gas.advance(21);
          return [...seen, gas.collisions > seen[0], gas.changed];
        })()""",
        mass=mass,
    )
    assert seen == [digits, 15, "time", "on", True, True]


def test_a_trapped_ball_slides_on(javascript: LiveScripts) -> None:
    """It keeps the energy that the trap leaves it, of its motion along the wall, at r = 9 m."""
    reason, way, before, after, changed, time, distance, parts = javascript.value(
        """(() => {
          const gas = new Gas(configOf("trap"));
          gas.advance(Infinity);
          const { reason } = gas.stop, way = gas.continuation, { scene } = gas;
          const [x, y] = gas.place(0, gas.time), [u, v] = gas.simulation.velocityOf(0);
          const along = (x * v - y * u) ** 2 / (x * x + y * y) / 2 * scene.masses[0];
          gas.tag(0);
          gas.continueWith(way);
          for (let t = 50; t <= 60; t += 1) {
            gas.advance(t);
            gas.followSlide();
          }
          const distance = Math.hypot(...gas.place(0, gas.time)), parts = gas.course.slice(-60);
          return [reason, way, along, gas.meter.energy, gas.changed, gas.time, distance, parts];
        })()"""
    )
    assert (reason, way, changed, time) == ("wall_trap", "slide", True, 60)
    assert distance == pytest.approx(9.0, rel=1e-12)
    # Its path is along the wall, in parts of less than a tenth of a radian.
    assert {*range(55, 61)} <= {part[0] for part in parts}
    assert np.hypot(*np.array(parts)[:, 1:3].T) == pytest.approx(9.0, rel=1e-12)
    turns = np.diff(np.unwrap([math.atan2(y, x) for _, x, y, *_ in parts]))
    assert np.max(np.abs(turns)) < 0.1
    assert after == pytest.approx(before, rel=1e-9)


def test_a_slider_changes_the_laws_from_then_on(javascript: LiveScripts) -> None:
    energies = javascript.value(
        """(() => {
          const gas = new Gas(configOf("report")), energies = [];
          gas.advance(Infinity, 100);
          gas.setLaws({ ...gas.config, cor: 1, wall_cor: 1 });
          energies.push(gas.meter.totalEnergy);
          gas.advance(Infinity, 300);
          return [...energies, gas.meter.totalEnergy, gas.changed];
        })()"""
    )
    before, after, changed = energies
    assert changed
    assert after == pytest.approx(before, rel=1e-12)


def test_a_gas_whose_next_collision_is_far_ahead_can_wait(javascript: LiveScripts) -> None:
    """Two fast balls in a periodic box meet after 10⁹ s: a call ends at a time before.

    A search of a ball looks ahead 1.15 s: then it has gone half of the box, less a diameter.
    """
    balls = [
        {"position": [0.0, y], "velocity": [1.0, -1e-9 * y], "radius": 0.1} for y in (-1.0, 1.0)
    ]
    config = {
        "container": {"shape": "periodic", "width": 5.0},
        "balls": {"list": balls},
        "cor": 1.0,
        "collisions": 10,
    }
    complete = json.loads(configs.to_json(configs.load(config).config))
    waiting, time, place = javascript.value(
        """(() => {
          const gas = new Gas(config);
          const waiting = [gas.advance(Infinity, 1), gas.collisions, gas.stop], { time } = gas;
          gas.advance(time + 1);
          return [waiting, time, gas.place(0, time)];
        })()""",
        config=complete,
    )
    assert waiting == [False, 0, None]
    assert time == pytest.approx(SEARCHES / 2 * 1.15, rel=1e-3)
    assert place == pytest.approx([(time + 2.5) % 5 - 2.5, -1.0 + 1e-9 * time], abs=1e-8)


def test_between_two_rows_is_what_a_plot_has_across(javascript: LiveScripts) -> None:
    """Whichever column that is: a size, a wall's temperature, a measured value."""
    names = ("r", "R", "cor", "wallTemperature", "leftTemperature", "temperature")
    first, second = ({**dict.fromkeys(names, value), "N": 7, "width": None} for value in (1, 3))
    for row in (first, second):
        row["container"] = {"shape": "circle", "size": [2 * row["R"]] * 2}
    row = javascript.value("between(first, second, 0.25)", first=first, second=second)
    assert [row[name] for name in names] == [1.5] * len(names)
    assert (row["N"], row["width"], row["container"]["size"]) == (7, None, [3, 3])


def test_a_gas_ends_before_its_numbers(javascript: LiveScripts) -> None:
    """A cooling gas that runs on loses all its energy; its time and its energy stay numbers."""
    config = {
        "container": {"shape": "box", "width": 20.0},
        "balls": {"count": 10, "radius": 0.5, "speed": 10.0},
        "cor": 0.5,
        "wall_cor": 1.0,
        "collapse": {"tc": 1e-9},
        "collisions": 10,
    }
    complete = json.loads(configs.to_json(configs.load(config).config))
    message, reason, way, time, energy = javascript.value(
        """(() => {
          const gas = new Gas(config);
          while (!gas.stop) gas.advance(Infinity, 10000);
          return [gas.stop.message, gas.stop.reason, gas.continuation, gas.time, gas.meter.energy];
        })()""",
        config=complete,
    )
    assert message.startswith("the gas has lost all but 1e-200 of its energy, after ")
    assert (reason, way) == (None, None)
    assert 0 < energy < 1e-190
    assert 1e90 < time < 1e110


def test_a_path_keeps_its_latest_parts(javascript: LiveScripts) -> None:
    length, ordered = javascript.value(
        """(() => {
          const gas = new Gas(configOf("brownian"));
          gas.tag(0);
          gas.advance(Infinity, 250000);
          const { course } = gas;
          return [course.length, course.every(([time], k) => k === 0 || time >= course[k - 1][0])];
        })()"""
    )
    assert 3000 <= length <= 6000
    assert ordered


MOMENTS = """(() => {
  const seen = (gas) => {
    const { meter, simulation, collisions, time, shares, contacts } = gas;
    const { energy, pairVirial } = meter;
    const places = Array.from(gas.radii, (_, ball) => gas.place(ball, time));
    return { collisions, time, shares, contacts, energy, pairVirial, places,
      momentum: simulation.momentum(), path: gas.course.filter(([at]) => at <= time) };
  };
  const run = (collisions) => {
    const gas = new Gas(configOf(scene));
    gas.tag(1);
    gas.goTo(collisions);
    return gas;
  };
  const gas = run(70000);
  const moments = order.map((collisions) => {
    gas.goTo(collisions);
    return seen(gas);
  });
  const { count } = gas.simulation.hash;
  return [moments, order.map((collisions) => seen(run(collisions))), gas.kept.length, count];
})()"""


@pytest.mark.parametrize("scene", ["heated", "galperin"])
def test_a_gas_goes_to_any_moment(scene: str, javascript: LiveScripts) -> None:
    """It has the bits of a gas that has gone there at once, and the path, too."""
    order = [5000, 1, 0, 69999, 70000, 20, 2500] if scene != "galperin" else [31, 1, 0, 30, 31]
    moments, known, kept, hashed = javascript.value(MOMENTS, scene=scene, order=order)
    for seen, there in zip(moments, known, strict=True):
        # The energy of a call's events adds up; calls may be others.
        assert seen.pop("energy") == pytest.approx(there.pop("energy"), rel=1e-13)
        assert seen == there
    assert kept <= 64
    assert hashed >= max(order)


def test_a_path_begins_before_the_click(javascript: LiveScripts) -> None:
    """At a moment that is kept; a law that changed forgets those before."""
    early, late, changed = javascript.value(
        """(() => {
          const gas = new Gas(configOf("crowded")), begin = () => (gas.tag(3), gas.course[0][0]);
          gas.advance(Infinity, 3000);
          const early = [begin(), gas.collisions];
          gas.advance(Infinity, 60000);
          const late = [begin(), gas.collisions], { time } = gas;
          gas.setLaws({ ...gas.config, cor: 1 });
          return [early, late, [begin(), gas.collisions, time]];
        })()"""
    )
    assert early == [0, 3000]
    assert late[0] > 0
    assert late[1] == changed[1] == 63000
    assert changed[0] == pytest.approx(changed[2])
