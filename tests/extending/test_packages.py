"""The example packages: what each needs, and that it works from its installation to its result."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import ase.io
import numpy as np
import pytest
from installed import EXAMPLES, PACKAGES, Installed, with_examples

import snooker_cli
from snooker_cli import extending

ALIGNMENT = "alignment of neighbours"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return with_examples(tmp_path_factory.mktemp("installed"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_one_file_beside_its_project(name: str) -> None:
    files = [path for path in (PACKAGES / name).rglob("*") if "__pycache__" not in path.parts]
    assert sorted(path.name for path in files) == ["pyproject.toml", EXAMPLES[name]]
    source = (PACKAGES / name / EXAMPLES[name]).read_text("utf-8")
    modules = re.findall(r"^(?:from|import) (snooker_cli\S*)", source, re.MULTILINE)
    assert {*modules} == {"snooker_cli.extending"}


def test_there_is_no_other_example() -> None:
    assert {path.name for path in PACKAGES.iterdir()} == {*EXAMPLES}


def test_all_names_for_packages_are_there() -> None:
    assert [name for name in extending.__all__ if not hasattr(extending, name)] == []


def test_what_is_installed_is_listed_after_what_snooker_has(installed: Installed) -> None:
    rows = json.loads(installed.snooker("plugins", "--json"))
    own = [row for row in rows if row["distribution"] == "snooker-cli"]
    assert rows[: len(own)] == own
    found = [(row["group"], row["name"], row["distribution"], row["version"]) for row in rows]
    assert found[len(own) :] == [
        ("snooker.laws", "yielding", "snooker-yielding", "0.1"),
        ("snooker.quantities", "mean free time", "snooker-free-times", "0.1"),
        ("snooker.quantities", ALIGNMENT, "snooker-neighbour-alignment", "0.1"),
        (
            *("snooker.theories", f"{ALIGNMENT}: momentum of N balls"),
            *("snooker-neighbour-alignment", "0.1"),
        ),
        ("snooker.figures", "free-times", "snooker-free-times", "0.1"),
        ("snooker.exports", ".lammpstrj", "snooker-lammps-dump", "0.1"),
    ]
    assert {row["problem"] for row in rows} == {""}
    assert {row["version"] for row in own} == {snooker_cli.__version__}
    printed = " ".join(installed.snooker("plugins").split())
    assert "snooker.figures snooker-free-times 0.1 free-times" in printed


def test_an_observable_is_compared_with_its_theory(installed: Installed) -> None:
    found = installed.rows("gas")[ALIGNMENT, "momentum of N balls"]
    assert found["predicted"] == pytest.approx(-1 / 19)
    assert 0 < found["difference_error"] < 0.02
    assert abs(found["difference"]) < 4 * found["difference_error"]


def test_a_state_with_no_number_is_a_sentence_about_the_package(installed: Installed) -> None:
    module = installed.site / EXAMPLES["neighbour-alignment"]
    source = module.read_text("utf-8")
    wrong = source.replace("return float(values.mean() / square) if", "return velocities if")
    assert wrong != source
    try:
        module.write_text(wrong, "utf-8")
        done = installed.ended("-m", "snooker_cli", "compare", "gas")
    finally:
        module.write_text(source, "utf-8")
    assert done.returncode == 2
    assert " ".join(done.stderr.split()) == (
        f"snooker: the quantity {ALIGNMENT} of snooker-neighbour-alignment 0.1: "
        "`of_state` returned an array of the shape (20, 2); "
        "it must return one number for a state, nan without a value"
    )


def test_results_are_kept_for_the_packages_that_made_them(installed: Installed) -> None:
    """Without the package its row is gone; another version of its source makes another row."""
    module = installed.site / EXAMPLES["neighbour-alignment"]
    source = module.read_text("utf-8")
    information = installed.site / "snooker_neighbour_alignment-0.1.dist-info"
    installed.rows("gas")
    try:
        module.write_text(source.replace("-1 / (gas.number - 1)", "-1 / gas.number"), "utf-8")
        other = installed.rows("gas")[ALIGNMENT, "momentum of N balls"]["predicted"]
        assert other == pytest.approx(-1 / 20)
        information.rename(information.with_name("away"))
        assert not [key for key in installed.rows("gas") if key[0] == ALIGNMENT]
    finally:
        module.write_text(source, "utf-8")
        if not information.exists():
            information.with_name("away").rename(information)
    again = installed.rows("gas")[ALIGNMENT, "momentum of N balls"]["predicted"]
    assert again == pytest.approx(-1 / 19)


def test_a_figure_is_drawn_and_listed_and_in_reports(installed: Installed) -> None:
    assert "free-times: Times between collisions of a ball" in installed.snooker(
        "plot", "gas", "--list"
    )
    assert "free-times" in installed.snooker("plot", "--list")
    printed = " ".join(installed.snooker("plot", "gas", "free-times").split())
    assert re.search(r"its next one\. Mean free time τ = 0\.\d+ ± 0\.\d+ s\.", printed), printed
    drawn = json.loads((installed.here / "runs/gas/figures/free-times.json").read_text("utf-8"))
    (point,) = drawn["numbers"]["points"]
    # A ball collides 400 times in a repeat. The ends of its repeat are about two times more.
    times = 20 * snooker_cli.open(installed.here / "runs/gas").table()["time"] / (2 * 4000)
    assert point["free_time"] == pytest.approx(times.mean(), rel=2 / 400)
    script = "from snooker_cli.report import run_report as r; print(r.ordered()[-1])"
    assert installed.ended("-c", script).stdout == "free-times\n"


def test_states_are_exported_as_another_program_reads_them(installed: Installed) -> None:
    installed.snooker("export", "gas", "--out", "gas.lammpstrj", "--frames", "3")
    installed.snooker("export", "gas", "--out", "gas.xyz", "--frames", "3")
    frames = ase.io.read(installed.here / "gas.lammpstrj", ":", format="lammps-dump-text")
    same = ase.io.read(installed.here / "gas.xyz", ":")
    assert len(frames) == len(same) == 3
    for frame, other in zip(frames, same, strict=True):
        assert np.array_equal(frame.positions, other.positions)
        assert frame.pbc.tolist() == [True, True, False]
        assert frame.cell.lengths()[:2].tolist() == [20, 20]


def test_help_and_errors_name_the_format(installed: Installed) -> None:
    assert ".lammpstrj" in installed.snooker("export", "--help")
    done = installed.ended("-m", "snooker_cli", "export", "gas", "--out", "gas.dump")
    assert done.returncode == 2
    assert ".xyz or .lammpstrj" in done.stderr


STARTED = """
import sys
from snooker_cli.cli import main
sys.argv = ["snooker", *sys.argv[1:]]
try:
    main()
