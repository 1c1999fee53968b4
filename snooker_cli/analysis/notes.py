"""What a reader of a point's results has to know about their values.

Why a theory is missing is in ``theories.absences``.
"""

import math
from collections.abc import Iterator

import numpy as np

from snooker_cli import facts, two_temperatures
from snooker_cli.analysis import observables, quantities, structure
from snooker_cli.analysis.decay import Note
from snooker_cli.analysis.gas import is_heavy
from snooker_cli.analysis.measurement import Measurement
from snooker_cli.analysis.theories import BALANCE, disk_ratios, holding, theory_of
from snooker_cli.facts import traits_of
from snooker_cli.formatting import with_error
from snooker_cli.scene import Scene
from snooker_cli.theory import FINITE

MOST_ROTATION = 0.01
"""Share of the energy in a common rotation above which a note says how to start without it."""

TURNING = (
    f"{FINITE}: the angular momenta are those of equilibrium; rings have others "
    "(7 balls: rates 4 % off)"
)
"""What a reader of the theory for N balls in a circle has to know."""

EQUAL_SPEEDS = (
    "Haff's α: theory is for mixed speeds; equal speeds lose less at first "
    "(`start: random` and `speeds: maxwell` start mixed)"
)


def of_scene(scene: Scene) -> Iterator[Note]:
    """What walls and their absence change, and what theories assume."""
    traits = traits_of(scene)
    if facts.hold(traits, "keeps_turning", "several") and is_heavy(scene) and _on_rings(scene):
        yield Note(TURNING, model=FINITE)
    if facts.hold(traits, "no_walls"):
        yield Note(observables.NO_WALLS, "pressure, temperature, PV/NT by the virial")
    yield from _of_impulses(scene)
    species = [
        entry.model for entry in holding(traits) if entry.quantity == quantities.SPECIES_RATIO
    ]
    if species:
        first, second = structure.species_names(scene)
        text = f"T₁/T₂: mean after the relaxation, without the flow; 1 is {first}, 2 is {second}"
        if two_temperatures.EQUAL_RATES in species:
            why = "fails at a small CoR and in clusters"
            text += f"; a uniform gas with Maxwell's velocities, which {why}"
        yield Note(text, quantities.SPECIES_RATIO.name)
    if facts.hold(traits, "rough"):
        ratio = quantities.SPIN_RATIO.name
        text = f"{ratio}: mean over the second half of the collisions"
        if theory_of(traits, quantities.SPIN_RATIO, two_temperatures.MEAN_FIELD):
            text += "; in the theory, velocities and spins are independent"
        yield Note(text, ratio)
    speeds = np.linalg.norm(scene.velocities, axis=1)
    has_theory = theory_of(traits, quantities.HAFF_RATE, FINITE) is not None
    if has_theory and np.ptp(speeds) <= 1e-9 * np.max(speeds):
        yield Note(EQUAL_SPEEDS, quantities.HAFF_RATE.name)


def of_steady_part(measurement: Measurement, first: int) -> Iterator[Note]:
    """What a reader of means from a window on has to know."""
    scene, parts = measurement.scene, quantities.ACROSS.name
    yield Note("the kurtosis of speeds is 2 (1 + a2)", quantities.KURTOSIS.name)
    if np.all(np.isfinite(measurement.across)):
        across = "the radius" if scene.container.across == "radius" else scene.container.across
        yield Note(f"{parts}: motion along {across}, over the rest", parts)
    yield from _of_impulses(scene)
    if theory_of(scene, quantities.TEMPERATURE, BALANCE):
        text = f"{BALANCE}: for a uniform gas that loses little on the way across"
        yield Note(text, quantities.TEMPERATURE.name, BALANCE)
    if facts.hold(scene, "driven") and np.all(np.isfinite(measurement.rotation_energy)):
        yield Note(_rotation(measurement, first))


def _of_impulses(scene: Scene) -> Iterator[Note]:
    """What a reader of PV/NT of hard disks has to know if collisions between them lose energy."""
    disks = disk_ratios(scene)
    if disks and facts.hold(scene, "lossy_cor"):
        text = "hard disks: an impulse between balls is (1 + CoR)/2 of an elastic one; uniform gas"
        about = "pressure, PV/NT, PV/NT by the virial, pressure by the virial"
        yield Note(text, about, ", ".join(disks))


def _on_rings(scene: Scene) -> bool:
    """Whether two or more balls are on even rings, 6k on the k-th, as `balls.rings` places them."""
    rings = round((math.sqrt(12 * scene.number - 3) - 3) / 6)
    if rings < 1 or 1 + 3 * rings * (rings + 1) != scene.number:
        return False
    distances = np.sort(np.hypot(*(scene.positions - scene.container_position).T))
    ranks = np.repeat(np.arange(rings + 1), [1, *(6 * k for k in range(1, rings + 1))])
    return np.allclose(distances, distances[-1] * ranks / rings, rtol=observables.ROUNDING)


def _rotation(measurement: Measurement, first: int) -> str:
    """A sentence on the share of the energy that a smooth driven circle keeps in a rotation."""
    energy = measurement.windows.from_window(first).kinetic_energy
    share, error = observables.mean_and_error(measurement.rotation_energy / energy)
    if share < observables.ROUNDING:
        return "common rotation: none, and a smooth circle adds none"
    part = f"{with_error(100 * share, 100 * error)} % of the energy"
    if share <= MOST_ROTATION:
        return f"common rotation: {part}; a smooth circle keeps it"
    why = "a smooth circle keeps it, so T depends on the start"
    return f"common rotation: {part}; {why} (`common_rotation: false` starts without it)"
