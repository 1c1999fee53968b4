"""What the reproduction says about certain events: snooker_cli/reproduction/measured/certain.json.

``python tests/make_certain.py`` makes the file anew, in some minutes. It has the certain events of
the first repeats of the configs of the reproduction. It also has averages from the given starts,
and from starts that differ by one rounding. Chaos separates the trajectories of these.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import snooker_cli
from snooker_cli.config import load
from snooker_cli.config.template_configs import EXAMPLES
from snooker_cli.engine import ENGINE_VERSION, simulate
from snooker_cli.formatting import plain
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.reproduction.reproduce import RUNS
from snooker_cli.scene import Scene
from snooker_cli.validation.accuracy_study import averages
from snooker_cli.validation.methods import Method, Trajectory
from snooker_cli.validation.proof import prove
from snooker_cli.validation.study import PLANS

FILE = Path(snooker_cli.__file__).parent / "reproduction" / "measured" / "certain.json"
MOST = 10_000  # events of a repeat
AVERAGED = "report", "dilute"  # scenes of plans.yaml, elastic
TIME, REPEATS = 20.0, 128
HEATED = "steady", "profiles"  # their walls have a temperature, so there is no twin


def proofs(name: str) -> dict[str, Any]:
    """How many events are certain in the first repeats of the points of a config.

    ``events`` is the most that were compared; ``certain`` has the least and the largest number; the
    others are numbers of points with these verdicts.
    """
    records = []
    for point in load(EXAMPLES / f"{name}.yaml").points():
        limits = point.config
        most = min(limits.collisions or MOST, MOST)
        trace = simulate(starting_scene(limits, 0), collisions=most, time=limits.time)
        records.append(prove(trace, most))
    certain = [record["certain"] for record in records]
    verdicts = [record["verdict"] for record in records]
    return {
        "config": name,
        "points": len(records),
        "events": max(record["compared"] for record in records),
        "certain": [min(certain), max(certain)],
        **{verdict: verdicts.count(verdict) for verdict in ("all", "undecided", "wrong")},
        "whole": {*verdicts} == {"all"},
    }


def from_starts(name: str, *, nudged: bool) -> Method:
    """A method without positions and overlaps, which averages do not need.

    nudged : whether the last ball's x is one rounding larger than in the start (the first is at 0)
    """

    def run(scene: Scene, moments: NDArray[np.float64]) -> Trajectory:
        if nudged:
            positions = scene.positions.copy()
            positions[-1, 0] = np.nextafter(positions[-1, 0], np.inf)
            scene = replace(scene, positions=positions)
        trace = simulate(scene, time=float(moments[-1]))
        return Trajectory(scene, trace.events, np.empty(0), trace.finish, 0.0, 0.0)

    return Method(name, None, run)


def main() -> None:
    """Write the file."""
    scenes = [scene for scene in PLANS["scenes"] if scene["name"] in AVERAGED]
    starts = from_starts("as given", nudged=False), from_starts("nudged", nudged=True)
    record = {
        "measurement": "certain",
        "snooker": snooker_cli.__version__,
        "engine_version": ENGINE_VERSION,
        "rounding": [row for scene in scenes for row in averages(scene, starts, TIME, REPEATS)],
        "proofs": [proofs(name) for name in RUNS if name not in HEATED],
    }
    FILE.write_text(json.dumps(plain(record), ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
