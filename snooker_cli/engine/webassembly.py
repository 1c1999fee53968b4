"""The kernels of the live page as WebAssembly: the same source, and so the same bits.

Numba makes code for LLVM, and llvmlite, which Numba needs, also writes code for WebAssembly. There
is a module for each boundary. Its functions take one number: the address of a block of memory with
the parts of a ``Page``. ``layout`` says where each part is.
"""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from snooker_cli.containers import SHAPES, Circle, Container
from snooker_cli.engine import clock, jit, page_kernels, products, restitution
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import LANES
from snooker_cli.engine.compilation import COMPILATION, known_functions, watching
from snooker_cli.engine.package_laws import (
    check,
    hash_of,
    identity_of,
    kinds_of,
    laws_of_packages,
)
from snooker_cli.engine.page_kernels import (
    EVENTS,
    KERNELS,
    SEARCHES,
    boundary_names,
    example,
    kernels_of,
)
from snooker_cli.engine.sliding import SETTLES
from snooker_cli.errors import UserError
from snooker_cli.fields import CARRIED, EVENT_COLUMNS, MOVING, record_type
from snooker_cli.files import atomic_write
from snooker_cli.laws import LAWS, MOST_NUMBERS, Law, PackageLaw, law_from
from snooker_cli.trace import StopReason

# Modules in the cache of kernels

PROCESSES = 2
"""How many compile at a time: more take too much memory on small machines."""

SETTINGS = {"NUMBA_OPT": "0", "NUMBA_LOOP_VECTORIZE": "0"}
"""Numba's settings: it optimises nothing, because LLVM does so for WebAssembly."""

COMPILED_ONE = "a function is compiled\n"
"""What a process that compiles modules writes for each function."""

NOTICE = "compiling the engine of the live page (first use on this machine)"


def modules(boundaries: Iterable[str] | None = None, laws: Sequence[Law] = ()) -> dict[str, bytes]:
    """The modules of some boundaries, or of all. What the cache of kernels lacks is compiled.

    laws : that they can have besides those of snooker
    """
    boundaries = boundary_names() if boundaries is None else boundaries
    folder = jit.cache_folder()
    if folder is not None:
        return _modules_in(folder, boundaries, laws)
    with TemporaryDirectory() as temporary:
        return _modules_in(Path(temporary), boundaries, laws)


def _path(folder: Path, boundary: str, laws: Sequence[Law]) -> Path:
    """Where a module is in the cache."""
    return folder / f"{'-'.join(filter(None, [boundary, hash_of(identity_of(laws))]))}.wasm"


def _modules_in(folder: Path, boundaries: Iterable[str], laws: Sequence[Law]) -> dict[str, bytes]:
    paths = {boundary: _path(folder, boundary, laws) for boundary in boundaries}
    missing = [boundary for boundary, path in paths.items() if not path.is_file()]
    if missing:
        _compile_in_processes(missing, folder, laws)
    return {boundary: path.read_bytes() for boundary, path in paths.items()}


