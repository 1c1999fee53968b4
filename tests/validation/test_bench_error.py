"""Other ways to simulate, what sets them apart from the truth, and ``snooker bench error``."""

import json
import math
import subprocess
import sys
from dataclasses import replace

import make_reference
import numpy as np
import pytest
from scenes import EPSILON, scene_of

from snooker_cli.containers import Circle
from snooker_cli.figures import Line, Points
from snooker_cli.figures.drawing import to_json
from snooker_cli.validation import methods
from snooker_cli.validation.accuracy_study import (
    RepeatBias,
    averages,
    ledger,
    pictures,
    quantities,
    study,
)
from snooker_cli.validation.exact_twin import first_different, rms_distance
from snooker_cli.validation.methods import (
    TOLERANCE,
    all_methods,
    by_engine,
    by_report,
    by_steps,
    deepest_overlap,
)
from snooker_cli.validation.reference_scenes import Case, mixture, rings

WAYS = all_methods((1e-3, 1e-4))


@pytest.fixture(params=WAYS, ids=lambda way: way.name)
def way(request):
    return request.param


def seven(repeat=0):
    """Seven balls in a light container, not quite elastic."""
    return rings(repeat, number=1, restitution=0.9, container_mass=20.0)


# --- the methods ------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [mixture, seven, lambda: rings(number=1, container_mass=math.inf)])
def test_every_method_keeps_the_books(way, make):
    """What is exchanged is exchanged by all of them: that says nothing of the trajectory."""
    course = way.run(make(), np.array([0.5, 1.0]))
    books = ledger(course)
    assert len(course.events) > 5
    # Each event and each step rounds by an epsilon of what a ball has, to either side.
    rounding = (len(course.events) + (1 / way.step if way.step else 0)) * 4 * EPSILON
    assert books.energy < rounding
    assert books.angular_momentum < rounding
    assert (books.momentum is None) == (not course.start.free)
    assert books.momentum is None or books.momentum < rounding


def test_methods_find_a_head_on_collision(way):
    """At 1 s, with (1 + e) mu g = 1.8 * 0.75 * 2; by steps, up to a step late."""
    balls = [(-2.0, 0.0, 2.0, 0.0, 0.5, 1.0), (1.0, 0.0, 0.0, 0.0, 0.5, 3.0)]
    course = way.run(scene_of(balls, restitution=0.8), np.array([0.0, 0.5, 1.5]))
    late = course.events.time[0] - 1.0
    # Places up to 2 m are rounded by half an epsilon of that in each of 1.5 s / step additions.
    rounding = 1.5 / way.step * EPSILON if way.step else 4 * EPSILON
    # A step that ends in the contact, by the rounding of places at 2 m/s, may miss it.
    assert -rounding <= late <= (way.step or 0.0) + rounding
    assert (course.events.i[0], course.events.j[0]) == (0, 1)
    assert course.events.impulse.tolist() == [pytest.approx(2.7, rel=4 * EPSILON)]
    assert course.positions[0].tolist() == [[-2.0, 0.0], [1.0, 0.0]]
    assert course.positions[1, 0] == pytest.approx([-1.0, 0.0], abs=rounding)
    assert course.finish.velocities[:, 0] == pytest.approx([-0.7, 0.9], rel=4 * EPSILON)
    # Too far by what the changed speed makes of the delay.
    assert course.positions[2, 0, 0] == pytest.approx(-0.35 + 2.7 * late, abs=4 * rounding)
    assert course.overlap <= 2.0 * late + 4 * rounding


def test_the_reports_tolerance_drops_a_collision():
    """Two collisions of its own scene are 0.55 us apart: it loses the later one."""
    reference = make_reference.read("report")
    time = reference.events.time
    dropped = int(np.argmax(np.diff(time) < TOLERANCE)) + 1
    assert dropped < 200
    before = by_report(reference.scene, time[: dropped - 1])
    after = by_report(reference.scene, time[: dropped + 50])
    assert first_different(after.events, reference.events) == dropped
    assert before.overlap < 1e-13
    assert after.overlap > 0.1  # of balls of 1 m
    engine = by_engine(reference.scene, time[: dropped + 50])
    assert first_different(engine.events, reference.events) >= dropped + 49
    assert engine.overlap < 1e-13


