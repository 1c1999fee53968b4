"""Runs and figures of the reproduction -> its results: numbers in nested dicts, as JSON has them.

Keys of a CoR are texts such as "0.8". An estimate has ``value``, ``error`` (standard error),
``deviation`` (of one repeat) and ``repeats``, the number behind it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from snooker_cli import Repeat, Run, Scene, theory
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.formatting import plain
from snooker_cli.reproduction.source_values import COEFFICIENTS

Array: TypeAlias = NDArray[np.float64]
NumbersOfRun: TypeAlias = dict[str, Any]
Runs: TypeAlias = Mapping[str, Run]

WINDOWS = 8

SETTLED = 0.75
"""Time from which the mean pressure since the start falls, s; before, it is that of a few hits."""

ENSKOG, FINITE = "Enskog rates at the start", theory.FINITE
"""Models of Haff's α in the rows of ``Run.compare``."""


def estimate(values: Iterable[float]) -> NumbersOfRun:
    """The mean over repeats with its errors; errors are nan for a single repeat."""
    rows = np.array(list(values))
    deviation = float(rows.std(ddof=1)) if len(rows) > 1 else math.nan
    error = deviation / math.sqrt(len(rows))
    return {"value": rows.mean(), "error": error, "deviation": deviation, "repeats": len(rows)}


def ratio_of_means(above: Array, below: Array) -> NumbersOfRun:
    """The ratio of two means over the same repeats, with its error to first order."""
    value = above.mean() / below.mean()
    return estimate((above - value * below) / below.mean()) | {"value": value}


def results(runs: Runs, pictures: Mapping[str, FigureData]) -> NumbersOfRun:
    """All results but those of single printed numbers, sentences and explanations.

    pictures : the figures by file; their numbers are among the results

    Raises ``RunError``, ``FigureError`` or ``StoreError``.
    """
    stated, elastic = runs["restitution"], runs["restitution"].table(cor=1.0)
    complete = {name: column[elastic["complete"]] for name, column in elastic.items()}
    scene = stated[0, 0].scene
    given: Any = stated.config
    paths = complete["mean_speed"] * complete["time"] * scene.number
    found = {
        "figures": {file: picture.numbers for file, picture in pictures.items()},
        "five": {f"{cor:g}": decays(runs["decay"], cor=cor) for cor in COEFFICIENTS},
        "stated": {f"{cor:g}": stated_scene(stated, cor) for cor in COEFFICIENTS},
        "elastic": {
            "pressure": estimate(complete["pressure"]),
            "mean_free_path": estimate(paths / (2 * complete["pair_collisions"])),
        },
        "balls": scene.number,
        "radius": float(scene.radii[0]),
        "speed": given.balls.speed,
        "container_radius": given.container.radius,
        "density": scene.number / scene.container.area,
        "source_path": source_path(scene),
        "haff": {name: haff_constants(runs[name]) for name in ("restitution", "elastic-wall")},
        "mixed": [haff_constants(runs["mixed"], wall_cor=wall) for wall in (None, 1.0)],
        "traps": traps(runs["sliding"]),
        "warm": warm_gas(pictures["steady"].numbers["points"]),
    }
    return dict(plain(found))


def decays(run: Run, until: float = math.inf, **where: Any) -> NumbersOfRun:
    """Rows of ``Run.fit`` of one point, up to a time (s): by quantity, then by law."""
    rows: NumbersOfRun = {}
    for row in run.fit(until=until, **where):
        row["deviation"] = (row["error"] or math.nan) * math.sqrt(row["repeats"])
        rows.setdefault(row["quantity"], {})[row["model"]] = row
    return rows


def source_path(scene: Scene) -> float:
    """The mean free path by the formula of the source report, m."""
    return theory.source_mean_free_path(scene.number / scene.container.area, float(scene.radii[0]))


def complete_repeats(run: Run, **where: Any) -> list[Repeat]:
    """The complete repeats of the one point with these values."""
    (point,) = run.matching(**where)
    return [repeat for repeat in run.repeats(point.index) if repeat.stop.reason.complete]


def stated_scene(run: Run, cor: float) -> NumbersOfRun:
    """The scene as the source report states it, below CoR 1.

    ``fits`` are of all repeats, the others of complete ones: ``speed``, m/s, the mean over the
    collisions, and the source report's ``tau`` and ``theory`` from it; ``slope``,
    d ln P/d ln E with the mean pressure P since the start; and ``windows``.
    """
    repeats = complete_repeats(run, cor=cor)
    courses = [repeat.series() for repeat in repeats]
    speeds = np.array([course.mean_speed[1:].mean() for course in courses])
    path = source_path(repeats[0].scene)
    return {
        "repeats": run.config.repeats,
        "complete": len(repeats),
        "fits": decays(run, cor=cor),
        "speed": estimate(speeds),
        "tau": estimate(path / speeds),
        "theory": estimate(theory.source_decay_constant(cor, path, speeds)),
        "slope": mean_pressure_slope(courses),
        "windows": in_windows(repeats[0].scene, courses),
    }


def so_far(course: Any, column: Array, times: Array) -> Array:
    """A column at times: it is constant from one collision to the next."""
    return np.asarray(column[np.searchsorted(course.time, times, side="right") - 1])


