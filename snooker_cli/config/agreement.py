"""What the keys of a container and of the balls in it must agree on."""

import math
from collections.abc import Iterator

from snooker_cli.config.balls import BallList, Container, Gas, Rings, Species
from snooker_cli.config.paths import KeyPath
from snooker_cli.config.problems import Complaint
from snooker_cli.config.quantities import MAX_BALLS

AnyBalls = Rings | BallList | Gas | tuple[Species, ...]


def faults_of_container(container: Container) -> Iterator[Complaint]:
    """What is wrong with a container whatever the balls are."""
    shape = container.shape
    if shape == "circle":
        for key, value in (("width", container.width), ("height", container.height)):
            if value is not None:
                sentence = f"a circle has no {key}; give its radius, or set shape: box or periodic"
                yield Complaint(("container", key), sentence, about_key=True)
        return
    box = f"a {shape} box" if shape == "periodic" else "a box"
    if container.radius is not None:
        sentence = f"{box} has no radius; give width and height, or remove shape for a circle"
        yield Complaint(("container", "radius"), sentence, about_key=True)
    if container.height is not None and container.width is None:
        sentence = f"the height of {box} is given without its width; add width"
        yield Complaint(("container", "height"), sentence, about_key=True)
    if math.isfinite(container.mass):
        sentence = f"{box} is fixed and has no mass; remove it, or remove shape for a circle"
        yield Complaint(("container", "mass"), sentence, about_key=True)


def faults_of_slide(container: Container) -> Iterator[Complaint]:
    """Balls slide along the fixed wall of a circle and nowhere else."""
    if container.shape != "circle":
        wall = "walls are straight" if container.shape == "box" else "there is no wall"
        sentence = (
            f"slide is for a circle, and with shape: {container.shape} {wall}; set collapse: stop, "
            "{tc: 0.01} or {elastic_below: 1e-6}"
        )
        yield Complaint(("collapse",), sentence)
    elif math.isfinite(container.mass):
        sentence = (
            f"slide needs a fixed wall, and container.mass is {container.mass:g} kg; remove it, or "
            "set collapse: stop, {tc: 0.01} or {elastic_below: 1e-6}"
        )
        yield Complaint(("collapse",), sentence)


def faults_of_balls(container: Container, balls: AnyBalls) -> Iterator[Complaint]:
    """What is wrong with balls in a sound container."""
    if isinstance(balls, Rings | BallList):
        yield from _faults_of_places(container, balls)
        return
    species = balls if isinstance(balls, tuple) else (balls,)
    paths: list[KeyPath] = (
        [("balls", k) for k in range(len(balls))] if isinstance(balls, tuple) else [("balls",)]
    )
    if (number := sum(each.count for each in species)) > MAX_BALLS:
        sentence = f"the species have {number:,} balls in all, of at most {MAX_BALLS:,}; give fewer"
        yield Complaint(("balls",), sentence)
    yield from _faults_of_starts(species, paths)
    if container.shape == "periodic" and sum(each.count for each in species) == 1:
        sentence = "one ball in a periodic box meets nothing; give two or more"
        yield Complaint((*paths[0], "count"), sentence)
    yield from _faults_of_sizes(container, balls, paths)


def _size_key(container: Container) -> str:
    return "radius" if container.shape == "circle" else "width"


def _faults_of_places(container: Container, balls: Rings | BallList) -> Iterator[Complaint]:
    """Rings need a circle, and balls that have their places a container that has its size."""
    kind = "rings" if isinstance(balls, Rings) else "list"
    if kind == "rings" and container.shape != "circle":
        sentence = f"rings are for a circle, not for shape: {container.shape}; give count or list"
        yield Complaint(("balls", "rings"), sentence, about_key=True)
        return
    if container.packing is not None:
        sentence = f"packing is for balls given by count, not for {kind}; remove it"
        yield Complaint(("container", "packing"), sentence, about_key=True)
    key = _size_key(container)
    if container.size is None:
        inner = "inner radius of the circle, m" if key == "radius" else "inner width of the box, m"
        sentence = f"the key is missing; add it: {inner}"
        yield Complaint(("container", key), sentence, about_key=True)


def _faults_of_starts(species: tuple[Species, ...], paths: list[KeyPath]) -> Iterator[Complaint]:
    """All species start alike."""
    said = [(each.start, path) for each, path in zip(species, paths, strict=True) if each.start]
    for start, path in said[1:]:
        if start != said[0][0]:
            sentence = (
                f"{start} is given where another species has {said[0][0]}; all species start "
                "alike, so say it once"
            )
            yield Complaint((*path, "start"), sentence)


def _faults_of_sizes(
    container: Container, balls: Gas | tuple[Species, ...], paths: list[KeyPath]
) -> Iterator[Complaint]:
    """Of the container's size, the balls' radii and packing two are given."""
    packings: list[KeyPath] = [("container", "packing")] if container.packing is not None else []
    if isinstance(balls, Gas) and balls.packing is not None:
        packings.append(("balls", "packing"))
    if len(packings) == 2:
        sentence = "packing is given here and as container.packing; keep one of them"
        yield Complaint(("balls", "packing"), sentence, about_key=True)
        return
    species = balls if isinstance(balls, tuple) else (balls,)
    without = [path for each, path in zip(species, paths, strict=True) if each.radius is None]
    if without and len(without) < len(species):
        sentence = (
            "the radius is missing, where other species have one; give it in each species, or in "
            "none if one radius of all is to follow from packing"
        )
        yield from (Complaint((*path, "radius"), sentence, about_key=True) for path in without)
        return
    size = f"container.{_size_key(container)}"
    given = [
        name
        for name, there in (
            (size, container.size is not None),
            ("radius of the balls", not without),
            ("packing", bool(packings)),
        )
        if there
    ]
    if len(given) == 3:
        sentence = (
            f"packing follows from {size} and the radius of the balls, which are given too; remove "
            "one of the three"
        )
        yield Complaint(packings[0], sentence, about_key=True)
    elif len(given) < 2:
        sentence = (
            f"of {size}, radius of the balls and packing two are needed, and the third follows; "
            f"{given[0] if given else 'none'} is given, so add {'one' if given else 'two'}"
        )
        yield Complaint(("balls",), sentence)