def test_time_steps_are_of_the_first_order():
    """The error after a few events is as long as the way of a few steps."""
    reference = make_reference.read("report")
    moments = reference.events.time[: reference.after[0]]
    truth = reference.states[:1, :-1, :2]
    for step in (1e-4, 1e-5):
        course = by_steps(reference.scene, moments[:10], step)
        exact = by_engine(reference.scene, moments[:10])  # right to 1e-15 there
        error = rms_distance(course.positions, exact.positions)[-1]
        assert 0.1 * 10.0 * step < error < 10 * 10.0 * step
    engine = by_engine(reference.scene, moments)
    assert rms_distance(engine.positions[-1:], truth)[0] < 1e-13


@pytest.mark.parametrize(("constant", "value"), [("SKIN", 100.0), ("SKIN", 1e-6), ("ROOM", 1)])
def test_time_steps_do_not_depend_on_their_bookkeeping(constant, value, monkeypatch):
    """All pairs in the list, a list in each step, and a return after each event."""
    moments = np.array([0.1, 0.5, 2.0])
    before = methods.stepped(mixture(), 1e-3, moments)
    monkeypatch.setattr(methods, constant, value)
    after = methods.stepped(mixture(), 1e-3, moments)
    for column in ("time", "i", "j", "impulse"):
        assert np.array_equal(getattr(before[0], column), getattr(after[0], column))
    assert np.array_equal(before[1], after[1])
    assert before[2] == after[2] > 0


def test_deepest_overlap():
    balls = [(0.0, 0.0, 0.0, 0.0, 1.0, 1.0), (1.9, 0.0, 0.0, 0.0, 1.0, 1.0)]
    scene = scene_of(balls, container=Circle(4.0))
    apart = np.array([[[0.0, 0.0], [2.5, 0.0]]])
    over = np.array([[[0.0, 0.0], [1.9, 0.0]]])
    out = np.array([[[0.0, 0.0], [3.3, 0.0]]])
    centre = np.zeros((1, 2))
    assert deepest_overlap(scene, apart, centre) == 0.0
    assert deepest_overlap(scene, over, centre) == pytest.approx(0.1)
    assert deepest_overlap(scene, np.concatenate([over, out]), np.zeros((2, 2))) == pytest.approx(
        0.3
    )
    assert deepest_overlap(scene, out, np.array([[0.2, 0.0]])) == pytest.approx(0.1)


# --- averages and horizons --------------------------------------------------------------------


def test_averages_are_set_against_the_first_method():
    ensemble = RepeatBias("seven", "seven balls", 1.0, seven)
    first, other = averages(ensemble, (WAYS[0], WAYS[2]), 5)
    courses = [by_engine(seven(repeat), np.array([1.0])) for repeat in range(5)]
    values = [quantities(course, 1.0) for course in courses]
    assert [bias.quantity for bias in first.biases] == list(values[0])
    for bias in first.biases:
        column = np.array([value[bias.quantity] for value in values])
        assert bias.mean == pytest.approx(np.mean(column), rel=1e-14)
        assert bias.error == pytest.approx(np.std(column, ddof=1) / math.sqrt(5), rel=1e-12)
        assert (bias.difference, bias.difference_error) == (0.0, 0.0)
    assert first.overlapping == 0
    assert other.overlapping == 5
    by_quantity = zip(first.biases, other.biases, strict=True)
    assert all(b.difference == pytest.approx(b.mean - a.mean, abs=1e-12) for a, b in by_quantity)


def test_quantities():
    """One ball between two sides of the wall: every 2a/v an impulse of (1 + e) m v."""
    course = by_engine(scene_of([(0.0, 0.0, 8.0, 0.0, 2.0, 3.0)]), np.array([10.5]))
    found = quantities(course, 10.5)
    assert list(found) == ["pressure, Pa m", "collisions, 1/s"]
    hits = 5  # at 1, 3, 5, 7 and 9 s
    assert found["collisions, 1/s"] == hits / 10.5
    pressure = hits * 2 * 3.0 * 8.0 / (2 * math.pi * 10.0 * 10.5)
    assert found["pressure, Pa m"] == pytest.approx(pressure, rel=1e-14)
    slower = by_engine(
        scene_of([(0.0, 0.0, 8.0, 0.0, 2.0, 3.0)], wall_restitution=0.5), np.array([2.0])
    )
    assert quantities(slower, 2.0)["decay constant, 1/s"] == pytest.approx(math.log(4) / 2)


def test_first_different():
    course = by_engine(seven(), np.array([1.0]))
    events = course.events
    assert first_different(events, events) == len(events)
    changed = replace(events, i=events.i.copy())
    changed.i[7] += 1
    assert first_different(changed, events) == 7


