"""Laws of installed packages in kernels: a class of tuples for each set of laws.

The class decides which functions a kernel has, as with surfaces and frames. Its name has a hash of
the laws' sources. So a stored kernel of other sources is never taken, and one without such laws has
no code for them.
"""

import hashlib
import re
from collections import namedtuple
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from snooker_cli.engine.jit import (
    called_by_kernels,
    inlined,
    kernel_options,
    learn_functions,
    set_up_numba,
)
from snooker_cli.engine.kernel_state import Floats, Part
from snooker_cli.errors import SceneError
from snooker_cli.laws import LAWS, MOST_NUMBERS, Law, PackageLaw

Formula: TypeAlias = Callable[..., float]

FIRST_KIND = len(LAWS)
"""The number of the first of these laws in ``Setup.laws``; others follow by their names."""

TRIED = np.logspace(-12, 12, 2401)  # m/s, a hundred in each decade


@called_by_kernels
class PackageLaws(Part):
    """The laws of packages that a scene has."""

    def restitution(self, kind: float, row: int, speed: float) -> float:
        """e at a normal speed, m/s, of the law with this number, with numbers of a row."""
        return 1.0


class NoPackageLaws(PackageLaws, NamedTuple("NoPackageLaws", [("nothing", float)])):
    """The laws of snooker alone."""


def laws_of_packages(laws: Sequence[Law]) -> list[PackageLaw]:
    """One of each law of a package among laws, in the order of their numbers."""
    named = {law.name: law for law in laws if isinstance(law, PackageLaw)}
    return [named[name] for name in sorted(named)]


def kinds_of(laws: Sequence[Law]) -> dict[str, int]:
    """The numbers of the laws of packages by their names."""
    return {law.name: FIRST_KIND + k for k, law in enumerate(laws_of_packages(laws))}


def package_laws(laws: Sequence[Law], rows: int) -> PackageLaws:
    """The laws of packages among those of the rows of ``Setup.laws``. Raises ``SceneError``."""
    own = laws_of_packages(laws)
    if not own:
        return NoPackageLaws(0.0)
    for used in own:
        check(used)
    numbers = np.zeros((rows, MOST_NUMBERS))
    for row, law in enumerate(laws):
        if isinstance(law, PackageLaw):
            numbers[row, : len(law.values)] = law.values
    made: PackageLaws = class_of(identity_of(laws))(numbers)
    return made


def identity_of(laws: Sequence[Law]) -> tuple[tuple[str, type[PackageLaw]], ...]:
    """What the kernels of some laws depend on: the origin of each law of a package."""
    return tuple((law.origin, type(law)) for law in laws_of_packages(laws))


def hash_of(laws: tuple[tuple[str, type[PackageLaw]], ...]) -> str:
    """Names the laws; empty if there are none."""
    text = " ".join(f"{origin} {law.name}" for origin, law in laws)
    return text and hashlib.sha256(text.encode()).hexdigest()[:16]


@cache  # a replay of each repeat asks for the same law
def check(law: PackageLaw) -> None:
    """Raise ``SceneError`` for a law that is not installed, or whose e is not from 0 to 1."""
    if law.problem:
        advice = "install it as it was, or run the config anew in another folder"
        raise SceneError("law", f"{law.problem}; {advice}")
    where = f"the law {law.name} of {law.origin.split()[0]}"
    if "print" in law.restitution.__code__.co_names:  # a compiled print waits for Python for ever
        raise SceneError("law", f"{where} prints; remove it")
    for speed in TRIED.tolist():
        e = law.cor_at(speed)
        if not 0.0 <= e <= 1.0:
            raise SceneError("law", f"{where} has the CoR {e!r} at {speed:.3g} m/s; correct it")
    _compile(law, where)


def _compile(law: PackageLaw, where: str) -> None:
    """Compile a law alone. Raises ``SceneError`` for what kernels cannot have."""
    numba = set_up_numba()
    arguments = (numba.float64,) * (1 + len(law.numbers()))
    try:
        numba.njit(arguments, **kernel_options())(law.restitution)
    except Exception as error:  # the code of Numba for a function may raise anything
        lines = [line.strip(" .") for line in str(error).splitlines() if line.strip(" .")]
        reason = lines[min(1, len(lines) - 1)]  # the first one names a step of Numba
        if NRT in str(error):
            reason = "it makes a list, a text or another object"
        file = re.escape(Path(law.restitution.__code__.co_filename).name)
        place = re.search(rf'{file}(?:", line | \()(\d+)', str(error))
        at = f", line {place[1]}" if place else ""
        raise SceneError(
            "law", f"{where} cannot be compiled ({reason}{at}); use what docs/extending.md lists"
        ) from None


NRT = "NRT required"  # in the error of Numba for code that needs memory


@cache
def class_of(laws: tuple[tuple[str, type[PackageLaw]], ...]) -> Any:
    """The class of tuples with some laws. Python and stored kernels find it in this module."""
    name = f"PackageLaws_{hash_of(laws)}"
    formula: Formula = _elastic
    for place, (_, law) in reversed(list(enumerate(laws))):
        own = inlined(_OF_ROW[len(law.numbers())](inlined(law.restitution)))
        formula = inlined(_either(float(FIRST_KIND + place), own, formula))
    chosen = formula

    def restitution(self: Any, kind: float, row: int, speed: float) -> float:
        return chosen(kind, speed, self.numbers[row])

    made = _tuples(name, {"restitution": restitution})
    learn_functions()
    return made


def _tuples(name: str, members: dict[str, Any]) -> Any:
    """A class of tuples with the numbers of laws, which this module has from now on.

    If a stored kernel has asked for it before, that class gets the members: with another class of
    the name, the kernel would never fit, and would be compiled again by each process.
    """
    if known := globals().get(name):
        for member, value in members.items():
            setattr(known, member, value)
        return known
    fields: Any = namedtuple(name, ["numbers"])  # type: ignore[misc]  # the name has a hash
    own = {"__module__": __name__, "__qualname__": name, **members}
    globals()[name] = made = type(name, (PackageLaws, fields), own)
    return made


def __getattr__(name: str) -> Any:
    """A class that a stored kernel has: of laws that this process does not use, it is empty."""
    if not name.startswith("PackageLaws_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _tuples(name, {})


@inlined
def _elastic(_kind: float, _speed: float, _numbers: Floats) -> float:
    return 1.0


def _either(own: float, formula: Formula, others: Formula) -> Formula:
    """A formula for one kind, and others."""

    def restitution(kind: float, speed: float, numbers: Floats) -> float:
        return formula(speed, numbers) if kind == own else others(kind, speed, numbers)

    return restitution


def _of_two(formula: Formula) -> Formula:
    return lambda speed, row: formula(speed, row[0], row[1])


def _of_three(formula: Formula) -> Formula:
    return lambda speed, row: formula(speed, row[0], row[1], row[2])


def _of_four(formula: Formula) -> Formula:
    return lambda speed, row: formula(speed, row[0], row[1], row[2], row[3])


_OF_ROW = {2: _of_two, 3: _of_three, 4: _of_four}
