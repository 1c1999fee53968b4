"""Places of balls at the start: on rings, on a hexagonal lattice, or at random."""

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from functools import cache
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from snooker_cli.containers import Circle, Container, Rectangle
from snooker_cli.errors import JammedError, SceneError
from snooker_cli.neighbours import Floats, Indices, near, near_pairs
from snooker_cli.placement.random_numbers import points_in_disc, uniforms
from snooker_cli.scene import EPSILON

# Rings: regular polygons whose corners are correctly rounded

DIGITS, TERMS = 40, 72  # the 72nd term of the series at 2 pi is below 1e-45
PI = Decimal("3.1415926535897932384626433832795028841971693993751")


def ring_positions(rings: int, extent: float) -> Floats:
    """One place at the centre and 6k on ring k of n, with radius k/n of ``extent``; (*N*, 2), m."""
    positions = [(0.0, 0.0)]
    for ring in range(1, rings + 1):
        radius = ring / rings * extent
        positions += [(radius * x, radius * y) for x, y in unit_polygon(6 * ring)]
    return np.array(positions)


@cache
def unit_polygon(corners: int) -> tuple[tuple[float, float], ...]:
    """Corners of a regular polygon on the unit circle, each coordinate correctly rounded."""
    with localcontext() as context:
        context.prec = DIGITS
        cosine, sine = cosine_and_sine(2 * PI / corners)
        x, y = Decimal(1), Decimal(0)
        points = []
        for _ in range(corners):
            points.append((float(round(x, DIGITS - 5)), float(round(y, DIGITS - 5))))
            x, y = x * cosine - y * sine, x * sine + y * cosine
    return tuple(points)


def cosine_and_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """Taylor series of both, to the precision of the context, for an angle up to 2 pi."""
    term, parts = Decimal(1), [Decimal(0), Decimal(0)]
    for order in range(TERMS):
        parts[order % 2] += term if order % 4 < 2 else -term
        term = term * angle / (order + 1)
    return parts[0], parts[1]


# Hexagonal lattices fitted into a container

HALVINGS = 60  # steps of bisection, enough for all digits of a double
LATTICE_ROUNDINGS = (
    4  # errors, in epsilons of the container's size, that may bring two places nearer
)


def lattice(container: Container, number: int) -> tuple[Floats, float]:
    """Places of balls as far from each other and from the wall as possible, (*N*, 2), m.

    Also the largest diameter of balls that fit there, m.
    """
    size = container.size
    if isinstance(container, Circle):
        positions, diameter = _in_circle(container.radius, number)
    elif not isinstance(container, Rectangle):
        problem = f"there is no lattice in a {container.title}"
        advice = "give start: random, or add one to `lattice` in placement/places.py"
        raise SceneError("container.shape", f"{problem}; {advice}")
    elif container.keeps_drift():
        # Rows across, and an even number of them along the way that repeats.
        lies = container.periodic[0]
        positions, diameter = _in_box(*(size[::-1] if lies else size), number, repeats=True)
        if lies:
            positions = np.ascontiguousarray(positions[:, ::-1])
    else:
        layout = _in_box if container.has_wall else _in_periodic
        positions, diameter = layout(*size, number)
        lying, larger = layout(*size[::-1], number)
        if larger > diameter:
            positions, diameter = np.ascontiguousarray(lying[:, ::-1]), larger
    return positions, diameter - LATTICE_ROUNDINGS * EPSILON * max(size)


