"""Kernels are compiled once on a machine; from then on they are files, and Numba stays away."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import namedtuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import report_scene

from snooker_cli.engine import compiling, replay, simulate
from snooker_cli.engine.compiling import COMPILED, Kernel
from snooker_cli.engine.endings import NOTHING_LEFT
from snooker_cli.engine.machine_code import MachineCode, file_name, flattened, load

if not COMPILED:
    pytest.skip("nothing is compiled here", allow_module_level=True)

Pair = namedtuple("Pair", "floats integer")


def sum_of(floats, pair, nothing, flag, start):
    """Something of every kind of argument."""
    total = start + pair.integer
    for row in range(floats.shape[0]):
        for column in range(floats.shape[1]):
            total += floats[row, column] * pair.floats[column]
    if nothing is None and flag:
        floats[0, 0] = total
    return total


def arguments(order: str = "C") -> tuple[Any, ...]:
    floats = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], order=order)
    return floats, Pair(np.array([1.0, 10.0, 100.0]), 7), None, True, 0.5


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty one."""
    monkeypatch.setattr(compiling, "CACHE", tmp_path / "cache")
    return tmp_path / "cache"


def files(cache: Path) -> list[Path]:
    return sorted(cache.iterdir())


def test_a_kernel_is_its_function(cache: Path) -> None:
    """With arrays in rows, in columns and with gaps, each of which is compiled for itself."""
    kernel = Kernel(sum_of)
    for floats in (arguments()[0], arguments("F")[0], np.repeat(arguments()[0], 2, axis=1)[:, ::2]):
        expected = sum_of(floats.copy(), *arguments()[1:])
        assert kernel(floats, *arguments()[1:]) == expected == floats[0, 0]
    assert kernel.__name__ == "sum_of"
    assert len(files(cache)) == 3