def mean_pressure_slope(courses: Sequence[Any]) -> NumbersOfRun:
    """d ln P/d ln E, with the mean pressure P since the start and the energy E of the balls.

    It is the ratio of the mean changes of both logarithms over repeats, from ``SETTLED`` to the end
    of the shortest one. Haff's law has 1/2: P goes as 1/(1 + αt).
    """
    times = np.array([SETTLED, min(course.time[-1] for course in courses)])
    pressure = [np.log(so_far(c, c.wall_impulse, times) / times) for c in courses]
    energy = [np.log(so_far(c, c.kinetic_energy, times)) for c in courses]
    return ratio_of_means(np.diff(pressure)[:, 0], np.diff(energy)[:, 0])


def in_windows(scene: Scene, courses: Sequence[Any]) -> NumbersOfRun:
    """P V/(N T) in the ``first`` and the ``last`` of ``WINDOWS`` equal windows of time.

    The windows end with the shortest repeat. ``kept`` is the last ratio over the first, and
    ``cooling`` is T of the first window over that of the last.
    """
    edges = np.linspace(0.0, min(course.time[-1] for course in courses), WINDOWS + 1)
    work, heat = [], []  # P V and N T of each window times its length
    for course in courses:
        impulse = np.diff(so_far(course, course.wall_impulse, edges))
        work.append(impulse * scene.container.area / scene.container.wall_length)
        energy = course.kinetic_energy
        whole = np.append(0.0, np.cumsum(energy[:-1] * np.diff(course.time)))
        since = edges - so_far(course, course.time, edges)
        integral = so_far(course, whole, edges) + so_far(course, energy, edges) * since
        heat.append(np.diff(integral))
    works, heats = np.array(work).T, np.array(heat).T
    first, last = (ratio_of_means(works[k], heats[k]) for k in (0, -1))
    share = last["value"] / first["value"]
    errors = [one["error"] / one["value"] for one in (first, last)]
    kept = {"value": share, "error": share * math.hypot(*errors), "repeats": len(courses)}
    cooling = heats[0].mean() / heats[-1].mean()
    return {"first": first, "last": last, "kept": kept, "cooling": cooling, "end": edges[-1]}


def haff_constants(run: Run, **where: Any) -> list[NumbersOfRun]:
    """Haff's α by CoR, beside kinetic theory's.

    Keys: ``cor``, ``complete``; ``alpha``; ``theory`` by Enskog's rates, 1/s; ``excess`` of this
    theory, ``finite`` of that for N balls in the container, and their ``error``, as shares of α.
    """
    rows: dict[float, NumbersOfRun] = {}
    for row in run.compare(cor=sorted({p.config.cor for p in run.points} - {1.0}), **where):
        if row["quantity"] != "Haff's α":
            continue
        cor, alpha = row["parameters"]["cor"], row["measured"]
        excess = row["predicted"] / alpha - 1
        if row["model"] == FINITE:
            rows[cor]["finite"] = excess
            continue
        rows[cor] = {"cor": cor, "complete": row["complete"], "theory": row["predicted"]}
        rows[cor]["alpha"] = {"value": alpha, "error": row["error"], "repeats": row["repeats"]}
        rows[cor] |= {"excess": excess, "error": row["error"] / alpha}
    return list(rows.values())


def traps(run: Run) -> list[NumbersOfRun]:
    """When the wall traps of each start come, and how it ends with sliding balls."""
    rows = []
    for point in run.points:
        given = point.as_json()
        if given["collapse"] == "stop":
            stopped, slid = run.table(**given), run.table(**given | {"collapse": "slide"})
            trapped = np.char.find(stopped["ending"], "trap") >= 0
            rows.append(
                {
                    "cor": given["cor"],
                    "radius": given["balls.radius"],
                    "repeats": len(trapped),
                    "trapped": trapped.sum(),
                    "time": stopped["time"][trapped].mean() if trapped.any() else math.nan,
                    "complete": slid["complete"].sum(),
                    "end": slid["time"].mean(),
                    "temperature": estimate(slid["temperature"]),
                }
            )
    return rows


def warm_gas(points: Sequence[Mapping[str, Any]]) -> list[NumbersOfRun]:
    """The points of the steady gas by radius, with falling CoR.

    Keys: those of a point; ``cor``, ``radius``; ``colder`` and ``weaker``, what T and PV/NT of
    elastic balls of this radius exceed its own by, as factors; ``excess`` of PV/NT over theory for
    N disks, as a share.
    """
    rows: list[NumbersOfRun] = []
    for record in reversed(points):
        cor, radius = (record["parameters"][key] for key in ("cor", "balls.radius"))
        row = {**record, "cor": cor, "radius": radius}
        elastic = row if cor == 1 else next(other for other in rows if other["radius"] == radius)
        for name, column in (("colder", "temperature"), ("weaker", "virial")):
            factor = elastic[column] / row[column]  # of independent repeats
            shares = [one[f"{column}_error"] / one[column] for one in (elastic, row)]
            row[name] = {"value": factor, "error": factor * math.hypot(*shares)}
        excess, error = (row[key] / row["theory_here"] for key in ("virial", "virial_error"))
        row["excess"] = {"value": excess - 1, "error": error}
        rows.append(row)
    return sorted(rows, key=lambda row: float(row["radius"]))