finally:
    plugins = sys.modules.get("snooker_cli.plugins")
    assert plugins is None or plugins._entries.cache_info().misses == 0
"""


@pytest.mark.parametrize("command", ["--help", "show gas", "run gas.yaml", "ls"])
def test_commands_that_need_no_table_look_for_no_package(
    installed: Installed, command: str
) -> None:
    done = installed.ended("-c", STARTED, *command.split())
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_pip_installs_an_example_without_a_registry(tmp_path: Path) -> None:
    """In a new environment that also sees the libraries of this one."""
    venv.create(tmp_path / "new", with_pip=True)
    paths = {"base": str(tmp_path / "new"), "platbase": str(tmp_path / "new")}
    site = Path(sysconfig.get_path("purelib", vars=paths))
    ours = [path for path in sys.path if Path(path).is_dir() and "site-packages" in path]
    root = str(Path(snooker_cli.__file__).parents[1])
    (site / "libraries.pth").write_text("\n".join([*ours, root]))
    python = tmp_path / "new" / ("Scripts" if os.name == "nt" else "bin") / "python"
    for name in EXAMPLES:
        package = str(PACKAGES / name)
        options = ["--no-index", "--no-build-isolation", "--no-deps", "--quiet"]
        command = [str(python), "-m", "pip", "install", *options, package]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    command = [str(python), "-m", "snooker_cli", "plugins", "--json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    rows = [row for row in json.loads(done.stdout) if row["entry"]]
    assert {row["distribution"] for row in rows} == {f"snooker-{name}" for name in EXAMPLES}
    assert {row["problem"] for row in rows} == {""}
