"""What packages may not do: each is listed with its problem, and changes nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from installed import Installed

from snooker_cli.theory import IDEAL

FORMAT = """
from snooker_cli.extending import Format
IT = Format("{ending}", "a format", write_states=print)
"""
QUANTITY = """
from snooker_cli.extending import Quantity
IT = Quantity("{name}", "Q", "1", "quantity", "{key}", "means")
"""
THEORY = """
from snooker_cli.extending import QUANTITIES, Quantity, Theory
UNKNOWN = Quantity("unknown", "Q", "1", "quantity", "unknown", "means")
IT = Theory({quantity}, "model", "a source", {needs!r}, lambda gas: 1.0)
"""
FIGURE = """
from snooker_cli.extending import FigureSpec
IT = FigureSpec("{name}", "Title", "Any run.", print, {axes!r}, None, requires={requires!r})
"""

NEW_FIGURE = FIGURE.format(name="new", axes={}, requires=())
NEW_QUANTITY = QUANTITY.format(name="new", key="new")
LAW = """
from snooker_cli.extending import LawSpeed, PackageLaw, Restitution, law
@law
class IT(PackageLaw):
    name = "odd"
    cor: Restitution
    top: LawSpeed
    @staticmethod
    def restitution(speed, cor, top):
        return cor
"""


@pytest.fixture
def installed(tmp_path: Path) -> Installed:
    return Installed(tmp_path)


def problem(rows: list[dict[str, Any]]) -> str:
    """The problem of the only entry, which has no name."""
    (row,) = rows
    assert row["name"] == ""
    return str(row["problem"])


CASES: tuple[tuple[str, str, str], ...] = (
    ("exports", "import nothing_there\nIT = 1", "ModuleNotFoundError: No module named"),
    ("exports", "raise SystemExit('no')", "SystemExit: no"),
    ("exports", "IT = 1 / 0", "ZeroDivisionError: division by zero"),
    ("exports", "OTHER = 1", "has no attribute 'IT'"),
    ("exports", "IT = 1", "it is no Format; name an object of this class"),
    ("exports", FORMAT.format(ending=".xyz"), "snooker has .xyz itself; give it another name"),
    ("exports", FORMAT.format(ending="xyz"), "its ending is 'xyz'; give a dot"),
    ("exports", FORMAT.format(ending=".a").replace(", write_states=print", ""), "it writes"),
    ("quantities", "IT = 1", "it is no Quantity"),
    ("quantities", QUANTITY.format(name="pressure", key="new"), "snooker has pressure itself"),
    ("quantities", QUANTITY.format(name="new", key="pressure"), "its key pressure is that of"),
    ("theories", "IT = 1", "it is no Theory"),
    ("theories", THEORY.format(quantity="UNKNOWN", needs=()), "its quantity unknown is in no"),
    (
        "theories",
        THEORY.format(quantity='QUANTITIES["pressure"]', needs=("odd",)),
        "there is no fact odd",
    ),
    (
        "theories",
        THEORY.format(quantity='QUANTITIES["PV/NT"]', needs=()).replace("model", IDEAL),
        f"snooker has PV/NT: {IDEAL} itself",
    ),
    (
        "theories",
        THEORY.format(quantity='QUANTITIES["pressure"]', needs=()).replace("lambda gas: 1.0", "1"),
        "`value` is no function of gas",
    ),
    ("laws", LAW.replace('    name = "odd"\n', ""), "it has no name"),
    ("laws", LAW.replace("top: LawSpeed", "top: int"), "its field top is no float"),
    ("laws", LAW.replace("    @staticmethod\n", ""), "restitution is no static method"),
    ("quantities", NEW_QUANTITY.replace("means", "states"), "its source is 'states'; give one of"),
    ("quantities", NEW_QUANTITY.replace('"means"', '"means", alone=()'), "it has no value in a"),
    (
        "quantities",
        NEW_QUANTITY.replace('"means"', '"means", of_state=lambda places: 1.0'),
        "`of_state` has the arguments places; it gets positions, velocities, scene",
    ),
    (
        "figures",
        NEW_FIGURE.replace("print", "lambda: 1"),
        "`draw` has the arguments ; it gets build",
    ),
    ("figures", "IT = 1", "it is no FigureSpec"),
    ("figures", FIGURE.format(name="energy", axes={}, requires=()), "snooker has energy"),
    ("figures", FIGURE.format(name="Big", axes={}, requires=()), "its name is 'Big'"),
    ("figures", FIGURE.format(name="new", axes={}, requires=("odd",)), "no fact odd"),
    ("figures", FIGURE.format(name="new", axes={"z": 1}, requires=()), "no field z"),
    (
        "exports",
        "from snooker_cli.export import FORMATS\nIT = [*FORMATS]",
        "it asks for what is installed while it is loaded",
    ),
    ("colours", "IT = 1", "the groups are snooker.laws, snooker.quantities"),
)
"""The group, the source of a module, and the problem."""


@pytest.fixture(scope="module")
def bad(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What is listed of all cases, by their distributions."""
    installed = Installed(tmp_path_factory.mktemp("bad"))
    for number, (group, source, _) in enumerate(CASES):
        installed.write(f"bad{number}", source, **{group: "IT"})
    return {row["distribution"]: row for row in installed.plugins()}


