"""Kernels are compiled once for their sources and types of arguments, and kept in a cache."""

from __future__ import annotations

import gc
import importlib
import inspect
import logging
import os
import pkgutil
import shutil
import stat
import sys
import threading
from collections import namedtuple
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from command_line import output_of

import snooker_cli
from snooker_cli import engine
from snooker_cli.engine import compilation, jit, linked_helpers
from snooker_cli.engine.cell_memory import Margin
from snooker_cli.engine.kernel_state import Part, Sizes

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}:
    pytest.skip("nothing is compiled here", allow_module_level=True)

Pair = namedtuple("Pair", "floats integer")


def sum_of(floats, pair, nothing, flag, start):
    """Something of every type of argument."""
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
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The cache folder of a user who has chosen one."""
    chosen = tmp_path / "chosen"
    set_folder(chosen, monkeypatch)
    yield chosen
    jit.cache_folder.cache_clear()


def set_folder(chosen: Path | str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Set NUMBA_CACHE_DIR; "" if it is not set."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(chosen))
    jit.cache_folder.cache_clear()
    jit._warn.cache_clear()


def test_a_kernel_gives_what_its_function_does(cache: Path) -> None:
    """With arrays in rows, in columns and with gaps, each of which is compiled for itself."""
    kernel = jit.kernel(sum_of)
    for floats in (arguments()[0], arguments("F")[0], np.repeat(arguments()[0], 2, axis=1)[:, ::2]):
        expected = sum_of(floats.copy(), *arguments()[1:])
        assert kernel(floats, *arguments()[1:]) == expected == floats[0, 0]
    assert kernel.__name__ == "sum_of"
    assert len([*cache.rglob("*.nbc")]) == 3


@jit.called_by_kernels
class Shape:
    def area(self, scale):
        return 0.0

    def twice(self):
        return 2.0 * self.area(1.0)


class Square(Shape, namedtuple("Square", "side")):
    def area(self, scale):
        return scale * self.side * self.side


class Point(Shape, namedtuple("Point", "side")):
    pass


def area_and_twice(shape):
    return shape.area(3.0), shape.twice()


def test_kernels_call_methods_as_python_does(cache: Path) -> None:
    """That of the tuple's class, or what it inherits; also of itself."""
    kernel = jit.kernel(area_and_twice)
    for shape, expected in ((Square(2.0), (12.0, 8.0)), (Point(None), (0.0, 0.0))):
        assert kernel(shape) == area_and_twice(shape) == expected


def all_below(base: type) -> Iterator[type]:
    for below in base.__subclasses__():
        yield below
        yield from all_below(below)


@pytest.mark.parametrize("base", [Part, Sizes, Margin])
def test_kernels_can_call_all_methods(base: type) -> None:
    """A base class has each of them, with as many arguments; so no method is one by mistake."""
    inner = [base, *(found for found in all_below(base) if not issubclass(found, tuple))]
    classes = [found for found in all_below(base) if issubclass(found, tuple)]
    named = [found for found in classes if tuple not in found.__bases__]
    assert named
    for found in named:
        for name, method in vars(found).items():
            if name.startswith("_") or not isinstance(method, FunctionType):
                continue
            owners = [above for above in inner if name in vars(above) and issubclass(found, above)]
            assert owners, f"{found.__name__}.{name}: add what it does in other scenes to its base"
            arguments = [
                len(inspect.signature(its).parameters) for its in (method, vars(owners[0])[name])
            ]
            assert arguments[0] == arguments[1], f"{found.__name__}.{name} has other arguments"


def test_no_field_has_the_name_of_such_a_method() -> None:
    """Numba would take the method for the field, in all named tuples."""
    bases = [Part, Sizes, Margin]
    methods = {
        name
        for base in (*bases, *(below for above in bases for below in all_below(above)))
        if not issubclass(base, tuple)
        for name in vars(base)
        if not name.startswith("_")
    }
    assert {"place", "flight"} <= methods
    modules = {module.name for module in pkgutil.iter_modules(engine.__path__)}
    for module in modules - {"webassembly"}:  # the tuples there are for Python alone
        for found in vars(importlib.import_module(f"{engine.__name__}.{module}")).values():
            if inspect.isclass(found) and issubclass(found, tuple):
                assert not methods & {*found._fields}, found.__name__


