"""The memory of the page's engine is laid out as Numba passes arguments."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from llvmlite import binding as llvm

from snooker_cli.engine import jit, page_kernels
from snooker_cli.engine.page_kernels import BOUNDARIES, example
from snooker_cli.engine.webassembly import NUMBER, TYPES, Caller, layout, signed_leb


def named_arguments(place: str, part: Any) -> Iterator[tuple[str, str]]:
    """Name and type of each argument, as Numba names them after places in tuples and arrays."""
    if isinstance(part, tuple):
        for k, element in enumerate(part):
            yield from named_arguments(f"{place}.{k}", element)
        return
    of_part = TYPES[np.asarray(part).dtype.name]
    if not isinstance(part, np.ndarray):
        yield place, of_part
        return
    for k, what in enumerate(("ptr", "ptr", "i64", "i64", "ptr")):
        yield f"{place}.{k}", what
    for k in (5, 6):
        for axis in range(part.ndim):
            yield f"{place}.{k}.{axis}", "i64"


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_arguments_are_those_that_numba_compiled(boundary: str) -> None:
    page = example(boundary, NUMBER)
    code, name = jit.code_of(page_kernels.show, page)
    compiled = list(llvm.parse_assembly(code).get_function(name).arguments)[2:]
    expected = list(named_arguments("arg.page", page))
    assert [argument.name for argument in compiled] == [name for name, _ in expected]
    types = [str(argument.type) for argument in compiled]
    assert ["ptr" if "*" in what else what for what in types] == [what for _, what in expected]
    caller = Caller("show", code, name)
    passed = [list(caller.arguments(part)) for part in layout(boundary)]
    assert sum(map(len, passed)) == len(compiled)


def test_lengths_of_the_layout_are_those_of_other_numbers_of_balls() -> None:
    page = example("free_circle", 40)
    lengths = {"number": 40, "bodies": 41, "padded": 48}
    for part in layout("free_circle"):
        value: Any = page
        for field in part.name.split("."):
            value = getattr(value, field)
        if part.shape is not None:
            assert value.shape == tuple(lengths.get(str(length), length) for length in part.shape)


def test_numbers_with_a_sign() -> None:
    """As in https://en.wikipedia.org/wiki/LEB128."""
    assert [signed_leb(value) for value in (2, 63, 64, 127, 128)] == [
        b"\x02",
        b"\x3f",
        b"\xc0\x00",
        b"\xff\x00",
        b"\x80\x01",
    ]