def _compile_in_processes(boundaries: list[str], folder: Path, laws: Sequence[Law]) -> None:
    """Compile in processes of their own, with other settings of Numba than those of this one."""
    of_packages = laws_of_packages(laws)
    for law in of_packages:
        check(law)
    written = json.dumps([law.as_json() for law in of_packages])
    command = [sys.executable, "-P", "-m", __name__, str(folder), written]
    paths = os.pathsep.join(path for path in sys.path if path)
    settings = os.environ | SETTINGS | {"PYTHONPATH": paths}
    shares = [boundaries[k::PROCESSES] for k in range(PROCESSES)]
    how: dict[str, Any] = {"env": settings, "text": True, "encoding": "utf-8"}
    how |= {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    running = [subprocess.Popen([*command, *share], **how) for share in shares if share]
    kernels = [kernel.__name__ for name in boundaries for kernel in kernels_of(name)]

    def total() -> int:  # the first kernel that is compiled tells of the others of its name
        return sum(known_functions(folder / f"{kernel}.functions") for kernel in kernels)

    with ThreadPoolExecutor(len(running)) as pool, watching(NOTICE, total) as count:
        problems = list(pool.map(lambda process: _followed(process, count), running))
    for process, problem in zip(running, problems, strict=True):
        if process.returncode:
            reason = (problem.strip() or f"exit code {process.returncode}").splitlines()[-1]
            if FOREIGN in reason and of_packages:
                names = ", ".join(law.name for law in of_packages)
                raise UserError(
                    f"pages cannot have the law {names}, which uses{reason.partition(FOREIGN)[2]}",
                    "use what docs/extending.md lists",
                )
            raise UserError(
                f"the engine of the live page cannot be compiled: {reason}",
                "set NUMBA_CACHE_DIR to a folder with space that only you can write to",
            )


def _followed(process: "subprocess.Popen[str]", count: Callable[[], None]) -> str:
    """Count each function that a process compiles, up to its end; what else it writes."""
    assert process.stdout is not None
    rest = []
    for line in process.stdout:
        if line == COMPILED_ONE:
            count()
        else:
            rest.append(line)
    process.wait()
    return "".join(rest)


def _write_function(done: int, _total: int) -> bool:
    """Tell the process that began this one of a compiled function."""
    if done:
        sys.stdout.write(COMPILED_ONE)
        sys.stdout.flush()
    return True


def write_modules(folder: Path, laws: Sequence[Law], boundaries: list[str]) -> None:
    """Compile modules into files, in a process that does nothing else."""
    COMPILATION.watchers.append(_write_function)
    for boundary in boundaries:
        with atomic_write(_path(folder, boundary, laws)) as part:
            part.write_bytes(compiled(boundary, laws))


# The layout of a block of memory

BEGIN = 65536
"""Where the block begins. The stack is before it."""

Length: TypeAlias = int | str

LENGTHS: Mapping[str, tuple[int, int]] = {
    "number": (0, 1),
    "bodies": (1, 1),
    "padded": (LANES - 1, LANES),
}
"""Lengths of arrays that depend on the number of balls N: what is added to N, and of what the sum
is rounded down to a whole multiple."""

NUMBER = 17
"""Balls of the example from which the layout comes. No other length is as large, but EVENTS."""

SLOT = 8
"""Bytes of a part in the block. The first slot has the number of balls."""

TYPES = {"float64": "double", "int64": "i64", "int32": "i32", "bool": "i8"}
"""The types of numbers, as LLVM has them."""


class Part(NamedTuple):
    """A number of a ``Page``, or an array, of which the block has the address.

    name : as ``state.balls``
    type : of NumPy; of records V and their bytes
    shape : lengths of an array, a number or a name of ``LENGTHS``; ``None`` for a number
    place : in the block, bytes
    """

    name: str
    type: str
    shape: tuple[Length, ...] | None
    place: int


def layout(boundary: str, laws: Sequence[Law] = ()) -> list[Part]:
    """The parts of pages with a boundary, in the order in which Numba passes them."""
    names = {(NUMBER + more) // unit * unit: name for name, (more, unit) in LENGTHS.items()}
    leaves = {name[1:]: value for name, value in leaves_of("", example(boundary, NUMBER, laws))}
    # Parts of the boundary are the last in the block, so that the others have one place.
    slots = sorted(leaves, key=is_of_boundary)
    parts = []
    for name, value in leaves.items():
        shape = None
        if isinstance(value, np.ndarray):
            shape = tuple(names.get(length, length) for length in value.shape)
        place = SLOT * (1 + slots.index(name))
        kind = np.asarray(value).dtype
        text = f"V{kind.itemsize}" if kind.names else kind.name
        parts.append(Part(name, text, shape, place))
    return parts


def is_of_boundary(name: str) -> bool:
    return name.startswith("state.boundary.")


def description(laws: Sequence[Law] = ()) -> dict[str, Any]:
    """What the page has to know of the modules, for JSON: layouts, and the names of numbers."""
    layouts = {boundary: layout(boundary, laws) for boundary in boundary_names()}
    kinds = restitution.KINDS | kinds_of(laws)
    known = LAWS | {law.name: type(law) for law in laws_of_packages(laws)}
    common = next(iter(layouts.values()))
    return {
        "begin": BEGIN,
        "events": EVENTS,
        "searches": SEARCHES,
        "common": [part for part in common if not is_of_boundary(part.name)],
        "boundaries": {
            boundary: [part for part in parts if is_of_boundary(part.name)]
            for boundary, parts in layouts.items()
        },
        "names": {
            "ball": constants_of(ks, "X", "Y", "U", "V", "CLOCK"),
            "history": constants_of(ks, "FORMER"),
            "sums": constants_of(
                ks,
                *("CONTACT_LASTS", "EPOCH", "NOW", "STILL_SINCE", "TIME_LIMIT"),
                *("WALL_IMPULSE", "PAIR_VIRIAL", "WALL_IMPULSE_REST", "PAIR_VIRIAL_REST"),
            ),
            "counts": constants_of(
                ks, *("WALL_EVENTS", "PAIR_EVENTS", "FIRST", "SECOND", "STALLED", "INVOLVED", "KEY")
            ),
            "law": constants_of(restitution, "KIND", "COR", "SPEED", "COLUMNS"),
            "laws": {
                name: {"number": kinds[name], "addsEnergy": law.adds_energy}
                | ({"ofPackage": law.numbers()} if issubclass(law, PackageLaw) else {})
                for name, law in known.items()
            },
            "shapes": {name: shape_of(shape) for name, shape in SHAPES.items()},
            "answers": constants_of(
                page_kernels, "REASON", "EVENTS_DONE", "REACHED", "LASTS", "GIVEN"
            ),
            "followed": constants_of(
                page_kernels,
                *("ENERGY", "SPIN_ENERGY", "CONTAINER_ENERGY"),
                *("WALL_IMPULSE", "PAIR_VIRIAL", "FOLLOWED_SUMS"),
            ),
            "MOST_NUMBERS": MOST_NUMBERS,
            "SETTLES": SETTLES,
            "NO_PARTNER": ks.NO_PARTNER,
            "FULL": clock.FULL,
            "REASONS": list(StopReason)[: clock.FAR + 1],
            "LENGTHS": LENGTHS,
            "EVENT_COLUMNS": event_columns(),
            "CARRIED": [
                {"name": field.name, "parts": len(field.titles)} for field in MOVING[CARRIED:]
            ],
        },
    }


def event_columns() -> list[tuple[str, int, int, str]]:
    """The columns of an event: name; first word of 4 bytes in its record, and how many; `needs`."""
    columns = [column for column in EVENT_COLUMNS if column.title]
    places = dict(record_type([column.name for column in columns]).fields or {})
    return [
        (
            column.name,
            places[column.name][1] // 4,
            places[column.name][0].itemsize // 4,
            column.needs,
        )
        for column in columns
    ]


def shape_of(shape: type[Container]) -> dict[str, Any]:
    """What the page has to know of a shape: a circle, or a rectangle with walls or images."""
    return {"isCircle": shape is Circle, "periodic": shape.periodic, "sides": shape.sides}


def constants_of(module: Any, *names: str) -> dict[str, int]:
    """Constants of a module."""
    return {name: getattr(module, name) for name in names}


def leaves_of(name: str, part: Any) -> Iterator[tuple[str, Any]]:
    """The arrays and numbers of a named tuple, with their names."""
    if not isinstance(part, tuple):
        yield name, part
        return
    for field, value in part._asdict().items():  # type: ignore[attr-defined]  # a NamedTuple
        yield from leaves_of(f"{name}.{field}", value)


# Code for LLVM

FOREIGN = "the module would import"  # functions that pages do not have

TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext"
"""What browsers have since 2021, and Safari since 2023."""

REPLACED = {r"llvm\.fma\.f64": "fused", "sqrt": "root"}
"""Functions that code for WebAssembly would import, and those that it has instead."""


def assembly(boundary: str, laws: Sequence[Law] = ()) -> list[str]:
    """Code for LLVM of all kernels of a boundary, and of the functions that call them."""
    parts, page = layout(boundary, laws), example(boundary, NUMBER, laws)
    codes = {kernel.__name__: jit.code_of(kernel, page) for kernel in kernels_of(boundary)}
    product, fused = jit.code_of(products.fused, 1.0, 1.0, 1.0)
    whole = [text for text, _ in codes.values()]
    whole += [Caller(name, *code).of_block(parts) for name, code in codes.items()]
    whole += [product, Caller("fused", product, fused).of_three(), ROOT]
    for name, other in REPLACED.items():
        whole = [re.sub(rf"@{name}\b", f"@{other}", text) for text in whole]
    return whole


ROOT = """
declare double @llvm.sqrt.f64(double)
define double @root(double %a) {
%b = call double @llvm.sqrt.f64(double %a)
ret double %b
}
"""


class Caller:
    """The text of a function that calls one that Numba has compiled.

    Numba's functions take an address for what they give, and one for an exception, which they
    never raise here.
    """

    def __init__(self, name: str, code: str, function: str) -> None:
        from llvmlite import binding as llvm

        self.name, self.function = name, function
        compiled = llvm.parse_assembly(code).get_function(function)
        self.types = [str(argument.type) for argument in compiled.arguments]
        self.opaque = self.types[0] == "ptr"  # older versions know what a pointer points to
        self.lines: list[str] = []

    def add(self, instruction: str) -> str:
        """Add an instruction; the name of what it gives."""
        name = f"%v{len(self.lines)}"
        self.lines.append(f"{name} = {instruction}")
        return name

    def loaded(self, place: int, what: str) -> str:
        """A number of the block."""
        pointer = "ptr" if self.opaque else f"{what}*"
        address = self.add(f"add i32 %block, {place}")
        address = self.add(f"inttoptr i32 {address} to {pointer}")
        return self.add(f"load {what}, {pointer} {address}")

    def length(self, length: Length) -> str:
        """A length of an array."""
        if isinstance(length, int):
            return str(length)
        more, unit = LENGTHS[length]
        filled = self.add(f"add i64 {self.loaded(0, 'i64')}, {more}")
        units = self.add(f"udiv i64 {filled}, {unit}")
        return self.add(f"mul i64 {units}, {unit}")

    def product(self, numbers: list[str]) -> str:
        first, *others = numbers
        for number in others:
            first = self.add(f"mul i64 {first}, {number}")
        return first

    def arguments(self, part: Part) -> Iterator[str]:
        """What Numba passes: a number; or of an array two pointers for Python, the number of
        elements, the size of one in bytes, the address, the lengths and the strides."""
        if part.shape is None:
            yield self.loaded(part.place, TYPES[part.type])
            return
        lengths, size = list(map(self.length, part.shape)), str(np.dtype(part.type).itemsize)
        pointer = "ptr" if self.opaque else f"{TYPES.get(part.type, 'i8')}*"
        yield from ("null", "null", self.product(lengths), size)
        yield self.add(f"inttoptr i32 {self.loaded(part.place, 'i32')} to {pointer}")
        yield from lengths
        yield from (self.product([size, *lengths[k + 1 :]]) for k in range(len(lengths)))

    def of_block(self, parts: list[Part]) -> str:
        """A function of the address of a block."""
        arguments = [argument for part in parts for argument in self.arguments(part)]
        return self._text("void", "i32 %block", arguments, "ret void")

    def of_three(self) -> str:
        """A function of three numbers that gives one."""
        pointer = "ptr" if self.opaque else "double*"
        end = f"%given = load double, {pointer} %first\nret double %given"
        return self._text("double", "double %a, double %b, double %c", ["%a", "%b", "%c"], end)

    def _text(self, gives: str, takes: str, arguments: list[str], end: str) -> str:
        places = [("first", "second")[k] for k in range(2)]
        for place, pointer in zip(places, self.types, strict=False):
            of_place = "ptr" if self.opaque else "double*"
            self.lines.append(f"%{place} = alloca double")
            self.lines.append(f"%{place}_ = bitcast {of_place} %{place} to {pointer}")
        values = ["%first_", "%second_", *arguments]
        typed = [f"{what} {value}" for what, value in zip(self.types, values, strict=True)]
        called = f"call i32 @{self.function}({', '.join(typed)})"
        declared = f"declare i32 @{self.function}({', '.join(self.types)})"
        body = "\n".join([*self.lines, called, end])
        return f"{declared}\ndefine {gives} @{self.name}({takes}) {{\n{body}\n}}\n"


# Code for WebAssembly


def compiled(boundary: str, laws: Sequence[Law] = ()) -> bytes:
    """The module of a boundary. It imports nothing and exports its memory and the kernels."""
    return module_of(object_of(assembly(boundary, laws)))


def object_of(texts: list[str]) -> bytes:
    """An object file, which is a module with imports, and with sections for a linker."""
    from llvmlite import binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(TRIPLE)
    machine = target.create_target_machine(
        cpu="generic", features=FEATURES, opt=3, reloc="static", codemodel="default"
    )
    heading = f'target triple = "{TRIPLE}"\ntarget datalayout = "{machine.target_data}"\n'
    whole = llvm.parse_assembly(heading)
    for text in texts:
        own = re.sub(r"(?m)^target (triple|datalayout) = .*$", "", text)
        whole.link_in(llvm.parse_assembly(heading + own))
    names = [kernel.__name__ for kernel in KERNELS]
    for function in whole.functions:
        if function.is_declaration:
            continue
        if function.name not in names:
            function.linkage = "internal"
        if not re.search(r"(^|\d)follow", function.name):
            function.add_function_attribute("optsize")
    for variable in whole.global_variables:
        variable.linkage = "internal"
    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(whole, builder)
    return bytes(machine.emit_object(whole))


# Sections of a module, see https://webassembly.github.io/spec/core/binary/modules.html
CUSTOM, IMPORT, MEMORY, GLOBAL, EXPORT, DATA = 0, 2, 5, 6, 7, 11
ORDER = (1, IMPORT, 3, 4, MEMORY, GLOBAL, EXPORT, 8, 9, 12, 10, DATA)

PAGES = 2
"""Pages of 64 KiB that a memory has at first: for the stack, and for a block."""


def module_of(data: bytes) -> bytes:
    """A module with its own memory and stack instead of imported ones, and with exports."""
    sections = {kind: content for kind, content in sections_of(data) if kind != CUSTOM}
    linking = (content for kind, content in sections_of(data) if kind == CUSTOM)
    functions = dict(functions_of(next(content for content in linking if LINKING in content[:9])))
    imported = list(imports_of(sections.pop(IMPORT)))
    unknown = [name for name, kind in imported if kind == FUNCTION]
    if unknown:
        raise ValueError(f"{FOREIGN} {', '.join(unknown)}")
    if ("__stack_pointer", VARIABLE) in imported:
        # A variable, an i32, that begins with a constant.
        sections[GLOBAL] = leb(1) + b"\x7f\x01\x41" + signed_leb(BEGIN) + b"\x0b"
    sections[MEMORY] = leb(1) + b"\0" + leb(PAGES)
    exports = [("memory", 2, 0)]
    names = [kernel.__name__ for kernel in KERNELS if kernel.__name__ in functions]
    exports += [(name, 0, functions[name]) for name in names]
    entries = [text_of(name) + bytes([kind]) + leb(index) for name, kind, index in exports]
    sections[EXPORT] = leb(len(entries)) + b"".join(entries)
    whole = [bytes([k]) + leb(len(sections[k])) + sections[k] for k in ORDER if k in sections]
    return data[:8] + b"".join(whole)


def sections_of(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The sections of a module: kind and content."""
    place = 8
    while place < len(data):
        kind = data[place]
        size, place = number_at(data, place + 1)
        yield kind, data[place : place + size]
        place += size


LINKING, SYMBOLS = b"linking", 8
"""A section for linkers, see the tool conventions of WebAssembly, and its part with names."""

FUNCTION_SYMBOL, _, VARIABLE_SYMBOL = range(3)
UNDEFINED, NAMED = 0x10, 0x40  # flags of symbols


def functions_of(linking: bytes) -> Iterator[tuple[str, int]]:
    """Name and number of each function that a module defines."""
    version = 1 + len(LINKING)
    kind, place = linking[version + 1], version + 2
    while kind != SYMBOLS:
        size, place = number_at(linking, place)
        kind, place = linking[place + size], place + size + 1
    _, place = number_at(linking, place)
    count, place = number_at(linking, place)
    for _ in range(count):
        kind = linking[place]
        flags, place = number_at(linking, place + 1)
        if kind not in (FUNCTION_SYMBOL, VARIABLE_SYMBOL):
            raise ValueError("the module would have data where its stack is")
        number, place = number_at(linking, place)
        if flags & UNDEFINED and not flags & NAMED:
            continue
        size, place = number_at(linking, place)
        if kind == FUNCTION_SYMBOL:
            yield linking[place : place + size].decode(), number
        place += size


FUNCTION, TABLE, _, VARIABLE = range(4)


def imports_of(section: bytes) -> Iterator[tuple[str, int]]:
    """Name and kind of each import."""
    count, place = number_at(section, 0)
    for _ in range(count):
        for _ in range(2):  # the module, and the name in it
            size, begin = number_at(section, place)
            place = begin + size
        name, kind = section[begin:place].decode(), section[place]
        place += 1
        if kind == FUNCTION:
            _, place = number_at(section, place)
        elif kind == VARIABLE:
            place += 2
        else:
            place += kind == TABLE  # its type
            has_most, place = section[place], place + 1
            for _ in range(1 + (has_most & 1)):
                _, place = number_at(section, place)
        yield name, kind


def number_at(data: bytes, place: int) -> tuple[int, int]:
    """A number in LEB128, and the place after it."""
    number = shift = 0
    while True:
        byte, place = data[place], place + 1
        number |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return number, place


def leb(number: int) -> bytes:
    """A number in LEB128."""
    out = bytearray()
    while number >= 128:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes([*out, number])


def signed_leb(number: int) -> bytes:
    """A number that is not negative, with a sign: its last byte is below 64."""
    out = leb(number)
    return out if out[-1] < 64 else out[:-1] + bytes([out[-1] | 128, 0])


def text_of(name: str) -> bytes:
    return leb(len(name)) + name.encode()


if __name__ == "__main__":
    own_laws = [law_from(written) for written in json.loads(sys.argv[2])]
    write_modules(Path(sys.argv[1]), own_laws, sys.argv[3:])