def test_helpers_are_left_out_with_this_version_of_numba() -> None:
    """So at both ends of the versions that are supported, with which the tests run."""
    import numba

    assert linked_helpers.compilers() is not None, (
        f"Numba {numba.__version__} is not what engine/linked_helpers.py expects: kernels are "
        "right, but take longer to compile. Compare ARGUMENTS and INTERNALS there with "
        "numba.core.compiler.Compiler and numba.core.codegen, and extend OLDEST or NEWEST."
    )


@pytest.mark.parametrize("left_out", [True, False])
def test_helpers_have_no_machine_code(
    left_out: bool, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the kernel; and without this the kernel is the same, with a module more for each."""
    from numba.core import codegen

    if not left_out:
        monkeypatch.setattr(linked_helpers, "compilers", lambda: None)

    @jit.inlined
    def doubled(number):
        return 2.0 * number

    @jit.helper
    def twice_doubled(number):
        return doubled(doubled(number))

    @jit.kernel
    def eightfold(number):
        return doubled(twice_doubled(number))

    made: list[str] = []
    add = codegen.JITCPUCodegen._add_module

    def note_and_add(self: Any, module: Any) -> Any:
        made.append(module.name)
        return add(self, module)

    monkeypatch.setattr(codegen.JITCPUCodegen, "_add_module", note_and_add)
    assert eightfold(1.5) == 12.0
    assert any("doubled" in name for name in made) != left_out
    assert any("eightfold" in name for name in made) or "kernel" in made


@pytest.mark.parametrize(
    ("name", "value"), [("NEWEST", (0, 60)), ("ARGUMENTS", ["self"]), ("INTERNALS", ("_absent",))]
)
def test_another_numba_compiles_helpers_in_its_own_way(
    name: str, value: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linked_helpers, name, value)
    assert linked_helpers.compilers.__wrapped__() is None


def hits_of(kernel: Any) -> int:
    """How many kernels came from the cache; the others were compiled."""
    return sum(kernel.compiled.stats.cache_hits.values())


def test_a_kernel_is_loaded_from_the_cache(cache: Path) -> None:
    """And other functions of the user keep the cache folder that they had."""
    import numba

    expected = jit.kernel(sum_of)(*arguments())
    again = jit.kernel(sum_of)
    assert again(*arguments()) == expected
    assert hits_of(again) == 1
    assert str(cache) == numba.config.CACHE_DIR


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


DAMAGES: dict[str, tuple[str, Callable[[Path], object]]] = {
    "another index": ("nbi", lambda path: path.write_bytes(b"text")),
    "half of the code": ("1.nbc", cut),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_code_is_compiled_again(
    damage: str, cache: Path, warnings_of: Callable[[], list[str]]
) -> None:
    """With one warning."""
    for order in "CF":
        jit.kernel(sum_of)(*arguments(order))
    ending, change = DAMAGES[damage]
    (path,) = cache.rglob(f"*.{ending}")
    change(path)
    assert jit.kernel(sum_of)(*arguments()) == sum_of(*arguments())
    (warning,) = warnings_of()
    assert f"{path.parents[1]} is damaged" in warning
    repaired = jit.kernel(sum_of)
    assert repaired(*arguments()) == sum_of(*arguments())
    assert hits_of(repaired) == 1


def test_a_kernel_leaves_reference_counts_as_they_were() -> None:
    kernel, given = jit.kernel(sum_of), arguments()
    kernel(*given)
    before = [sys.getrefcount(array) for array in (given[0], given[1].floats)]
    for _ in range(100):
        kernel(*given)
    assert [sys.getrefcount(array) for array in (given[0], given[1].floats)] == before


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_is_collected_as_before(collects: bool, cache: Path) -> None:
    """After a kernel was compiled, and not meanwhile."""
    seen = []

    @jit.kernel
    def one():
        return 1

    before, typed = gc.isenabled(), jit.set_up_numba()
    typing = typed.core.compiler.Compiler.define_pipelines
    try:
        (gc.enable if collects else gc.disable)()
        with pytest.MonkeyPatch.context() as patch:
            compiler = typed.core.compiler.Compiler
            patch.setattr(
                compiler,
                "define_pipelines",
                lambda self: (seen.append(gc.isenabled()), typing(self))[1],
            )
            assert one() == 1
        assert gc.isenabled() == collects
        assert seen == [False]
    finally:
        (gc.enable if before else gc.disable)()


# The folder

FOLDER = "from snooker_cli.engine.jit import cache_folder; print(cache_folder())"


def test_the_cache_is_in_a_folder_of_the_user(tmp_path: Path) -> None:
    places = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(tmp_path)}
    assert Path(output_of(FOLDER, **places).strip()).parent == tmp_path / "snooker"
    places = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "", "HOME": str(tmp_path)}
    assert Path(output_of(FOLDER, **places).strip()).parent == tmp_path / ".cache" / "snooker"
    places = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert Path(output_of(FOLDER, **places).strip()).parent == tmp_path


def test_a_changed_sentence_compiles_nothing_anew() -> None:
    """But a changed number does."""
    text = 'WIDTH = 2\n\n\ndef area(x):\n    """Of a strip."""\n    return WIDTH * x\n'
    code = [*jit.parts_of_code(text)]
    assert [*jit.parts_of_code(text.replace("Of a", "# The area of a\n    long"))] == code
    assert [*jit.parts_of_code("# A strip.\n" + text)] == code
    for changed in (text.replace("2", "3"), text.replace("* x", "+ x"), text.replace("x", "y")):
        assert [*jit.parts_of_code(changed)] != code


@pytest.mark.long
def test_changed_sources_have_another_folder(tmp_path: Path) -> None:
    """Numba itself would not notice that a function has changed that a kernel calls."""
    copy = tmp_path / "snooker_cli"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(snooker_cli.__file__).parent, copy, ignore=ignored)
    where = {"PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path)}
    folders = [output_of(FOLDER, **where)]
    assert output_of(FOLDER, **where) == folders[0]
    for changed in ("engine/contact.py", "engine/jit.py", "trace.py"):
        with (copy / changed).open("a") as source:
            source.write("CHANGED = True\n")
        folders.append(output_of(FOLDER, **where))
    assert len(set(folders)) == 4


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The system's temporary folder, which every user can write to."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    folder.chmod(0o1777)
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


@pytest.fixture
def warnings_of(caplog: pytest.LogCaptureFixture) -> Callable[[], list[str]]:
    """Texts of the warnings so far."""
    caplog.set_level(logging.WARNING, "snooker_cli")
    return lambda: [record.getMessage() for record in caplog.records]


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def test_without_a_writable_folder_kernels_are_compiled_all_the_same(
    cache: Path,
    tmp_path: Path,
    temporary: Path,
    monkeypatch: pytest.MonkeyPatch,
    warnings_of: Callable[[], list[str]],
) -> None:
    """It is reported once."""
    (tmp_path / "file").touch()
    set_folder(tmp_path / "file" / "cache", monkeypatch)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "file"))
    for _ in range(2):
        assert jit.kernel(sum_of)(*arguments()) == sum_of(*arguments())
    (warning,) = warnings_of()
    assert "every process compiles again" in warning
    assert "NUMBA_CACHE_DIR" in warning


on_posix = pytest.mark.skipif(sys.platform == "win32", reason="it has no such permissions")


@on_posix
def test_a_disk_without_room_ends_no_run(cache: Path, warnings_of: Callable[[], list[str]]) -> None:
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
    try:
        assert jit.kernel(sum_of)(*arguments()) == sum_of(*arguments())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    (warning,) = warnings_of()
    assert "every process compiles again" in warning


@on_posix
def test_only_the_user_can_change_the_cache(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if new files are open to all, and ``~/.cache/snooker`` is from an older version."""
    before = os.umask(0)
    try:
        folder = jit.cache_folder()
        assert folder is not None
        assert folder.parent == cache
        assert {mode(cache), mode(folder)} == {0o700}
        (tmp_path / "snooker").mkdir()
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        set_folder("", monkeypatch)
        folder = jit.cache_folder()
    finally:
        os.umask(before)
    assert folder is not None
    assert folder.parent == tmp_path / "snooker"
    assert (mode(folder.parent), mode(folder)) == (0o755, 0o700)


@on_posix
@pytest.mark.parametrize("who", ["group", "parent", "link", "other user"])
def test_a_folder_that_others_can_change_is_refused(
    who: str,
    cache: Path,
    temporary: Path,
    monkeypatch: pytest.MonkeyPatch,
    warnings_of: Callable[[], list[str]],
) -> None:
    """They could put any code there; a folder that belongs to the user takes its place."""
    folder = jit.cache_folder()
    assert folder is not None
    user = os.geteuid()
    if who == "link":
        folder.rename(cache / "elsewhere")
        folder.symlink_to(cache / "elsewhere")
    elif who == "other user":
        monkeypatch.setattr(jit.os, "geteuid", lambda: user + 1)
    elif who == "parent":
        cache.chmod(0o777)
    else:
        folder.chmod(0o770)
    jit.cache_folder.cache_clear()
    instead = jit.cache_folder()
    (warning,) = warnings_of()
    assert f"other users can change {cache}" in warning
    if who == "other user":  # who made the other folder, too
        assert instead is None
        return
    assert instead == temporary / f"snooker-{user}" / folder.name
    assert (mode(instead.parent), mode(instead)) == (0o700, 0o700)
    assert str(instead) in warning


@on_posix
def test_a_user_without_a_home_has_a_temporary_cache(
    cache: Path,
    temporary: Path,
    monkeypatch: pytest.MonkeyPatch,
    warnings_of: Callable[[], list[str]],
) -> None:
    """As in a container with ``--user 12345``: neither HOME nor a line in /etc/passwd."""

    def unknown(number: int) -> None:
        raise KeyError(number)

    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pwd.getpwuid", unknown)
    set_folder("", monkeypatch)
    folder = jit.cache_folder()
    assert folder is not None
    assert folder.parent == temporary / f"snooker-{os.geteuid()}"
    (warning,) = warnings_of()
    assert "home directory" in warning
    assert str(folder) in warning


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="it has other locks")
def test_no_two_processes_save_at_the_same_moment(cache: Path) -> None:
    """Numba could then load the kernel of other arguments, without noticing."""
    import fcntl

    folder = jit.cache_folder()
    assert folder is not None
    thread = threading.Thread(target=lambda: jit.kernel(sum_of)(*arguments()))
    with (folder / "lock").open("wb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        thread.start()
        thread.join(3.0)
        assert thread.is_alive()
        assert not [*cache.rglob("*.nbi")]
    thread.join(30.0)
    assert len([*cache.rglob("*.nbi")]) == 1
    with (folder / "lock").open("wb") as other:  # the other process has released it
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)


