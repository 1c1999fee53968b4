"""Scenes into the arrays of kernels, and back; copies of these arrays for checkpoints."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle
from snooker_cli.engine import clock
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.boundaries import FixedCircle, FreeCircle, fixed_boundary
from snooker_cli.engine.frames import Frame, Laboratory, MovingFrame
from snooker_cli.engine.kernel_state import (
    EqualBalls,
    Floats,
    Indices,
    Setup,
    Sizes,
    State,
    UnequalBalls,
)
from snooker_cli.engine.package_laws import package_laws
from snooker_cli.engine.restitution import TRAPPING, law_rows, laws_of_rows
from snooker_cli.engine.sliding import SlidingCircle
from snooker_cli.engine.surfaces import BallSurface, Rough, Smooth, SurfaceNumbers
from snooker_cli.errors import SceneError
from snooker_cli.fields import carried_fields
from snooker_cli.laws import Constant, PackageLaw
from snooker_cli.scene import Scene
from snooker_cli.trace import Events

LARGE = 1e100  # large but finite, so that times zero it is zero


def new_states(
    scenes: Sequence[Scene],
    time_limit: float = math.inf,
    memory: tuple[Floats, Indices] | None = None,
) -> State:
    """The stacked states of repeats of one point at their start.

    memory : stacked, for the balls, with BALL_ROWS or more rows, and for their history
    """
    first, repeats = scenes[0], len(scenes)
    number = first.number
    balls, history = memory or (
        np.zeros((repeats, ks.BALL_ROWS, number)),
        np.zeros((repeats, ks.HISTORY_ROWS, number), dtype=np.int32),
    )
    history[:, ks.FORMER] = ks.NO_PARTNER
    positions = np.stack([scene.positions for scene in scenes])
    positions -= np.stack([origin_of(scene) for scene in scenes])[:, np.newaxis]
    balls[:, [ks.X, ks.Y]] = positions.transpose(0, 2, 1)
    balls[:, ks.CLOCK] = -0.0  # see ``clock.is_before``
    balls[:, [ks.U, ks.V]] = np.stack([scene.velocities for scene in scenes]).transpose(0, 2, 1)
    sums = np.zeros((repeats, ks.SUMS))
    sums[:, ks.TIME_LIMIT] = time_limit
    keys = [[scene.wall_key] * (scene.wall_key is not None) for scene in scenes]
    counts = np.zeros((repeats, ks.COUNTS + len(keys[0])), dtype=np.int64)
    counts[:, ks.COUNTS :] = np.array(keys, dtype=np.int64)
    counts[:, [ks.FIRST, ks.SECOND]] = ks.NO_PARTNER
    setup = setup_of(first)
    adds_up = setup.traps or first.contact_duration
    scratch_rows = ks.BALL_ROWS if first.slides else 1 if adds_up else 0
    return State(
        setup=setup,
        balls=balls,
        history=history,
        boundary=boundary_of(scenes),
        sizes=sizes_of(first),
        surface=surface_of(scenes),
        frame=frame_of(scenes),
        labels=np.zeros(0, dtype=np.int32),
        sums=sums,
        counts=counts,
        account=np.zeros((repeats, ks.ACCOUNT if first.wall_law.adds_energy else 0)),
        scratch=np.zeros((repeats, scratch_rows, number)),
    )


def setup_of(scene: Scene) -> Setup:
    """What collisions do in a scene."""
    law, lasts = scene.wall_law, scene.contact_duration
    traps = scene.container.traps
    no_rule = not lasts and scene.elastic_below == 0.0
    of_package, laws = isinstance(law, PackageLaw), laws_of_rows(scene.pair_law, law)
    always_loses = (law.cor < 1.0 or of_package) and not law.adds_energy and no_rule
    if traps and always_loses and not isinstance(law, TRAPPING):
        problem = f"a {scene.container.title} may trap balls, and the {law.name} law has no sums"
        advice = "set another shape or collapse: {tc: 0.01}"
        if not of_package:
            advice += ", or add the law to `bounce_sums` and TRAPPING in engine/restitution.py"
        raise SceneError("container", f"{problem}; {advice}")
    masses = [*scene.masses, scene.container_mass] if scene.free else scene.masses
    slow_cor = scene.restitution if isinstance(scene.pair_law, Constant) and no_rule else 1.0
    return Setup(
        laws=law_rows(laws),
        package_laws=package_laws(laws, len(laws)),
        contact_path=float(lasts * scene.mean_free_path) if lasts else 0.0,
        elastic_below=float(scene.elastic_below),
        traps=traps and always_loses,
        settling=clock.settling(float(max(masses)), float(min(masses)), slow_cor),
    )


def stands_still(scene: Scene, events: Events) -> bool:
    """Whether the last of a repeat's events leave the clock unmoved, as only a collapse does.

    Engines before version 9 had a limit for all balls of a scene, and recorded such events.
    """
    still = clock.still_events(events)
    involved = len(np.union1d(still.i, still.j[still.j >= 0]))
    return len(still) - 1 > clock.most_stalled(involved, setup_of(scene).settling)


def boundary_of(scenes: Sequence[Scene]) -> Any:
    """The stacked boundary of repeats of one point."""
    scene = scenes[0]
    container = scene.container
    if not isinstance(container, Circle):
        return fixed_boundary(container)
    radius = float(container.radius)
    if scene.free:
        motions = [
            (*scene.container_position, *scene.container_velocity, 0.0, ks.NO_PARTNER)
            for scene in scenes
        ]
        mass = float(scene.container_mass)
        pushes = min(4.0 * scene.number * float(scene.masses[0]) / mass, LARGE)
        return FreeCircle(radius, mass, 1.0 + pushes, np.array(motions))
    circle = FixedCircle(radius)
    if scene.slides:
        return SlidingCircle(circle, np.zeros((len(scenes), scene.number), dtype=np.int64))
    return circle


def surface_of(scenes: Sequence[Scene]) -> BallSurface:
    """The stacked surface of the balls of one point."""
    surface = scenes[0].surface
    if surface is None:
        return Smooth(None)
    carried = [field.rows(scenes) for field in carried_fields(scenes[0])]
    numbers = SurfaceNumbers(*map(float, vars(surface).values()))
    return Rough(numbers, np.zeros((len(scenes), 1)), *carried)


def frame_of(scenes: Sequence[Scene]) -> Frame:
    """The stacked frame of repeats of one point."""
    scene = scenes[0]
    across, up = (True, True) if scene.free else scene.container.periodic
    if not (across or up):
        return Laboratory(None)
    return MovingFrame(np.zeros((len(scenes), ks.BALL_ROWS)), float(across), float(up))


def sizes_of(scene: Scene) -> Sizes:
    """Radii and masses of a scene's balls."""
    if scene.equal_balls:
        return EqualBalls(float(scene.radii[0]), float(scene.masses[0]))
    return UnequalBalls(np.array(scene.radii), np.array(scene.masses))