@pytest.mark.parametrize("number", range(len(CASES)), ids=lambda k: f"{CASES[k][0]}-{k}")
def test_what_cannot_be_added_is_listed_with_the_reason(
    bad: dict[str, dict[str, Any]], number: int
) -> None:
    (group, _, why), row = CASES[number], bad[f"bad{number}"]
    assert why in row["problem"]
    assert (row["group"], row["name"]) == (f"snooker.{group}", "")


def test_a_package_that_fails_is_named_and_breaks_nothing_else(installed: Installed) -> None:
    installed.write("bad", "import nothing_there", exports="IT", figures="IT")
    installed.write("good", FORMAT.format(ending=".good"), exports="IT")
    done = installed.ended("-m", "snooker_cli", "export", "--help")
    assert done.returncode == 0
    assert ".xyz or .good" in " ".join(done.stdout.split())
    left_out = "snooker: bad 1.0: it = bad:IT is left out: ModuleNotFoundError"
    assert done.stderr.startswith(left_out), done.stderr
    assert "left out: it = bad:IT in snooker.figures of bad 1.0" in installed.snooker("plugins")


def test_of_two_packages_with_one_name_none_counts(installed: Installed) -> None:
    for name in ("first", "second"):
        installed.write(name, FORMAT.format(ending=".twice"), exports="IT")
    installed.write("third", FORMAT.format(ending=".once"), exports="IT")
    found = {row["distribution"]: (row["name"], row["problem"]) for row in installed.plugins()}
    assert found == {
        "first": ("", "second 1.0 has .twice, too; remove one"),
        "second": ("", "first 1.0 has .twice, too; remove one"),
        "third": (".once", ""),
    }


def in_a_script(installed: Installed) -> list[dict[str, Any]]:
    """What packages add for a script, which looks for modules in the current folder."""
    script = "import json, snooker_cli; print(json.dumps(snooker_cli.plugin_list()))"
    return [row for row in json.loads(installed.ended("-c", script).stdout) if row["entry"]]


def test_nothing_of_the_current_folder_is_loaded(installed: Installed) -> None:
    """Neither a distribution there, nor a module that hides one that is installed."""
    spoils = "from pathlib import Path\nPath('loaded').touch()\nIT = 1"
    installed.write("stranger", spoils, site=installed.here, exports="IT")
    installed.write("good", FORMAT.format(ending=".good"), exports="IT")
    (installed.here / "good.py").write_text(spoils)
    assert "good.py in the current folder hides good" in problem(in_a_script(installed))
    (row,) = installed.plugins()  # a command does not look there at all
    assert (row["name"], row["problem"]) == (".good", "")
    assert not (installed.here / "loaded").exists()


def test_an_editable_package_works_in_its_own_folder(installed: Installed) -> None:
    installed.write("good", FORMAT.format(ending=".good"), exports="IT")
    (installed.site / "good.py").rename(installed.here / "good.py")
    about = '{"url": "file:///here", "dir_info": {"editable": true}}'
    (installed.site / "good-1.0.dist-info" / "direct_url.json").write_text(about)
    (row,) = in_a_script(installed)
    assert (row["name"], row["problem"]) == (".good", "")


def test_origins_are_distributions_with_the_hash_of_their_sources(installed: Installed) -> None:
    script = """
from snooker_cli.export import FORMATS
from snooker_cli.plugins import origins
print(FORMATS.origin(".csv"), origins(FORMATS) == [FORMATS.origin(".good")])
print(*FORMATS.origin(".good"))
"""
    hashes = []
    for comment in ("# one\n", "# two\n"):
        source = comment + FORMAT.format(ending=".good")
        if hashes:
            (installed.site / "good.py").write_text(source)
        else:
            installed.write("good", source, exports="IT")
        done = installed.ended("-c", script)
        first, second = done.stdout.splitlines()
        assert first == "None True", done.stderr
        name, version, sources = second.split()
        assert (name, version, len(sources)) == ("good", "1.0", 64)
        hashes.append(sources)
    assert hashes[0] != hashes[1]


def test_an_error_in_a_package_is_a_bug_of_the_package(installed: Installed) -> None:
    source = FORMAT.format(ending=".bad").replace("print", "lambda *_: 1 / 0")
    installed.write("bad", source, exports="IT")
    script = """
from snooker_cli import errors, export
for call in (export.FORMATS[".bad"].write_states, lambda: [][0]):
    try:
        call()
    except Exception as error:
        print(errors.explained(error)[1])
"""
    lines = installed.ended("-c", script).stdout.splitlines()
    assert "ZeroDivisionError: division by zero; this is a bug in bad 1.0, please" in lines[0]
    assert "IndexError: list index out of range; this is a bug in snooker, please" in lines[1]
