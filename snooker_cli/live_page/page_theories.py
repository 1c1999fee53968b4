"""The facts of a gas and the theories that a page draws, as a script.

A page changes its scene without Python. So it has the functions of ``facts.py`` and the values of
the table of theories in JavaScript, see ``javascript.py``.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from snooker_cli import facts, theory
from snooker_cli.analysis import observables, theories
from snooker_cli.analysis import quantities as q
from snooker_cli.analysis.gas import HEAT, independent_velocities
from snooker_cli.analysis.quantities import Quantity
from snooker_cli.facts import Traits
from snooker_cli.live_page.javascript import Formulas, camel
from snooker_cli.scene import Scene
from snooker_cli.theory import FINITE, IDEAL


class Drawn(NamedTuple):
    """A theory of a page, or what it draws to compare with.

    model : its name in the table of theories; empty of what is in no table
    needs : the facts that must be true of a gas
    value : as of `theories.Theory`; others have it of a scene and a speed, or of traits
    """

    model: str
    needs: tuple[str, ...]
    value: Callable[..., Any]


TABLE: dict[str, dict[str, tuple[Quantity, str]]] = {
    "pressure": {"ideal": (q.PRESSURE, IDEAL), "finite": (q.PRESSURE, FINITE)},
    "ratio": {"ideal": (q.RATIO, IDEAL), "finite": (q.RATIO, FINITE)},
    "alpha": {"finite": (q.HAFF_RATE, FINITE)},
}
"""The theories of the table, by the names that a page uses for quantities and models."""

WALL_NEEDS = "warm_walls", "one_wall_temperature", "smooth"
"""What `wall_energy` needs."""

TYPE_FACTS = "elastic", "warm_walls", "cooling"
"""Facts that a page asks for other reasons."""

FORMULAS = observables.meeting_temperature, theory.haff_ratio
"""What a page measures with, and the law that it fits."""


def maxwell_density(_scene: Scene, speed: float) -> float:
    """Maxwell's density of the speed over √(2T/m)."""
    return theory.maxwell_speed_density(speed, HEAT)


def fixed_energy_density(scene: Scene, speed: float) -> float:
    """The density of the speed over √(2T/m) of balls that share a fixed energy."""
    return theory.fixed_energy_speed_density(speed, independent_velocities(scene), HEAT)


def wall_energy(gas: Traits) -> float:
    """The energy that elastic balls have from the wall, J.

    A gas that collisions cool is colder, and spins of rough balls take a part.
    """
    return gas.number * gas.wall_temperature


def drawn() -> dict[str, dict[str, Drawn]]:
    """What a page draws, by its names for quantities and models."""
    found = {
        name: {short: _of_table(*about) for short, about in models.items()}
        for name, models in TABLE.items()
    }
    fixed = _of_table(q.KURTOSIS, theories.FIXED)
    return found | {
        "speeds": {
            "maxwell": Drawn(theories.MAXWELL, (), maxwell_density),
            "fixed": fixed._replace(value=fixed_energy_density),
        },
        "energy": {"wall": Drawn("", WALL_NEEDS, wall_energy)},
    }


def _of_table(quantity: Quantity, model: str) -> Drawn:
    """The only entry of the table with this quantity and model."""
    entries = theories.OWN
    (entry,) = (entry for entry in entries if (entry.quantity, entry.model) == (quantity, model))
    return Drawn(entry.model, entry.needs, entry.value)


def theories_source() -> str:
    """The script: ``FACTS``, ``THEORIES`` and ``FORMULAS`` by their names."""
    formulas = Formulas()
    holds = [f"{name}: {formulas.name_of(facts.FACTS[name].holds)}" for name in TYPE_FACTS]
    lists = [f"{name}: {{ {', '.join(_of(formulas, name))} }}" for name in drawn()]
    helpers = map(formulas.name_of, FORMULAS)
    result = f"[{{ {', '.join(holds)} }}, {{ {', '.join(lists)} }}, {{ {', '.join(helpers)} }}]"
    return (
        f"const [FACTS, THEORIES, FORMULAS] = (() => {{\n{formulas.text}return {result};\n}})();\n"
    )


def _of(formulas: Formulas, quantity: str) -> Iterator[str]:
    """The theories of a quantity as fields of an object."""
    for name, entry in drawn()[quantity].items():
        needs = ", ".join(formulas.name_of(facts.FACTS[need].holds) for need in entry.needs)
        value = formulas.name_of(entry.value, camel(f"{quantity}_{name}"))
        model = f"model: phrase`{entry.model}`, " if entry.model else ""
        yield f"{name}: {{ {model}needs: [{needs}], value: {value} }}"