def origin_of(scene: Scene) -> Floats:
    """Where the kernel's coordinates begin: at the centre of a fixed container, m."""
    return np.zeros(2) if scene.free else np.asarray(scene.container_position)


# Back to scenes


def flown(columns: Floats, clocks: Floats) -> Floats:
    """Places (m) and velocities (m/s), (..., 4, *N*), on straight ways when clocks show a time, s.

    columns : (..., BALL_ROWS or more, *N*), as ``State.balls``
    clocks : (...)
    """
    out = columns[..., :4, :].copy()
    ages = clocks[..., np.newaxis] - columns[..., ks.CLOCK, :]
    out[..., :2, :] += out[..., 2:, :] * ages[..., np.newaxis, :]
    return out


def inner_images(places: Floats, period: tuple[float, float]) -> Floats:
    """The images inside a box that repeats, (..., 2, *N*), m.

    A gas may have drifted so far that a box is less than the rounding of its place: then again.
    """
    lengths = np.array(period)[:, np.newaxis]
    while True:
        inner = places - lengths * np.rint(places / lengths)
        if not np.any(np.abs(inner) < np.abs(places)):
            return np.asarray(inner)
        places = inner


def frames_at(states: State, clocks: Floats, period: tuple[float, float] | None) -> Floats:
    """Place (m) and velocity (m/s) of each repeat's frame in the laboratory, (*repeats*, 4).

    Where a container repeats, the place is inside, so that balls keep their distances to the bit.

    One that has not moved has -0.0, which changes no bit of a sum, as 0.0 does of -0.0.
    """
    if not isinstance(states.frame, MovingFrame):
        return np.full((len(clocks), 4), -0.0)
    moved = flown(states.frame.motion[..., np.newaxis], clocks)
    if period is not None:
        moved[:, :2] = inner_images(moved[:, :2], period)
    moved = moved[..., 0]
    return np.where(np.any(moved[:, 2:] != 0.0, axis=1, keepdims=True), moved, -0.0)


