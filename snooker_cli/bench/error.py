"""Work and precision: what each way to simulate costs, and how wrong it is."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from snooker_cli.bench.catalogue import CASES, Case, rings
from snooker_cli.bench.ensemble import Averages, Ensemble, averages
from snooker_cli.bench.exact import trajectory
from snooker_cli.bench.horizon import (
    Horizon,
    Question,
    first_different,
    horizon,
    rms_distance,
)
from snooker_cli.bench.ledger import Ledger, ledger
from snooker_cli.bench.methods import Method, methods
from snooker_cli.bench.origin import origin
from snooker_cli.gallery import plain
from snooker_cli.scene import Scene

CHECKPOINTS = (1, 2, 5, 10, 20, 50, 100, 150, 200, 300, 500)
"""The events after which errors of place are taken, those that a scene has."""

MOST_RUNS, ENOUGH = 5, 1.0
"""A method is timed so often, or until its runs have taken so long, s."""


@dataclass(frozen=True)
class Plan:
    """What to measure.

    cases, steps : scenes with an exact course, and the steps of time stepping for them, s
    ensembles, repeats, ensemble_steps : averages over so many repeats, with these steps, s
    questions : how far ahead scenes can be computed
    """

    cases: tuple[Case, ...]
    steps: tuple[float, ...]
    ensembles: tuple[Ensemble, ...]
    repeats: int
    ensemble_steps: tuple[float, ...]
    questions: tuple[Question, ...]


@dataclass(frozen=True)
class Result:
    """A method on a scene.

    seconds, runs : processor time, the median of so many runs
    events_per_second : the exact twin's events over ``seconds``
    collisions : events until the scene's end
    first_different : events before the first in which other bodies collide than in truth
    place_errors : m, root mean square over the balls, at the checkpoints' true times
    """

    method: str
    step: float | None
    seconds: float
    runs: int
    events_per_second: float
    collisions: int
    first_different: int
    place_errors: tuple[float, ...]
    overlap: float
    ledger: Ledger


@dataclass(frozen=True)
class Study:
    """The methods on one scene; ``time`` in s is between its last event and the next."""

    name: str
    what: str
    balls: int
    collisions: int
    certain: int
    digits: int
    check_digits: int
    time: float
    checkpoints: tuple[int, ...]
    results: tuple[Result, ...]


def full_plan() -> Plan:
    """The plan of ``snooker bench error``: a minute or two."""
    elastic = Ensemble("report", "the report's scene, elastic", 1.0, rings)
    cooling = Ensemble(
        "report-cor-0.8",
        "the report's scene, cor 0.8",
        1.0,
        lambda repeat: rings(repeat, restitution=0.8),
    )
    return Plan(
        cases=_cases("report", "report-cor-0.8", "dilute", "mixture"),
        steps=(1e-2, 1e-3, 1e-4, 1e-5, 1e-6),
        ensembles=(elastic, cooling),
        repeats=128,
        ensemble_steps=(1e-2, 1e-3, 1e-4),
        questions=(
            Question("report", "the report's scene, elastic", 0.041, 2, rings),
            Question("dilute", "with balls of 0.1 m", 0.196, 4, lambda k: rings(k, radius=0.1)),
        ),
    )


def quick_plan() -> Plan:
    """The same for seven balls, in seconds: to see that it works, not to be quoted."""

    def seven(repeat: int) -> Scene:
        return rings(repeat, number=1, restitution=0.9)

    (light,) = _cases("light-container")
    return Plan(
        cases=(Case(light.name, light.what, 50, light.start),),
        steps=(1e-2, 1e-3, 1e-4),
        ensembles=(Ensemble("seven", "seven balls, cor 0.9", 2.0, seven),),
        repeats=4,
        ensemble_steps=(1e-2, 1e-3),
        questions=(Question("seven", "seven balls", 0.30, 1, lambda k: rings(k, number=1)),),
    )


def measured(plan: Plan, tell: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Carry out a plan; the measurement, with where and when it was made, as JSON has it.

    tell : is told what is about to be done
    """
    began = datetime.now(UTC)
    studies, biases, horizons = [], [], []
    for case in plan.cases:
        tell(case.what)
        studies.append(asdict(study(case, methods(plan.steps))))
    for ensemble in plan.ensembles:
        tell(f"averages over {plan.repeats} repeats, {ensemble.what}")
        found = averages(ensemble, methods(plan.ensemble_steps), plan.repeats)
        biases.append(_averaged(ensemble, plan.repeats, found))
    for question in plan.questions:
        tell(f"how far ahead, {question.what}")
        each = [horizon(question, repeat) for repeat in range(question.repeats)]
        horizons.append(_asked(question, each))
    record = origin("error against cost", began, "numpy", "numba", "mpmath") | {
        "scenes": studies,
        "ensembles": biases,
        "horizons": horizons,
    }
    as_json: dict[str, Any] = plain(record)
    return as_json


def study(case: Case, ways: Sequence[Method]) -> Study:
    """The methods on one scene, against the exact twin."""
    scene = case.start()
    truth = trajectory(scene, case.collisions + 1)
    collisions = len(truth.events) - 1
    events, time = truth.events, truth.events.time
    # Between its last event and the next, so that no rounding decides which of them are in.
    end = float(time[collisions - 1] + time[collisions]) / 2
    checkpoints = tuple(sorted({k for k in CHECKPOINTS if k < collisions} | {collisions}))
    places = truth.states[list(checkpoints), :-1, :2]
    moments = np.append(time[[k - 1 for k in checkpoints]], end)
    results = []
    for way in ways:
        way.run(scene, moments[:1])  # compiles what it needs
        course = way.run(scene, moments)
        seconds = [course.seconds]
        while len(seconds) < MOST_RUNS and sum(seconds) < ENOUGH:
            seconds.append(way.run(scene, moments).seconds)
        median = statistics.median(seconds)
        errors = rms_distance(course.positions[:-1], places)
        results.append(
            Result(
                method=way.name,
                step=way.step,
                seconds=median,
                runs=len(seconds),
                events_per_second=collisions / median,
                collisions=len(course.events),
                first_different=min(first_different(course.events, events), collisions),
                place_errors=tuple(errors.tolist()),
                overlap=course.overlap,
                ledger=ledger(course),
            )
        )
    return Study(
        name=case.name,
        what=case.what,
        balls=scene.number,
        collisions=collisions,
        certain=min(truth.certain, collisions),
        digits=truth.digits,
        check_digits=truth.check_digits,
        time=end,
        checkpoints=checkpoints,
        results=tuple(results),
    )


def _averaged(ensemble: Ensemble, repeats: int, found: Sequence[Averages]) -> dict[str, Any]:
    return {
        "name": ensemble.name,
        "what": ensemble.what,
        "time": ensemble.time,
        "repeats": repeats,
        "methods": [asdict(one) for one in found],
    }


def _asked(question: Question, found: Sequence[Horizon]) -> dict[str, Any]:
    exponents = [one.exponent for one in found]
    return {
        "name": question.name,
        "what": question.what,
        "exponent": question.exponent,
        "estimate": question.estimate,
        "median": statistics.median(one.parted for one in found),
        "mean_exponent": statistics.fmean(exponents),
        "repeats": [asdict(one) for one in found],
    }


def _cases(*names: str) -> tuple[Case, ...]:
    """Cases of the catalogue by name."""
    return tuple(case for name in names for case in CASES if case.name == name)
