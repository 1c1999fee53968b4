"""The shapes of a container: geometry, config keys and names of each.

All places are seen from the container's centre, and all lengths are in m.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np

from snooker_cli import region_integrals
from snooker_cli.errors import SceneError
from snooker_cli.neighbours import Floats

# Least and most values in configs and files, in SI units, so that squares are doubles.
LEAST_AMOUNT, MOST_AMOUNT = 1e-50, 1e50  # of a length, m, or a mass, kg
LEAST_SPEED, MOST_SPEED = 1e-150, 1e150  # m/s, of a law; and the most at the start
LEAST_TIME = 1e-250  # s; no ball meets another one so soon, unless they touch

PERIODIC_DIAMETERS = 5
"""A periodic box is at least this many diameters of its largest ball wide: cells need it."""

ROOM_FOR_CELLS = 1e-8
"""Relative addition to that width, so that cells slightly wider than a ball fit five times."""

DIFFERENCE = 1e-6  # of the container's size: a step for numerical derivatives

DIRECTIONS = 2000  # directions over which the density of pair distances in a rectangle is averaged

FAR = 1e100
"""The period along an axis with walls, m: no image is ever near, and arithmetic stays finite."""

Direction = Literal["x", "y", "radius"]
"""A direction from wall to wall: along an axis, or along the radius of a circle."""

CORNERS = 180  # corners of the polygon that a circle is drawn as: it is within 0.02 % of the radius


ENDS: Mapping[str, tuple[str, str]] = {"x": ("left", "right"), "y": ("bottom", "top")}
"""The straight walls at the ends of a direction across."""


class AccessibleRegion(NamedTuple):
    """The region that the centres of balls of one radius can reach.

    area : m²
    edge : length of its edge at the walls, m; 0 without walls
    spreading : growth of the edge for each metre that all walls move outwards
    """

    area: float
    edge: float
    spreading: float


class Container(ABC):
    """A region that holds disks; its lengths (m) are fields of the subclass.

    name : the shape in a config
    title : the shape in a sentence, without an article
    keys : the fields, which are also config keys; the first is needed, others default to it. Files
        store the radius of a circle and else ``size``, which begins with the fields.
    has_wall : whether balls collide with the container
    sides : the names of its straight walls, some of ``laws.Sides``
    across : the direction across it, from wall to wall, of profiles; None without one
    periodic : whether it repeats along x and along y
    can_move : whether the container may have a finite mass
    traps : whether a ball may hit its curved wall infinitely often before it meets another one
    keeps_rotation : whether smooth fixed walls keep the balls' angular momentum about the centre
    packing_factor : the packing fraction times width times height over Σ r²
    """

    name: ClassVar[str]
    title: ClassVar[str]
    keys: ClassVar[tuple[str, ...]]
    has_wall: ClassVar[bool] = True
    sides: ClassVar[tuple[str, ...]] = ()
    across: ClassVar[Direction | None] = None
    periodic: ClassVar[tuple[bool, bool]] = (False, False)
    can_move: ClassVar[bool] = False
    traps: ClassVar[bool] = False
    keeps_rotation: ClassVar[bool] = False
    packing_factor: ClassVar[float] = math.pi

    @abstractmethod
    def __init__(self, *lengths: float) -> None:
        """The container with these lengths, m, in the order of ``keys``."""

    @classmethod
    def for_packing(cls, packing: float, squares: float) -> Self:
        """The container that balls fill to a packing fraction; ``squares`` is Σ r², m²."""
        unit = cls(*(1.0 for _ in cls.keys))
        return unit.scaled(math.sqrt(unit.packing_fraction(squares) / packing))

    @property
    @abstractmethod
    def size(self) -> tuple[float, float]:
        """Width and height of the rectangle around it, whose middle is the centre, m."""

    @property
    def period(self) -> tuple[float, float] | None:
        """After which way it repeats along x and y, m, `FAR` between walls; None without images."""
        if not any(self.periodic):
            return None
        width, height = (
            side if repeats else FAR for side, repeats in zip(self.size, self.periodic, strict=True)
        )
        return width, height

    @property
    @abstractmethod
    def outline(self) -> Floats:
        """(*n*, 2) corners of the polygon to draw, m."""

    @property
    def wall_lines(self) -> Floats:
        """(*n*, 2, 2) the sides of this polygon that are walls, m; not those where it repeats."""
        corners = self.outline
        lines = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        gaps = self.wall_gaps(lines.mean(axis=1), np.zeros(1))
        return lines[(abs(gaps) < region_integrals.AT_WALL * max(self.size)) & self.has_wall]

    @classmethod
    def keeps_drift(cls) -> bool:
        """Whether balls between its walls keep their momentum along an axis, as in a channel."""
        return cls.has_wall and any(cls.periodic)

    @property
    def lengths(self) -> dict[str, float]:
        """The fields by their key, m."""
        return {key: getattr(self, key) for key in self.keys}

    @property
    def area(self) -> float:
        """Area, m²."""
        return self.accessible(0.0).area

    @property
    def wall_length(self) -> float:
        """Length of the wall, m; 0 without walls."""
        return self.accessible(0.0).edge

    @property
    def description(self) -> str:
        """Shape and size in a sentence, with an article."""
        sizes = " and ".join(f"{key} {length:.6g} m" for key, length in self.lengths.items())
        return f"a {self.title} of {sizes}"

    def scaled(self, factor: float) -> Self:
        """The same shape with all lengths multiplied by a factor."""
        return type(self)(*(factor * length for length in self.lengths.values()))

    def packing_fraction(self, squares: float) -> float:
        """Area of balls over the area of the container; ``squares`` is Σ r², m²."""
        width, height = self.size
        return self.packing_factor * squares / (width * height)

    def ball_radius(self, packing: float, number: int) -> float:
        """Radius of equal balls that fill the container to a packing fraction, m."""
        width, height = self.size
        return math.sqrt(packing * width * height / (self.packing_factor * number))

    @abstractmethod
    def accessible(self, radius: float) -> AccessibleRegion:
        """The region that the centres of balls of a radius (m) can reach."""

    @abstractmethod
    def wall_gaps(self, places: Floats, radii: Floats) -> Floats:
        """Gap between each ball and the wall, m; negative where it sticks out.

        places, radii : (..., *N*, 2) and (*N*,), m. In a periodic box the gap is that of the
        centre to the edge of the box.
        """

    def wall_directions(self, places: Floats) -> Floats:
        """(*n*, 2) vectors of any length from each place to the nearest point of the wall.

        Here the differences of ``wall_gaps`` between near places.
        """
        shifts, at_wall = DIFFERENCE * max(self.size) * np.eye(2), np.zeros(1)
        before, after = (
            np.stack([self.wall_gaps(places + sign * shift, at_wall) for shift in shifts], axis=-1)
            for sign in (-1, 1)
        )
        return np.asarray(before - after)

    def side_lengths(self, radius: float) -> dict[str, float]:
        """Lengths of the straight walls that centres of balls of a radius (m) can reach, m.

        By the names of ``sides``. A shape with sides needs its own method.
        """
        if self.sides:
            raise NotImplementedError(f"a {self.title} needs side_lengths, see containers.py")
        return {}

    @abstractmethod
    def put_inside(self, places: Floats, radii: Floats) -> None:
        """Move balls that stick out to the wall, or in a periodic box to their image inside."""

    def nearest_image(self, offsets: Floats) -> Floats:
        """Vectors between two places (..., 2), m, by the shortest way."""
        return offsets

    def check_radii(self, radii: Floats) -> None:  # noqa: B027
        """Raise ``SceneError`` for a ball that is too large wherever it is."""

    def shortest_way(self, radii: Floats) -> float:
        """The shortest length that the time of a contact is computed from, m."""
        return 2 * float(np.min(radii))

    def longest_distance(self, radius: float) -> float:
        """Largest distance of the centres of two balls of a radius (m), m."""
        return region_integrals.longest_distance(self, radius)

    @property
    def longest_wave(self) -> float:
        """Wavelength 2π/k of the slowest shear mode that decays, m.

        A smooth wall has no flow through it and no shear stress on it.
        """
        return region_integrals.longest_wave(self)

    def ring_shares(self, places: Floats, ring_radii: Floats, radius: float) -> Floats:
        """Share of each ring that centres of balls of a radius (m) can reach; (*n*, *k*), 0 to 1.

        places, ring_radii : (*n*, 2) and (*k*,), m; the rings' centres and radii
        """
        return region_integrals.ring_shares(self, places, ring_radii, radius)

    def distance_density(self, distances: Floats, radius: float) -> Floats:
        """Density of the distance of two independent uniform centres, 1/m."""
        return region_integrals.distance_density(self, distances, radius)


@dataclass(frozen=True)
class Circle(Container):
    """The inside of a circular wall."""

    name: ClassVar[str] = "circle"
    title: ClassVar[str] = "circle"
    keys: ClassVar[tuple[str, ...]] = ("radius",)
    across: ClassVar[Direction | None] = "radius"
    can_move: ClassVar[bool] = True
    traps: ClassVar[bool] = True
    keeps_rotation: ClassVar[bool] = True
    packing_factor: ClassVar[float] = 4.0

    radius: float

    @property
    def size(self) -> tuple[float, float]:
        return (2 * self.radius, 2 * self.radius)

    @property
    def outline(self) -> Floats:
        angles = np.arange(CORNERS) * (2 * math.pi / CORNERS)
        return self.radius * np.column_stack([np.cos(angles), np.sin(angles)])

    def accessible(self, radius: float) -> AccessibleRegion:
        reach = self.radius - radius
        return AccessibleRegion(math.pi * (reach * reach), 2 * math.pi * reach, 2 * math.pi)

    def wall_gaps(self, places: Floats, radii: Floats) -> Floats:
        return np.asarray(self.radius - radii - np.hypot(places[..., 0], places[..., 1]))

    def wall_directions(self, places: Floats) -> Floats:
        return np.array(places)

    def put_inside(self, places: Floats, radii: Floats) -> None:
        farthest = self.radius - radii
        distances = np.sqrt(places[:, 0] ** 2 + places[:, 1] ** 2)
        out = distances > farthest
        places[out] *= (farthest[out] / distances[out])[:, None]

    def check_radii(self, radii: Floats) -> None:
        """Raise ``SceneError`` for a ball without any space to move, to the last digit."""
        largest = int(np.argmax(radii))
        if radii[largest] >= self.radius:
            problem = f"ball {largest} of radius {float(radii[largest])!r} m cannot move"
            where = f"in a circle of radius {self.radius!r} m"
            raise SceneError("balls", f"{problem} {where}; make it smaller", largest)

    def shortest_way(self, radii: Floats) -> float:
        return min(super().shortest_way(radii), self.radius - float(np.max(radii)))

    def longest_distance(self, radius: float) -> float:
        return 2 * self.radius - 2 * radius

    @property
    def longest_wave(self) -> float:
        """That of two opposite vortices, ψ = [J₁(kr) − J₁(kR) r/R] cos φ.

        Without shear stress ∂²ψ/∂r² = (∂ψ/∂r)/R at the wall, so 2 J₂(kR) = kR J₃(kR). The rotation
        of all balls as one never decays (see ``theory.rotation_energy``).
        """
        return 2 * math.pi * self.radius / 3.0542369282271404

    def ring_shares(self, places: Floats, ring_radii: Floats, radius: float) -> Floats:
        """By the law of cosines, with the distance of each place from the centre."""
        reach, ring = self.radius - radius, ring_radii[None, :]
        out = np.maximum(np.hypot(*places.T)[:, None], 1e-12 * reach)
        cosine = (out**2 + ring**2 - reach**2) / (2 * out * ring)
        return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)) / math.pi)

    def distance_density(self, distances: Floats, radius: float) -> Floats:
        """Disk line picking."""
        diameter = self.longest_distance(radius)
        s = np.clip(distances / diameter, 0.0, 1.0)
        return np.asarray(16 * s / math.pi * (np.arccos(s) - s * np.sqrt(1 - s * s)) / diameter)


@dataclass(frozen=True)
class Rectangle(Container):
    """A rectangle that has two walls along each axis, or repeats along it.

    A subclass needs ``name``, ``title``, ``periodic``, and the ``sides`` of its walls.
    """

    keys: ClassVar[tuple[str, ...]] = ("width", "height")

    width: float
    height: float

    @property
    def size(self) -> tuple[float, float]:
        return (self.width, self.height)

    @property
    def outline(self) -> Floats:
        corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return np.asarray(corners * self.size / 2)

    def _inner(self, radius: float) -> tuple[float, float]:
        """Sides of the rectangle that centres of balls of a radius can reach, m."""
        width, height = (
            side if repeats else side - 2 * radius
            for side, repeats in zip(self.size, self.periodic, strict=True)
        )
        return width, height

    def side_lengths(self, radius: float) -> dict[str, float]:
        width, height = self._inner(radius)
        lengths = {"left": height, "right": height, "bottom": width, "top": width}
        return {side: lengths[side] for side in self.sides}

    def accessible(self, radius: float) -> AccessibleRegion:
        width, height = self._inner(radius)
        edge = math.fsum(self.side_lengths(radius).values())
        return AccessibleRegion(width * height, edge, 0.0 if any(self.periodic) else 8.0)

    def _axis_gaps(self, places: Floats) -> Floats:
        """Gaps along both axes of places to walls, or to edges if there are none, (..., 2), m."""
        gaps = np.array(self.size) / 2 - abs(places)
        return np.where(self.periodic, math.inf, gaps) if self.has_wall else np.asarray(gaps)

    def wall_gaps(self, places: Floats, radii: Floats) -> Floats:
        nearest = np.min(self._axis_gaps(places), axis=-1)
        return np.asarray(nearest - (radii if self.has_wall else np.zeros_like(radii)))

    def put_inside(self, places: Floats, radii: Floats) -> None:
        corners = np.array(self.size) / 2 - radii[:, None]
        inside = self.nearest_image(places)
        places[:] = np.where(self.periodic, inside, np.clip(places, -corners, corners))

    def nearest_image(self, offsets: Floats) -> Floats:
        if self.period is None:
            return offsets
        return np.asarray(offsets - self.period * np.rint(offsets / np.array(self.period)))

    def check_radii(self, radii: Floats) -> None:
        """Raise ``SceneError`` for images that are nearer than five diameters, which cells need."""
        diameter = 2 * float(np.max(radii))
        for (key, side), repeats in zip(self.lengths.items(), self.periodic, strict=True):
            if repeats and side < PERIODIC_DIAMETERS * diameter * (1 + ROOM_FOR_CELLS):
                problem = f"the {self.title} is under {PERIODIC_DIAMETERS} diameters of its balls"
                sizes = f"{side:.6g} m, with a diameter of {diameter:.6g} m"
                reason = f"this engine needs {PERIODIC_DIAMETERS} cells each way, each a ball wide"
                advice = "use smaller balls, more of them, or a larger box"
                raise SceneError(f"container.{key}", f"{problem} ({sizes}): {reason}; {advice}")

    def longest_distance(self, radius: float) -> float:
        across, up = (
            side / 2 if repeats else side
            for side, repeats in zip(self._inner(radius), self.periodic, strict=True)
        )
        return float(np.hypot(across, up))

    def wall_directions(self, places: Floats) -> Floats:
        gaps = self._axis_gaps(places)
        across = gaps[:, 0] <= gaps[:, 1]
        return np.where(np.column_stack([across, ~across]), np.sign(places), 0.0)

    @property
    def longest_wave(self) -> float:
        """Without walls the longer side; between two walls that of opposite flows along them.

        The latter is v = sin(πx/w) in a channel. A box has one vortex, ψ = sin(πx/w) sin(πy/h).
        """
        if not self.has_wall:
            return max(self.size)
        if any(self.periodic):
            return 2 * self.size[self.periodic.index(False)]
        return 2 / math.hypot(1 / self.width, 1 / self.height)

    def ring_shares(self, places: Floats, ring_radii: Floats, radius: float) -> Floats:
        """Without the arcs beyond each wall; those beyond two walls at a corner count once.

        Of radii up to half of the length of a side that repeats, so that images are apart.
        """
        corner = np.where(self.periodic, math.inf, np.array(self.size) / 2 - radius)
        gaps = np.stack([corner - places, corner + places])[..., None]
        beyond = np.arccos(np.clip(gaps / ring_radii, -1.0, 1.0))  # half arcs by side, place, axis
        left = 2 * math.pi - 2 * beyond.sum(axis=(0, 2))
        for across in beyond[:, :, 0]:
            for up in beyond[:, :, 1]:
                left += np.clip(across + up - math.pi / 2, 0.0, 2 * np.minimum(across, up))
        return np.asarray(left / (2 * math.pi))

    def distance_density(self, distances: Floats, radius: float) -> Floats:
        """The product of the densities of both components, averaged over all directions."""
        angles = (np.arange(DIRECTIONS) + 0.5) * (math.pi / 2 / DIRECTIONS)
        product = np.ones((len(distances), DIRECTIONS))
        axes = (np.cos(angles), np.sin(angles)), self._inner(radius), self.periodic
        for component, side, repeats in zip(*axes, strict=True):
            along = distances[:, None] * component
            if repeats:
                product *= np.where(along <= side / 2, 2 / side, 0.0)
            else:
                product *= 2 * np.maximum(side - along, 0.0) / side**2
        return np.asarray(distances * product.mean(axis=1) * (math.pi / 2))


@dataclass(frozen=True)
class Box(Rectangle):
    """A rectangle inside four straight walls."""

    name: ClassVar[str] = "box"
    title: ClassVar[str] = "box"
    sides: ClassVar[tuple[str, ...]] = ("left", "right", "bottom", "top")
    across: ClassVar[Direction | None] = "x"


@dataclass(frozen=True)
class PeriodicBox(Rectangle):
    """A rectangle that repeats for ever in both directions."""

    name: ClassVar[str] = "periodic"
    title: ClassVar[str] = "periodic box"
    has_wall: ClassVar[bool] = False
    periodic: ClassVar[tuple[bool, bool]] = (True, True)


@dataclass(frozen=True)
class Channel(Rectangle):
    """A rectangle between a left and a right wall that repeats for ever upwards and downwards."""

    name: ClassVar[str] = "channel"
    title: ClassVar[str] = "channel"
    sides: ClassVar[tuple[str, ...]] = ("left", "right")
    across: ClassVar[Direction | None] = "x"
    periodic: ClassVar[tuple[bool, bool]] = (False, True)


SHAPES: dict[str, type[Container]] = {
    shape.name: shape for shape in (Circle, Box, PeriodicBox, Channel)
}
"""The shapes by their word in a config and in files; the first is the default."""