# The notice


@pytest.mark.parametrize(("after", "notices"), [(0.0, 1), (60.0, 0)])
def test_only_a_long_compilation_gives_notice(
    after: float,
    notices: int,
    cache: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Once, and not for kernels from the cache."""
    monkeypatch.setattr(compilation, "NOTICE_AFTER", after)
    for expected in (notices, 0):
        compilation.give_notice.cache_clear()
        caplog.clear()
        with caplog.at_level(logging.INFO, "snooker_cli"):
            for order in "CF":
                jit.kernel(sum_of)(*arguments(order))
        assert [record.getMessage() for record in caplog.records] == [compilation.NOTICE] * expected


# How far a compilation is


def twice(number):
    return 2.0 * number


def test_watchers_see_each_function_of_a_kernel(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their number is a guess the first time, and then known; a kernel of the cache has none."""
    seen: list[tuple[int, int]] = []
    monkeypatch.setattr(compilation.COMPILATION, "watchers", [lambda *now: bool(seen.append(now))])
    double = jit.kernel(twice)

    def of_two(number):
        return double(number) + 1.0

    assert jit.kernel(of_two)(1.0) == 3.0
    usual = compilation.USUAL
    assert seen == [(0, usual), (1, usual), (2, 2)]
    seen.clear()
    assert jit.kernel(of_two)(1) == 3.0  # another type
    assert seen == [(0, 2), (1, 2), (2, 2)]
    seen.clear()
    jit.kernel(twice)(1.0)
    assert seen == []


def test_functions_of_other_processes_count_and_their_number_becomes_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The total is a guess until kernels are complete, and never less than what is done."""
    seen: list[tuple[int, int]] = []
    monkeypatch.setattr(compilation.COMPILATION, "watchers", [lambda *now: not seen.append(now)])
    totals = iter([130, 130, 3, 1])
    with compilation.watching("", lambda: next(totals)) as count:
        for _ in range(3):
            count()
    assert seen == [(0, 130), (1, 130), (2, 3), (3, 4), (3, 3)]


TWO_THREADS = """
import threading
from snooker_cli.engine import jit
start = threading.Barrier(2)
threads = [threading.Thread(target=lambda: (start.wait(), jit.learn_functions())) for _ in "ab"]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(jit._set_up_numba.cache_info().misses)
"""


def test_two_threads_set_numba_up_once() -> None:
    """Two listeners would each lock the cache, and the second would wait for the first for ever."""
    assert output_of(TWO_THREADS) == "1\n"