def test_what_is_in_a_file_is_not_compiled_again(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = Kernel(sum_of)(*arguments())
    monkeypatch.setattr("snooker_cli.engine.compiler.machine_code_of", None)
    assert Kernel(sum_of)(*arguments()) == expected
    with pytest.raises(TypeError, match="not callable"):
        Kernel(sum_of)(*arguments("F"))


@pytest.mark.parametrize("damage", ["flipped", "cut", "empty", "foreign"])
def test_a_damaged_file_is_compiled_anew(cache: Path, damage: str) -> None:
    expected = Kernel(sum_of)(*arguments())
    (path,) = files(cache)
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[-100] ^= 4
    damaged = {"flipped": flipped, "cut": whole[:-50], "empty": b"", "foreign": b"[1, 2]\nabc"}
    path.write_bytes(damaged[damage])
    assert load(path) is None
    assert Kernel(sum_of)(*arguments()) == expected
    assert load(path) is not None


def test_where_nothing_can_be_kept_it_is_compiled_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(compiling, "CACHE", tmp_path / "file" / "cache")
    assert Kernel(sum_of)(*arguments()) == sum_of(*arguments())


def test_events_and_summaries_have_one_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the one has no rows in its grid and the other none in its columns of events."""
    from snooker_cli.engine import allpairs

    called = []
    monkeypatch.setattr(allpairs.advance, "_codes", _Recording(called))
    for summary in (False, True):
        simulate(report_scene(), collisions=5, summary=summary)
    assert len(called) >= 2
    assert len(set(called)) == 1


class _Recording(dict[Any, Any]):
    """No code but one that has the kernel stop; and which kinds it was asked for."""

    def __init__(self, asked: list[Any]) -> None:
        super().__init__()
        self.asked = asked

    def get(self, kinds: Any, default: Any = None) -> Any:
        self.asked.append(kinds)
        return lambda arguments, values: NOTHING_LEFT


def test_what_returns_a_tuple_is_called_by_numba(cache: Path) -> None:
    assert Kernel(lambda a, b: (b, a))(1, 2.0) == (2.0, 1)
    assert not cache.exists()


def test_what_takes_other_parameters_than_it_seems_is_called_by_numba(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As it may be with a Numba that is yet to come."""
    monkeypatch.setattr(MachineCode, "fits", lambda self, arguments: False)
    assert Kernel(sum_of)(*arguments()) == sum_of(*arguments())


def test_what_needs_a_function_that_is_not_there_is_called_by_numba(cache: Path) -> None:
    """To be linked with it would be the end of the process."""
    expected = Kernel(sum_of)(*arguments())
    (path,) = files(cache)
    head, _, code = path.read_bytes().partition(b"\n")
    head = json.dumps(json.loads(head) | {"needed": ["no_such_function"]}).encode()
    path.write_bytes(head + b"\n" + code)
    assert Kernel(sum_of)(*arguments()) == expected


def test_with_a_numba_that_does_not_load_it_is_plain_python(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr("snooker_cli.engine.compiler", raising=False)
    monkeypatch.setitem(sys.modules, "snooker_cli.engine.compiler", None)
    assert Kernel(sum_of)(*arguments()) == sum_of(*arguments())


def test_what_is_no_number_is_refused(cache: Path) -> None:
    with pytest.raises(TypeError, match="a kernel takes no str: 'seven'"):
        Kernel(sum_of)("seven", *arguments()[1:])


def test_numbers_of_numpy_are_numbers(cache: Path) -> None:
    """They need no code of their own."""
    floats, pair, *_ = arguments()
    expected = sum_of(*arguments())
    assert Kernel(sum_of)(*arguments()) == expected
    kernel = Kernel(sum_of)
    assert kernel(floats, pair._replace(integer=np.int64(7)), None, np.True_, 0.5) == expected
    assert len(files(cache)) == 1


def test_an_exception_in_machine_code_is_one_here(cache: Path) -> None:
    def fails(number: int) -> int:
        if number > 3:
            raise ValueError("too large")
        return number

    kernel = Kernel(fails)
    assert kernel(3) == 3
    with pytest.raises(RuntimeError, match="ended with"):
        kernel(4)


def test_kinds_and_values_of_arguments() -> None:
    floats, pair, *_ = given = arguments()
    kinds, values = flattened(given)
    rows, floating = 0x1 | 0x100 | 0x400, np.dtype(float)
    of_pair = "Pair", "(", floating, 1, rows, "i64", ")"
    assert kinds == (floating, 2, rows, *of_pair, "ptr", "i8", "double")
    address = floats.ctypes.data
    assert values[:9] == [None, None, 6, 8, address, 2, 3, 24, 8]
    assert values[9:16] == [None, None, 3, 8, pair.floats.ctypes.data, 3, 8]
    assert values[16:] == [7, None, True, 0.5]
    assert flattened((floats.T, floats[:, ::2], floats[:0]))[0][2::3] == (
        0x2 | 0x100 | 0x400,
        0x100 | 0x400,
        rows,
    )
    floats.flags.writeable = False
    kinds = flattened((floats, np.float32(1), np.float64(2)))[0]
    assert kinds == (floating, 2, 0x1 | 0x100, "float", "double")


def test_other_arguments_processors_and_settings_have_other_files() -> None:
    program = "from snooker_cli.engine.machine_code import *; print(file_name(load, ('i64',)))"
    here = file_name(load, ("i64",))
    assert here.startswith("engine.machine_code.load-")
    assert here != file_name(load, ("double",))
    assert output_of(program).strip() == here
    assert output_of(program, NUMBA_NUM_THREADS="1").strip() == here
    assert output_of(program, NUMBA_CPU_NAME="generic").strip() != here


def test_another_source_has_another_file(tmp_path: Path) -> None:
    names = set()
    for number in (1, 2, 2):
        path = tmp_path / f"{len(names)}.py"
        path.write_text(f"def constant(): return {number}\n")
        found: dict[str, Any] = {"__name__": "made"}
        exec(compile(path.read_text(), path, "exec"), found)
        names.add(file_name(found["constant"], ()))
    assert len(names) == 2


def test_what_is_compiled_is_simulated_without_numba() -> None:
    """To import it takes longer than most runs."""
    program = """
import sys
from scenes import report_scene
from snooker_cli.engine import replay, simulate
trace = simulate(report_scene(), collisions=5)
replay(trace, [trace.stop.time])
print([name for name in ("numba", "scipy") if name in sys.modules])
"""
    trace = simulate(report_scene(), collisions=5)
    replay(trace, [trace.stop.time])
    assert output_of(program) == "[]\n"


def output_of(program: str, **environment: str) -> str:
    """What a Python of its own prints, in the tests' folder."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parent,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout
