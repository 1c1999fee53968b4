"""Paths that are unwrapped, and diffusion beside Enskog's theory in dilute gases."""

from __future__ import annotations

import math

import numpy as np
import pytest

from snooker_cli.analysis import diffusion
from snooker_cli.analysis.observables import standard_errors
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import Trace


def simulated(container: str, balls: str, time: float, **more: object) -> Trace:
    keys = "".join(f"{key}: {value}\n" for key, value in more.items())
    text = f"container: {{{container}}}\nballs: {balls}\ncor: 1\ntime: {time}\n{keys}"
    return simulate(starting_scene(parse(text, "a.yaml").config, 0), time=time)


ROW = """{list: [{position: [-5, 0], velocity: [3, 0], radius: 0.5},
  {position: [5, 0], velocity: [0, 0], radius: 0.5}]}"""


def test_the_path_of_balls_that_push_each_other_round_a_periodic_box() -> None:
    """Ball 0 flies 9 m, then rests while ball 1 flies 18 m, then flies 18 m, and so on."""
    trace = simulated("shape: periodic, width: 20", ROW, 100.0)
    times = np.linspace(0.0, 100.0, 701)
    flown = 3 * times
    cycle, rest = np.divmod(np.maximum(flown - 9, 0), 36)
    x = -5 + np.minimum(flown, 9) + 18 * cycle + np.maximum(rest - 18, 0)
    places, _ = diffusion.path(trace, 0, times)
    assert places[:, 0] == pytest.approx(x, abs=1e-11)
    assert np.all(places[:, 1] == 0)
    assert x[-1] > 140  # seven boxes


@pytest.mark.parametrize("container", ["shape: periodic, width: 12, height: 9", "radius: 6"])
def test_a_path_is_the_integral_of_the_velocity(container: str) -> None:
    balls = "[{count: 20, radius: 0.5, speed: 5}, {count: 30, radius: 0.2, speed: 5}]"
    trace = simulated(container, balls, 40.0)
    for ball in (0, 25, 49):
        times = np.unique(np.append([0.0, 40.0], diffusion.contact_times(trace, ball)))
        places, velocities = diffusion.path(trace, ball, times)
        flown = np.cumsum(velocities[:-1] * np.diff(times)[:, None], axis=0)
        moved = places[1:] - places[0]
        assert moved == pytest.approx(flown, abs=1e-10)
        few, _ = diffusion.path(trace, ball, times[::7])
        assert few == pytest.approx(places[::7], abs=1e-10)
    assert np.array_equal(places[0], trace.start.positions[ball])


def test_heavy_balls_in_a_dilute_gas_diffuse_with_enskogs_coefficient() -> None:
    """At a packing of about 0.01, where long-time tails are small; errors are over the balls."""
    balls = (
        "[{count: 25, radius: 0.3, mass: 6, speed: 0.4, speeds: maxwell},"
        " {count: 150, radius: 0.1, speed: 1, speeds: maxwell}]"
    )
    trace = simulated("shape: periodic, width: 20", balls, 4000.0, seed=3)
    theory = diffusion.expected(trace.start, 0)
    tau = theory.relaxation_time
    lags = tau * np.array([0.02, 1.0, 5.0, 10.0])
    rows = [diffusion.correlations(trace, [ball], lags) for ball in range(25)]
    squares, products = (np.array(column) for column in zip(*rows, strict=True))
    rises = (squares[:, 3] - squares[:, 2]) / (4 * 5 * tau)
    for measured, known, most in (
        (squares[:, 0] / lags[0] ** 2, theory.mean_square_speed * (1 - 0.02 / 3), 0.03),
        (products[:, 1], theory.mean_square_speed / math.e, 0.06),
        (rises, theory.coefficient, 0.06),
    ):
        error = float(standard_errors(measured))
        assert error < most * known
        assert abs(measured.mean() - known) < 3 * error


def test_velocities_are_measured_after_they_relaxed_and_within_the_repeat() -> None:
    large = "{position: [0, 0], velocity: [0, 0], radius: 1, mass: 10}"
    balls = f"[{large}, {{count: 99, radius: 0.1, speed: 5}}]"
    trace = simulated("shape: periodic, width: 20", balls, 30.0)
    tau = diffusion.expected(trace.start, 0).relaxation_time
    last = 30.0 - diffusion.RELAXING * tau
    diffusion.correlations(trace, [0], np.array([last * 0.999]))
    with pytest.raises(ValueError, match="ends before"):
        diffusion.correlations(trace, [0], np.array([last * 1.001]))
