"""The balls in their container at some times of a repeat, coloured by what they do."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from snooker_cli import facts
from snooker_cli.analysis import quantities, structure, theories
from snooker_cli.containers import ENDS
from snooker_cli.engine import state_at
from snooker_cli.errors import FigureError
from snooker_cli.facts import MOST_SPECIES
from snooker_cli.figures.figure_builder import FigureBuilder
from snooker_cli.figures.figure_data import Array, FigureData, Picture, Pictures, Wall
from snooker_cli.figures.structure_at_times import MOMENTS
from snooker_cli.formatting import listed, short
from snooker_cli.laws import Driven, Law
from snooker_cli.scene import Scene
from snooker_cli.trace import Trace

MOST_PICTURES = 12  # times of one figure
FEWEST_IN_CLUSTERS = 500  # balls; fewer have no clusters that a picture can show

SHOWN = 99.0  # percent of the balls whose values the colours tell apart; few are far outside


class Colours(NamedTuple):
    """What colours show: values of each state, and what ``Pictures`` has of them."""

    values: list[Array]
    label: str
    limits: tuple[float, float]
    names: tuple[str, ...] = ()
    high_is_dark: bool = False


COOLED = 2.0  # from this ratio of mean speeds on, one scale in m/s does not show all states


def _of_speed(states: list[Scene]) -> Colours:
    """Speeds; of states of a gas that cools over the root mean square of each."""
    speeds = [np.hypot(*scene.velocities.T) for scene in states]
    label = "speed (m/s)"
    means = [math.sqrt(float(np.mean(speed**2))) for speed in speeds]
    if max(means) > COOLED * min(means):
        speeds = [speed / (mean or 1.0) for speed, mean in zip(speeds, means, strict=True)]
        label = "speed over the root mean square at that time"
    return Colours(speeds, label, (0.0, _highest(speeds)))


def _of_species(states: list[Scene]) -> Colours:
    """The species, by radius and mass. Raises ``FigureError`` for too many."""
    kinds = structure.species(states[0])
    if len(kinds) > MOST_SPECIES:
        raise FigureError(
            f"the balls have {len(kinds):,} radii and masses; colours show {MOST_SPECIES} species "
            "at most"
        )
    values, firsts = np.zeros(states[0].number), [balls[0] for balls in kinds]
    for k, balls in enumerate(kinds):
        values[balls] = k
    scene = states[0]
    names = [f"r = {scene.radii[k]:g} m, m = {scene.masses[k]:g} kg" for k in firsts]
    limits = 0.0, float(len(names) - 1)
    return Colours([values] * len(states), "species", limits, tuple(names))


def _of_density(states: list[Scene]) -> Colours:
    """The packing fraction around each ball."""
    packings = [
        structure.local_packing(scene.positions, scene.velocities, scene) for scene in states
    ]
    label = f"packing fraction in cells of {structure.BALLS_IN_CELL:g} balls on average"
    highest = _highest(packings)
    # Below the scale is space without balls.
    lowest = min(*(float(value.min()) for value in packings), highest / 2)
    return Colours(packings, label, (lowest, highest), high_is_dark=True)


def _highest(values: list[Array]) -> float:
    return float(max(np.percentile(value, SHOWN) for value in values)) or 1.0


COLOURS: dict[str, Callable[[list[Scene]], Colours]] = {
    "speed": _of_speed,
    "species": _of_species,
    "density": _of_density,
}
"""What the colours of balls can show."""


PARTS = (*MOMENTS[:-1], 1.0)
"""Parts of the time of a gas in which clusters grow, at which it is shown."""


def snapshot(build: FigureBuilder) -> FigureData:
    """The states at the selected times, of the selected or the first repeat.

    Without a selection it has the start, the state after half of the collisions, and the end; where
    clusters grow, four times up to the end.
    """
    trace, (point,) = _trace(build), build.points
    if build.selection.times:
        return _pictures(build, trace, build.selection.times, asked=True)
    if _clusters(trace.start):
        return _pictures(build, trace, [part * trace.stop.time for part in PARTS])
    curve = build.measurement(point).curve
    middle = float(np.interp(curve.events[0, -1] / 2, curve.events[0], curve.time[0]))
    return _pictures(build, trace, (0.0, middle, trace.stop.time))


def _trace(build: FigureBuilder) -> Trace:
    """The selected or the first repeat of the point."""
    (point,) = build.points
    build.limit(point, 1)
    return next(build.traces(point))


def _clusters(scene: Scene) -> bool:
    """Whether clusters grow in a gas with enough balls to see them."""
    ratio = theories.value_of(scene, quantities.CRITICAL_RATIO, theories.CRITICAL)
    return ratio is not None and ratio > 1 and scene.number >= FEWEST_IN_CLUSTERS


def _pictures(
    build: FigureBuilder, trace: Trace, times: Sequence[float], *, asked: bool = False
) -> FigureData:
    """The states at times, s; if these were asked for, a sentence names those not stored."""
    found = _states(build, trace, times)
    of_gas = "density" if _clusters(trace.start) else "speed"
    colours = COLOURS[build.selection.colour or of_gas]([scene for _, scene in found])
    pictures = Pictures(
        tuple(
            _picture(time, scene, values, cells=colours.high_is_dark)
            for (time, scene), values in zip(found, colours.values, strict=True)
        ),
        *colours[1:],
        walls=_walls(trace.start),
    )
    if len(found) == 1:
        build.record(build.points[0], time=found[0][0])
    changes = _change(build, colours, [scene for _, scene in found])
    empty = "White space has no balls." if pictures.high_is_dark else ""
    moved = _moved(trace, times if asked else (), [time for time, _ in found])
    return build.figure(
        " ".join(filter(None, [changes, empty, moved])),
        numbers={"times": [time for time, _ in found]},
        pictures=pictures,
    )


def _change(build: FigureBuilder, colours: Colours, states: Sequence[Scene]) -> str:
    """A sentence on what changes from the first to the last state, and the headline."""
    if colours.names:
        return ""
    if colours.high_is_dark:
        first, last = (float(np.mean(colours.values[k])) for k in (0, -1))
        what = noun = "mean packing around a ball"
        unit = ""
    else:
        speeds = [np.hypot(*states[k].velocities.T) for k in (0, -1)]
        first, last = (math.sqrt(float(np.mean(speed**2))) for speed in speeds)
        what, noun, unit = "root mean square speed", "rms speed", " m/s"
    low, high = (short(value, 2) for value in (first, last))
    if len(states) == 1:
        return f"The {what} is {low}{unit}."
    if low == high:
        build.headline = f"{noun} stays {low}{unit}"
        return f"The {what} is {low}{unit} at the first and the last time."
    build.headline = f"{noun} from {low} to {high}{unit}"
    return f"The {what} goes from {low} to {high}{unit}."


def _walls(scene: Scene) -> tuple[Wall, ...]:
    """Walls with a key: none if all are alike and give no energy."""
    container, law = scene.container, scene.wall_law
    lines: dict[Law, list[Array]] = {}
    for line in container.wall_lines:
        middle = line.mean(axis=0) / container.size
        axis = int(np.argmax(np.abs(middle)))
        side = ENDS["xy"[axis]][int(middle[axis] > 0)]
        lines.setdefault(getattr(law, side, law), []).append(line)
    if len(lines) < 2 and not facts.hold(scene, "warm_walls"):
        return ()
    heats = sorted({law.temperature for law in lines if hasattr(law, "temperature")})
    walls = [Wall(np.array(own), *_of_law(law, heats)) for law, own in lines.items()]
    return tuple(sorted(walls, key=lambda wall: (wall.heat is None, wall.heat, not wall.drives)))


def _of_law(law: Law, heats: Sequence[float]) -> tuple[str, float | None, bool]:
    """The name of a wall, the rank of its temperature, and whether it drives; see ``Wall``."""
    heat = getattr(law, "temperature", None)
    if heat is not None:
        rank = heats.index(heat) / (len(heats) - 1) if heats[1:] else 0.5
        return f"wall at {heat:g} J", rank, False
    if law.name == Driven.name:
        return f"wall driven at {law.as_json()['speed']:g} m/s", None, True
    return f"wall, CoR {law.cor:g}", None, False


def _states(
    build: FigureBuilder, trace: Trace, times: Sequence[float]
) -> list[tuple[float, Scene]]:
    """The time and the state at each time, without repetitions. Raises ``FigureError``."""
    if len(times) > MOST_PICTURES:
        raise FigureError(f"one figure shows {MOST_PICTURES} times at most, not {len(times)}")
    end = trace.stop.time
    for time in times:
        if not 0 <= time <= end:
            raise FigureError(f"the repeat has no time {time:g} s: it ends at {end:.9g} s")
    found: dict[float, Scene] = {}
    for k, time in enumerate(sorted(times), 1):
        if len(times) > 1:
            build.reading(f"snapshot: time {k} of {len(times)}")
        stored, scene = state_at(trace, time)
        found.setdefault(stored, scene)
    return [*found.items()]


def _moved(trace: Trace, wanted: Sequence[float], found: list[float]) -> str:
    """A sentence if the states are not at the times that were asked for."""
    missing = [time for time in wanted if time not in found]
    if not missing:
        return ""
    stored = "only the start and the end" if trace.snapshots is None else "states at some times"
    asked = listed([f"{short(time, 4)} s" for time in missing])
    return f"The run stores {stored}: the picture is the nearest to {asked}."


def _picture(time: float, scene: Scene, values: Array, *, cells: bool) -> Picture:
    container = scene.container
    return Picture(
        time=time,
        places=container.nearest_image(scene.positions - scene.container_position),
        radii=scene.radii,
        values=values,
        outline=container.outline,
        size=container.size,
        periodic=container.periodic,
        cells=structure.cell_packing(scene.positions, scene) if cells else None,
    )
