"""``snooker fit`` and ``compare`` of runs that are not finished, or whose folder is read-only."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path

import pytest
from command_line import Snooker
from repeating import made

from snooker_cli.analysis import run_analysis
from snooker_cli.analysis.comparison import Comparison
from snooker_cli.analysis.decay import NO_LOSSES
from snooker_cli.analysis.tables import compare_cells, note_lines
from snooker_cli.formatting import with_error
from snooker_cli.runs.run import ANALYSIS


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_an_unfinished_run_is_analysed_as_far_as_it_is(
    command: str, separate: Path, snooker: Snooker
) -> None:
    (separate / "point-0001" / "repeats-0001-0001.h5").unlink()
    ended = snooker(command, "small", "--json")
    assert (ended.code, ended.err) == (0, "")
    rows = json.loads(ended.out)
    assert {row["repeats"] for row in rows if row["parameters"] == {"cor": 1.0}} <= {0, 2}
    printed = " ".join(snooker(command, "small").out.split())
    assert "cor=1.0: 2 of 3 repeats" in printed
    shutil.rmtree(separate / "point-0001")
    assert "cor=1.0: 0 of 3 repeats" in snooker(command, "small").out
    rows = json.loads(snooker(command, "small", "--json").out)
    assert {row["parameters"]["cor"] for row in rows} == {0.85}
    shutil.rmtree(separate / "point-0000")
    ended = snooker(command, "small")
    assert (ended.code, ended.out, ended.err.count("\n")) == (2, "", 1)


def test_an_unfinished_extension_is_analysed_with_a_note(
    finished: Path, snooker: Snooker, small_config: str
) -> None:
    made(finished, small_config, "collisions=151")
    for command in ("fit", "compare"):
        ended = snooker(command, "small")
        assert ended.code == 0
        assert "\n3 of 3 repeats end " in ended.out
        assert "cor=0.85" in ended.out
    ended = snooker("plot", "small", "energy")
    assert ended.code == 0
    assert "snooker: 6 of 6 repeats end " in ended.err
    assert snooker("export", "small").code == 0


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_an_analysis_that_cannot_be_saved_is_printed(
    command: str, finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path, content: object) -> None:
        raise PermissionError(13, "Permission denied")

    for options in ([], ["--json"]):
        printed = snooker(command, "small", *options).out
        (finished / ANALYSIS).unlink()
        with monkeypatch.context() as patched:
            patched.setattr(run_analysis, "write_text", refused)
            ended = snooker(command, "small", *options)
        assert (ended.code, ended.out, ended.err.count("\n")) == (0, printed, 1)
        assert ended.err.startswith("snooker: runs/small/analysis.json: cannot be written ")


def test_a_range_of_times_is_fitted_and_not_saved(finished: Path, snooker: Snooker) -> None:
    """A range without a time is one sentence that names the times."""
    whole = json.loads(snooker("fit", "small", "--json").out)
    saved = (finished / ANALYSIS).read_bytes()
    rows = json.loads(snooker("fit", "small", "--json", "--until", "2").out)
    later = json.loads(snooker("fit", "small", "--json", "--from", "0.5", "--until", "2").out)
    assert (finished / ANALYSIS).read_bytes() == saved
    values = [each[0]["value"] for each in (whole, rows, later)]
    assert len(set(values)) == 3
    assert rows[0]["judged_to"] is None or rows[0]["judged_to"] <= 2
    for options, fact in (
        (["--from", "2", "--until", "1"], "from 2 s to 1 s"),
        (["--from", "-1"], "from -1 s"),
        (["--from", "nan"], "from nan s"),
        (["--from", "1e6"], "no repeat reaches 1e+06 s"),
    ):
        ended = snooker("fit", "small", *options)
        assert (ended.code, ended.out, ended.err.count("\n")) == (2, "", 1)
        assert fact in ended.err


def test_elastic_points_have_a_sentence_and_no_table(finished: Path, snooker: Snooker) -> None:
    lines = snooker("fit", "small").out.splitlines()
    assert [line for line in lines if "cor=1.0" in line] == [f"cor=1.0: {NO_LOSSES}"]
    assert snooker("fit", "small", "--where", "cor=1").out == f"{NO_LOSSES}\n"


def test_rows_of_the_source_report_and_of_the_temperature_are_those_of_all(
    finished: Path, snooker: Snooker
) -> None:
    """They are printed, too, if no other row is wanted."""
    usual, every = (snooker("fit", "small", *more).out for more in ([], ["--all"]))
    assert "temperature" not in usual
    assert usual.count("\npressure  ") == 2
    assert every.count("\npressure  ") == 3
    assert every.count("\ntemperature  ") == 2
    assert snooker("fit", "small", "--quantity", "temperature").out.count("\ntemperature  ") == 2
    names = snooker("fit", "small", "--quantity", "nonsense").err
    assert names.count("pressure") == 2
    assert "_" not in names
    assert "1" not in names
    constants = snooker("compare", "small", "--model", "source report").out
    assert "decay constant of energy" in constants
    assert "'χ²/dof of speeds'" in snooker("compare", "small", "--quantity", "nonsense").err


def test_notes_are_about_rows_that_are_shown(separate: Path, snooker: Snooker) -> None:
    for options, words, others in (
        (["--quantity", "Haff"], [], ["L/L_c:", "relaxation", "fewer than"]),
        (["--quantity", "L/L"], ["L/L_c:"], ["relaxation", "fewer than"]),
        (["--quantity", "speeds", "--model", "fixed"], ["relaxation", "fewer than"], ["L/L_c:"]),
        ([], ["L/L_c:", "relaxation", "fewer than"], ["glossary", "box"]),
    ):
        printed = snooker("compare", "small", *options).out
        assert all(word in printed for word in words)
        assert not any(word in printed for word in others)
    early = ["fit", "small", "--until", "0.01", "--where", "cor=0.85"]
    assert "no fit of kinetic energy" in snooker(*early).out
    assert "no fit of local" not in snooker(*early, "--quantity", "kinetic").out


def test_notes_are_wrapped(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    for columns, width in (("60", 60), ("300", 100)):
        monkeypatch.setenv("COLUMNS", columns)
        lines = snooker("fit", "small").out.splitlines()
        notes = lines[next(k for k, line in enumerate(lines) if line.startswith("Fits use")) :]
        assert width - 20 < max(map(len, notes)) <= width


def test_notes_of_many_points_that_differ_in_numbers_are_one_line() -> None:
    notes = [
        {"parameters": {"cor": cor}, "note": f"{number} of 12 repeats ended early"}
        for cor, number in ((0.5, 11), (0.6, 10), (0.7, 11), (0.8, 9))
    ]
    whole = [{"parameters": {"cor": k}, "note": "no walls"} for k in range(5)]
    assert list(note_lines(notes + whole, 5)) == [
        "4 of 5 points, as at cor=0.5: 11 of 12 repeats ended early",
        "no walls",
    ]
    assert list(note_lines(notes[:3], 5)) == [
        "cor=0.5; cor=0.7: 11 of 12 repeats ended early",
        "cor=0.6: 10 of 12 repeats ended early",
    ]


@pytest.mark.parametrize(("repeats", "cell"), [(2, "–"), (3, "+48.2")])
def test_a_difference_of_two_repeats_is_not_in_errors(repeats: int, cell: str) -> None:
    found = Comparison("PV/NT", "ideal gas law", 1.2, 0.1, 1.0, 4.82, 0.1, repeats)
    assert compare_cells(found.as_json())[-1] == cell
    length = Comparison("L/L_c", "critical length", 0.7, *[math.nan] * 4, repeats)
    assert compare_cells(length.as_json())[2:] == ["0.7", "–", "–", "–"]


def test_all_prints_more(finished: Path, snooker: Snooker) -> None:
    """Half of the range and the formulas of the source report."""
    for command, columns in (
        ("fit", {"half range"}),
        ("compare", set()),
    ):
        rows = json.loads(snooker(command, "small", "--json").out)
        short, whole = (snooker(command, "small", *more).out for more in ((), ("--all",)))
        # What holds comes first.
        tables = [text.partition("\n\n")[2].splitlines() for text in (whole, short)]
        heads = [set(re.split("  +", lines[1])) for lines in tables]
        assert heads[0] - heads[1] == columns
        assert whole.count("\n") >= len(rows)
        assert ("source report," in whole) == (command == "compare")
        assert "source report," not in short
        number = 1 if command == "fit" else 2
        assert short.count(" of 3 complete") == whole.count(" of 3 complete") == number
    row = json.loads(snooker("fit", "small", "--json").out)[0]
    whole_fit = snooker("fit", "small", "--all").out
    cells = re.split("  +", whole_fit.partition("\n\n")[2].splitlines()[2])
    assert cells[-1] == f"{row['max_min_half_range']:.2g}"
    known = next(row for row in rows if row["error"])
    assert with_error(known["measured"], known["error"]) in whole


def test_differences_have_their_errors(finished: Path, snooker: Snooker) -> None:
    """The last column is the printed difference over its printed error, to their rounding."""
    rows = json.loads(snooker("compare", "small", "--json").out)
    printed = snooker("compare", "small", "--all").out.splitlines()
    lines = [line for line in printed if not line.startswith(("cor=", "quantity")) and line]
    known = 0
    for row, line in zip(rows, lines, strict=False):
        cells = re.split(r"  +", line)
        if row["difference_in_errors"] is None:
            assert cells[-1] == "–"
            continue
        assert "±" in cells[-2]
        numbers = cells[-2].replace("−", "-").replace(" × 10", "e").strip("+()")
        raised = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
        value, error = (float(part) for part in numbers.translate(raised).split(" ± "))
        assert value == pytest.approx(row["difference"], abs=error / 10)
        assert error == pytest.approx(row["difference_error"], rel=0.05)
        in_errors = float(cells[-1].replace("−", "-"))
        assert in_errors == pytest.approx(value / error, rel=0.06, abs=0.15)
        known += 1
    assert known > 10
    assert len([line for line in lines if "over these differences" in line]) == 1
