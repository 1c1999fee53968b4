"""What all studies have in common: their records and their files."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from command_line import Snooker

import snooker_cli
from snooker_cli.errors import ExitCode
from snooker_cli.reproduction.reproduce import measurement
from snooker_cli.validation import hard_cases
from snooker_cli.validation.study_tables import lines

ENDINGS = ("svg", "png", "json")


@pytest.mark.parametrize(
    ("name", "libraries", "figures", "text"),
    [
        (
            "error",
            {"numpy", "numba", "flint"},
            {"error-against-cost-light-container", "error-growth-light-container"},
            "light-container: seven balls of 1 kg",
        ),
        ("physics", {"numpy", "numba"}, set(), "Erpenbeck & Luban 1985"),
        ("speed", {"numpy", "numba", "h5py"}, set(), "collisions/s"),
    ],
)
def test_a_study_gives_a_record_tables_and_figures(
    bench: Any, name: str, libraries: set[str], figures: set[str], text: str
) -> None:
    folder, record = bench(name)
    assert {"measurement", "snooker", "engine_version", "seconds"} < set(record)
    assert record["quick"]
    assert record["date"].endswith("+00:00")
    assert set(record["machine"]) == {"platform", "processor", "processors"}
    assert set(record["versions"]) == {"python"} | libraries
    assert json.loads((folder / f"{name}.json").read_text(encoding="utf-8")) == record
    assert text in (folder / f"{name}.txt").read_text(encoding="utf-8")
    files = {f"{figure}.{ending}" for figure in figures for ending in ENDINGS}
    assert {path.name for path in folder.iterdir()} == {f"{name}.txt", f"{name}.json"} | files


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("error", "--quick"), "pip install 'python-flint>="),
        (("hard", "at-rest-periodic"), "pip install 'python-flint>="),
        (("hard", "nonsense"), "there is no hard case nonsense; `snooker init --list` lists all"),
    ],
)
def test_without_python_flint_the_command_names_what_to_install(
    snooker: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.setitem(sys.modules, "flint", None)
    ended = snooker("bench", *arguments)
    assert (ended.code, ended.out) == (2, "")
    assert message in ended.err
    assert ended.err.count("\n") == 1  # nothing was measured before


def test_what_make_report_installs_is_enough_for_the_report() -> None:
    """Without the libraries of other extras, everything that the report imports loads."""
    code = """
import sys
sys.modules |= dict.fromkeys(["flint", "pyarrow", "distributed", "pypdf", "MDAnalysis"])
import snooker_cli.reproduction.reproduce, snooker_cli.report.run_report
import snooker_cli.cli.analysis_commands
"""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", ["error", "hard", "physics"])
def test_a_saved_record_can_be_printed(name: str) -> None:
    """Those of the reproduction, which were measured in full."""
    (path,) = Path(snooker_cli.__file__).parent.glob(f"*/measured/{name}.json")
    record = json.loads(path.read_text("utf-8"))
    printed = "\n".join(lines(record))
    parts = {"error": "scenes", "hard": "cases", "physics": "rows"}
    for row in record[parts[name]]:
        assert row.get("name", row.get("quantity")) in printed


def test_a_case_that_does_not_hold_is_an_exit_code(
    here: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = measurement("hard")
    failed = SimpleNamespace(measure=lambda *_: saved, passed=lambda _record: False)
    monkeypatch.setattr(hard_cases, "HARD", failed)
    assert snooker("bench", "hard").code == ExitCode.SOME_FAILED