def scenes_at(scenes: Sequence[Scene], states: State, clocks: Floats) -> list[Scene]:
    """The scene of each repeat when its clocks show a time, s, at or after the last event."""
    columns, boundary, labels = flown(states.balls, clocks), states.boundary, states.labels
    if scenes[0].slides:
        for repeat, clock in enumerate(clocks.tolist()):
            state = ks.state_of(states, repeat)
            for ball in range(scenes[0].number):
                columns[repeat][:, ball] = state.boundary.flight(ball, clock, state)
    moved = frames_at(states, clocks, scenes[0].container.period)
    columns += moved[..., np.newaxis]
    if scenes[0].container.period is not None:
        columns[:, :2] = inner_images(columns[:, :2], scenes[0].container.period)
    columns[:, :2] += np.stack([origin_of(scene) for scene in scenes])[:, :, np.newaxis]
    rows = columns.transpose(0, 2, 1)
    names = [field.name for field in carried_fields(scenes[0])]
    ends = [
        replace(
            scene,
            positions=_in_order(positions, labels),
            velocities=_in_order(velocities, labels),
            **{name: getattr(states.surface, name)[repeat].copy() for name in names},
        )
        for repeat, (scene, positions, velocities) in enumerate(
            zip(scenes, rows[:, :, :2], rows[:, :, 2:], strict=True)
        )
    ]
    if not scenes[0].free:
        return ends
    motions = flown(boundary.motion[..., np.newaxis], clocks)[..., 0] + moved
    return [
        replace(scene, container_position=motion[:2], container_velocity=motion[2:])
        for scene, motion in zip(ends, motions, strict=True)
    ]


def _in_order(rows: Floats, labels: Indices) -> Floats:
    """A copy of the rows of balls, in the scene's order."""
    if len(labels) == 0:
        return rows.copy()
    ordered = np.empty(rows.shape)
    ordered[labels] = rows
    return ordered


# Checkpoints


class CheckpointError(ValueError):
    """A checkpoint has not the arrays of its scene."""


def copied(name: str, part: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Copies of the arrays and numbers of a part, by name."""
    if isinstance(part, tuple):
        for field, value in part._asdict().items():  # type: ignore[attr-defined]  # a NamedTuple
            yield from copied(f"{name}.{field}", value)
    elif part is not None:
        yield name, np.array(part, order="C")


def restored(name: str, part: Any, saved: Mapping[str, NDArray[Any]]) -> Any:
    """A part with what was saved: arrays keep their memory and its order.

    Raises ``CheckpointError`` for an array of another shape or type.
    """
    if part is None:
        return None
    if isinstance(part, tuple):
        values = part._asdict()  # type: ignore[attr-defined]  # a NamedTuple
        return type(part)(*(restored(f"{name}.{key}", values[key], saved) for key in values))
    values, fresh = saved.get(name), np.asarray(part)
    if values is None or (values.shape, values.dtype) != (fresh.shape, fresh.dtype):
        raise CheckpointError("its checkpoint is of another repeat")
    if isinstance(part, np.ndarray):
        part[...] = values
        return part
    return type(part)(values)