def lattice_around(
    container: Container, number: int, radius: float, placed: tuple[Floats, Floats]
) -> tuple[Floats, float]:
    """As ``lattice``, without places where a ball of a radius (m) overlaps one that is placed.

    placed : places (*n*, 2) and radii (*n*,) of these, m
    """
    tried, diameter, free = 0, math.inf, np.empty((0, 2))
    while len(free) < number and diameter >= 2 * radius:
        tried += number - len(free)
        free, diameter = lattice(container, tried)
        for place, other in zip(*placed, strict=True):
            free = free[~_blocked(free, place[None], radius + other, container.period)]
    if len(free) > number:
        free = free[np.arange(number) * len(free) // number]
    return free, diameter


def _in_circle(radius: float, number: int) -> tuple[Floats, float]:
    """The lattice places nearest to the centre, which is a place or lies between two or three.

    With neighbours at a distance of 6, a place is at (u + v/2, v sqrt(3)/2). Here u and v are whole
    numbers with a fixed remainder modulo 6, and u^2 + uv + v^2 is the exact squared distance.
    """
    # N places fill a disk of radius sqrt(N sqrt(3) / (2 pi)), where |v| is up to 2 / sqrt(3) times
    # as large: 0.607 sqrt(N).
    reach = int(0.607 * math.sqrt(number)) + 2
    steps = 6 * np.arange(-reach, reach + 1)
    layouts: list[tuple[Floats, float]] = []
    for rest in ((0, 0), (3, 0), (2, 2)):
        u, v = (axis.ravel() for axis in np.meshgrid(steps + rest[0], steps + rest[1]))
        squares = u * u + u * v + v * v
        nearest = np.argsort(squares, kind="stable")[:number]
        farthest = math.sqrt(int(squares[nearest[-1]])) / 6
        spacing = radius / (farthest + 0.5)
        x, y = u[nearest] + v[nearest] / 2, v[nearest] * (math.sqrt(3) / 2)
        layouts.append((np.column_stack([x, y]) * (spacing / 6), spacing))
    return max(layouts, key=lambda layout: layout[1])


def _in_periodic(width: float, height: float, number: int) -> tuple[Floats, float]:
    """An even number of rows along x, each shifted by half a spacing."""
    rows = 2 * _numbers_of_rows(width, height, number)
    columns = -(-number // rows)
    across, up = width / columns, height / rows
    diagonal = np.sqrt((across / 2) * (across / 2) + up * up)
    diameters = np.minimum(np.minimum(across, 2 * up), diagonal)
    best = int(np.argmax(diameters))
    column, row = _kept(number, int(columns[best]), int(rows[best]), 0)
    x = ((column + row % 2 / 2 + 0.25) / columns[best] - 0.5) * width
    y = ((row + 0.5) / rows[best] - 0.5) * height
    return np.column_stack([x, y]), float(diameters[best])


def _in_box(
    width: float, height: float, number: int, repeats: bool = False
) -> tuple[Floats, float]:
    """Rows along x; every other one is shifted by half a spacing and may have one place less.

    repeats : upwards, as a channel does, with an even number of rows
    """
    rows = (1 + repeats) * _numbers_of_rows(width, height, number)
    layouts = []
    for fewer in (0, 1):
        columns = -(-(number + fewer * (rows // 2)) // rows)
        # Length of the rows in spacings, with half a spacing for the shift.
        length = np.where(rows > 1, columns - (1 + fewer) / 2, columns - 1.0)
        diameters = _diameters_in_box(width, height, columns, rows, length, repeats)
        k = int(np.argmax(diameters))
        layouts.append(
            (float(diameters[k]), int(columns[k]), int(rows[k]), float(length[k]), fewer)
        )
    diameter, columns_, rows_, length_, fewer = max(layouts)
    column, row = _kept(number, columns_, rows_, fewer)
    x = (column + row % 2 / 2 - length_ / 2) * ((width - diameter) / (length_ or 1.0))
    up = height / rows_ if repeats else (height - diameter) / ((rows_ - 1) or 1)
    y = (row - (rows_ - 1) / 2) * up
    return np.column_stack([x, y]), diameter


def _diameters_in_box(
    width: float,
    height: float,
    columns: Indices,
    rows: Indices,
    length: Floats,
    repeats: bool,
) -> Floats:
    """The largest diameter for each number of rows, by bisection, m."""
    low, high = np.zeros(len(rows)), np.full(len(rows), min(width, height))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        across = (width - middle) / np.where(length > 0, length, math.inf)
        up = height / rows if repeats else (height - middle) / np.maximum(rows - 1, 1)
        diagonal = np.sqrt((across / 2) * (across / 2) + up * up)
        fits = (
            ((columns == 1) | (across >= middle))
            & ((rows == 1) | (diagonal >= middle))
            & ((rows <= 2) | (2 * up >= middle))
        )
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return low


def _numbers_of_rows(width: float, height: float, number: int) -> Indices:
    """Numbers of rows to compare, up to twice that of equilateral triangles."""
    ideal = math.sqrt(2 / math.sqrt(3) * number * min(height / width, float(number)))
    return np.arange(1, min(number, int(2 * ideal) + 3) + 1)


def _kept(number: int, columns: int, rows: int, fewer: int) -> tuple[Indices, Indices]:
    """Column and row of `number` places, chosen evenly among all; odd rows may have one fewer."""
    of_two_rows = 2 * columns - fewer
    places = rows // 2 * of_two_rows + rows % 2 * columns
    pair, rest = np.divmod(np.arange(number) * places // number, of_two_rows)
    odd = rest >= columns
    return rest - columns * odd, 2 * pair + odd


# Random places: balls are inserted one after the other, and pushed apart if that jams

# Insertion jams at 0.547 (Feder 1980, doi:10.1016/0022-5193(80)90358-6); before, it is slow.
INSERTED = 0.4  # packing up to which balls are inserted at their size
ATTEMPTS = 100  # for each ball, then insertion has failed; at a packing of 0.4 it needs about 5
JAMMED = 0.84  # random close packing of disks (Berryman 1983, doi:10.1103/PhysRevA.27.1053)
LARGEST = 0.82  # largest packing that is tried; near jamming the time grows without limit
SWEEPS = 2000  # pushes of all balls, then pushing has failed; a packing of 0.82 needs about 800
PUSH = 0.3  # part of an overlap that a push removes
MEMORY = 0.9  # part of its last step that a ball repeats
SKIN = 0.6  # largest gap of the pairs that are listed as neighbours, in mean radii


def random_places(
    container: Container,
    radii: Sequence[float],
    counts: Sequence[int],
    packing: float,
    generator: np.random.PCG64,
    placed: tuple[Floats, Floats],
) -> Floats:
    """Random places of ``counts`` balls of each radius (m), in that order; (*N*, 2), m.

    packing : area of the balls over that of the container
    placed : places (*n*, 2) and radii (*n*,) of balls that are there already, m; they come first

    Raises ``JammedError`` if there are none, or none are found.
    """
    if packing > LARGEST * (1 + 1e-9):
        raise JammedError(LARGEST)
    all_radii = np.append(placed[1], np.repeat(radii, counts))
    wide = 2 * np.max(all_radii) / min(container.size)
    if wide > 1:
        raise JammedError(packing / (wide * wide))
    inserted, positions = 2 * min(packing, INSERTED), None
    # Each try inserts smaller balls. At their full size, these are then pushed apart.
    while positions is None:
        inserted /= 2
        scale = math.sqrt(inserted / packing)
        positions = _inserted(container, radii, counts, generator, scale, placed)
    if scale < 1:
        # Sorted in strips, so that neighbours are near in memory too.
        strips = np.floor(positions[:, 1] / (4 * fmean(all_radii)))
        order = np.lexsort((positions[:, 0], strips))
        fixed = order < len(placed[0])
        apart = _pushed_apart(container, positions[order], all_radii[order], packing, fixed)
        positions[order] = apart
    return positions


def _inserted(
    container: Container,
    radii: Sequence[float],
    counts: Sequence[int],
    generator: np.random.PCG64,
    scale: float,
    placed: tuple[Floats, Floats],
) -> Floats | None:
    """Places where balls with radii scaled by ``scale`` do not overlap; None if that fails."""
    period = container.period
    margin = np.where(container.periodic, 0.0, 2.0)  # radii
    there = [(radius, place[None]) for place, radius in zip(*placed, strict=True)]
    inserted: dict[int, Floats] = {}
    for k in sorted(range(len(radii)), key=lambda k: -radii[k]):
        inserted[k] = np.empty((0, 2))
        attempts, accepted = 0, 1.0
        while (missing := counts[k] - len(inserted[k])) > 0:
            if attempts > ATTEMPTS * counts[k]:
                return None
            number = int(missing / accepted) + 8
            if isinstance(container, Circle):
                tried = (container.radius - radii[k]) * points_in_disc([generator], number, 0.0)[0]
            else:
                sides = np.array(container.size) - margin * radii[k]
                tried = (uniforms([generator], number)[0] - 0.5) * sides
                if not isinstance(container, Rectangle):
                    inside = container.wall_gaps(tried, np.full(number, radii[k])) >= 0
                    tried = tried[inside]
            attempts += number
            before = [(radii[species], places) for species, places in inserted.items()]
            for other, places in [*there, *before]:
                tried = tried[~_blocked(tried, places, scale * (radii[k] + other), period)]
            tried = tried[~_blocked(tried, tried, scale * 2 * radii[k], period)]
            accepted = max(len(tried) / number, 0.05)
            inserted[k] = np.concatenate([inserted[k], tried[:missing]])
    return np.concatenate([placed[0], *(inserted[k] for k in range(len(radii)))])


def _blocked(
    tried: Floats, places: Floats, reach: float, period: tuple[float, float] | None
) -> NDArray[np.bool_]:
    """Which of the tried places are within reach (m) of `places`, or of earlier ones if these."""
    blocked = np.zeros(len(tried), dtype=np.bool_)
    for a, b, distances in near(tried, places, reach, period):
        close = distances < reach
        if tried is places:
            close &= b < a
        blocked[a[close]] = True
    return blocked


def _pushed_apart(
    container: Container,
    positions: Floats,
    radii: Floats,
    packing: float,
    fixed: NDArray[np.bool_],
) -> Floats:
    """Positions without overlaps; of ``fixed`` balls, the same. Raises ``JammedError``.

    Other balls are pushed as if they were larger by a quarter of the way to jamming, so that they
    soon are free. They continue their last step in part, as if they had mass.
    """
    wanted = radii * (1 + max(0.25 * (math.sqrt(JAMMED / packing) - 1), 1e-4))
    skin = SKIN * fmean(radii)
    steps, moved = np.zeros_like(positions), np.full(len(radii), math.inf)
    for _ in range(SWEEPS):
        # List neighbours anew before a pair outside of the list can touch.
        if 2 * np.max(moved) > skin:
            container.put_inside(positions, radii)
            pairs = list(near_pairs(positions, wanted, skin, container.period))
            i, j, _ = (np.concatenate(columns) for columns in zip(*pairs, strict=True))
            seen = positions.copy()
        x, y = container.nearest_image(positions[i] - positions[j]).T
        distances = np.sqrt(x * x + y * y)
        # Push each pair that overlaps at the enlarged size, until none overlaps at its own size.
        close = np.flatnonzero(distances < wanted[i] + wanted[j])
        a, b, apart = i[close], j[close], distances[close]
        if np.all(apart >= radii[a] + radii[b]):
            container.put_inside(positions, radii)
            return positions
        part = PUSH / 2 * (wanted[a] + wanted[b] - apart) / apart
        for axis, offsets in enumerate((x, y)):
            push = part * offsets[close]
            steps[:, axis] *= MEMORY
            steps[:, axis] += np.bincount(a, push, len(radii)) - np.bincount(b, push, len(radii))
        steps[fixed] = 0.0
        positions += steps
        if container.has_wall:
            container.put_inside(positions, radii)
        moved = np.sqrt(np.sum((positions - seen) ** 2, axis=1))
    ratio = float(np.min(apart / (radii[a] + radii[b])))
    raise JammedError(packing * ratio * ratio)