# --- the measurement --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """The folder that the command writes, quickly, and what it says."""
    folder = tmp_path_factory.mktemp("bench") / "measured"
    command = [sys.executable, "-m", "snooker_cli", "bench", "error", "--quick", "--out", folder]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=True)
    return folder, done.stdout


@pytest.fixture(scope="module")
def measurement(measured):
    """As it is saved."""
    return json.loads((measured[0] / "error.json").read_text(encoding="utf-8"))


def test_a_study_knows_the_truth():
    case = Case("seven", "seven balls", 40, seven)
    found = study(case, WAYS)
    assert (found.certain, found.collisions, found.checkpoints[-1]) == (40, 40, 40)
    engine, report, *steps = found.results
    for one in (engine, report):
        assert (one.first_different, one.collisions) == (40, 40)
        assert one.place_errors[0] < 1e-14
    for one in steps:
        assert all(
            ours < theirs
            for ours, theirs in zip(engine.place_errors, one.place_errors, strict=True)
        )
        assert one.first_different < 40
    # A tenth of the step makes a tenth of the error, before chaos.
    third = found.checkpoints.index(5)
    assert steps[1].place_errors[third] < steps[0].place_errors[third]


def test_a_measurement_says_where_and_when(measurement):
    assert measurement["machine"]["processors"] >= 1
    assert set(measurement["versions"]) == {"python", "numpy", "numba", "mpmath"}
    assert measurement["date"].endswith("+00:00")
    (scene,) = measurement["scenes"]
    assert scene["certain"] == scene["collisions"] == 50
    for one in scene["results"]:
        assert one["seconds"] > 0
        assert one["runs"] >= 1
        assert len(one["place_errors"]) == len(scene["checkpoints"])


def test_pictures_come_from_the_saved_measurement(measurement):
    made = dict(pictures(measurement))
    assert list(made) == ["error-against-cost-light-container", "error-growth-light-container"]
    against, growing = made.values()
    results = measurement["scenes"][0]["results"]
    engine, report, _, steps = against.layers
    place = measurement["scenes"][0]["checkpoints"].index(50)
    assert isinstance(engine, Points)
    assert engine.y.tolist() == [results[0]["place_errors"][place]]
    assert report.x.tolist() == [1e6 * results[1]["seconds"] / 50]
    assert steps.y.tolist() == [one["place_errors"][place] for one in results[2:]]
    assert [one["method"] for one in against.numbers["methods"]] == [
        one["method"] for one in results
    ]
    labels = [layer.label for layer in growing.layers if isinstance(layer, Line)]
    assert labels == [results[k]["method"] for k in (0, 1, 2, -1)]
    for picture in made.values():
        json.loads(to_json(picture))


def test_the_engine_is_right_as_far_ahead_as_can_be(measurement):
    """Seven balls: in 80 events no two programs part, by the known exponent 120 are all."""
    (question,) = measurement["horizons"]
    (found,) = question["repeats"]
    assert question["estimate"] == pytest.approx(120, abs=1)
    assert found["certain"] > found["parted"] > 80
    # The exponent is a mean over starts; this start's, over some 80 events, is near it.
    assert found["exponent"] == pytest.approx(question["exponent"], rel=0.3)


# --- the command ------------------------------------------------------------------------------


def test_the_command_prints_and_writes(measured):
    folder, said = measured
    assert "light-container: seven balls of 1 kg" in said
    for name in ("snooker", "the report's algorithm", "time steps of 0.01 s"):
        assert len([line for line in said.splitlines() if line.startswith(f"{name}  ")]) == 2
    assert (folder / "error.txt").read_text(encoding="utf-8") == said
    for name in ("error-against-cost", "error-growth"):
        for ending in ("svg", "png", "json"):
            assert (folder / f"{name}-light-container.{ending}").stat().st_size > 0


def test_without_mpmath_the_command_says_what_to_install(snooker, monkeypatch):
    monkeypatch.setitem(sys.modules, "mpmath", None)
    for name in ("accuracy_study", "exact_twin", "methods"):
        monkeypatch.delitem(sys.modules, f"snooker_cli.validation.{name}", raising=False)
    ended = snooker("bench", "error", "--quick")
    assert ended.code == 2
    assert "pip install 'snooker-cli[reference]'" in ended.err
    assert "Traceback" not in ended.err
