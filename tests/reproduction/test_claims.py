"""Each sentence of the paper that depends on results is supported by them, and could fail."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path
from typing import Any

import pytest
import repeating

import snooker_cli as snooker
from snooker_cli.config import load
from snooker_cli.errors import UserError
from snooker_cli.reproduction.claims import CLAIMS, check, last_rates
from snooker_cli.reproduction.printed import comparison, statements
from snooker_cli.reproduction.reproduce import (
    DOCUMENTS,
    MEASUREMENTS,
    REPORT_FIGURES,
    RUNS,
    all_results,
    figure_data,
    measurement,
    text_of_file,
)
from snooker_cli.reproduction.source_values import SOURCE_VALUES, STATEMENTS

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden" / "reproduction.json"
"""The results of `make report`; --write-goldens takes them from runs/report."""

PAPER, TABLES = (text_of_file(f"templates/{name}") for name in DOCUMENTS.values())
MARK = re.compile(r'\{\{ holds\("(.*?)"\) \}\}')


@pytest.fixture(scope="module")
def found(request: pytest.FixtureRequest) -> dict[str, Any]:
    """The saved results, with the saved measurements."""
    if request.config.getoption("--write-goldens"):
        new = json.loads((ROOT / "runs" / "report" / "numbers.json").read_text(encoding="utf-8"))
        GOLDEN.write_text(json.dumps(new, ensure_ascii=False) + "\n", encoding="utf-8")
    numbers = json.loads(GOLDEN.read_text(encoding="utf-8"))
    return {**numbers, "measured": {name: measurement(name) for name in MEASUREMENTS}}


@pytest.mark.parametrize("name", CLAIMS)
def test_the_results_support_a_sentence(name: str, found: dict[str, Any]) -> None:
    assert CLAIMS[name](found)
    check(found)


def test_the_paper_has_all_claims_and_no_other() -> None:
    assert set(MARK.findall(PAPER)) == set(CLAIMS)
    assert not MARK.findall(TABLES)


KEPT = {"parameters", "cor", "radius", "speed", "checkpoints"}
"""What identifies a point, and is no result."""


def scrambled(value: Any, chance: random.Random) -> Any:
    """Results with other numbers, truths and verdicts."""
    if isinstance(value, dict):
        return {k: one if k in KEPT else scrambled(one, chance) for k, one in value.items()}
    if isinstance(value, list):
        return [scrambled(one, chance) for one in value]
    if isinstance(value, bool):
        return chance.random() < 0.5
    if isinstance(value, int | float):
        return chance.choice([abs(value) * 10 ** chance.uniform(-2, 2), chance.uniform(0, 3)])
    return chance.choice(["yes", "no"]) if value in ("yes", "only with open") else value


def as_printed(found: dict[str, Any]) -> dict[str, Any]:
    """Results in which each explanation and formula gives what the source report prints."""
    changed: dict[str, Any] = json.loads(json.dumps(found))
    for row in changed["printed"]:
        row["formula"] = row["value"]
    for one in changed["explanations"].values():
        one["agreeing"] = list(one["values"])
    return changed


@pytest.mark.parametrize("name", CLAIMS)
def test_a_sentence_fails_with_other_results(name: str, found: dict[str, Any]) -> None:
    others = (scrambled(found, random.Random(seed)) for seed in range(40))
    assert not all(map(CLAIMS[name], (as_printed(found), *others)))


def test_the_name_of_a_sentence_without_support_is_printed(found: dict[str, Any]) -> None:
    wrong = json.loads(json.dumps(found))
    for row in wrong["printed"]:
        row["ours"]["value"] = row["value"]
    name = "printed decay constants are several times too small"
    with pytest.raises(UserError, match=f"the results do not support the sentence “{name}”"):
        check(wrong)


def test_last_rates_are_in_standard_errors() -> None:
    point = {"last_rate": 1.0, "fitted_last_rate": 1.4, "last_rate_error": 0.1}
    points = [{"parameters": {"cor": 0.5}, **point}]
    (errors,) = last_rates({"figures": {"haff-time": {"points": points}}}).values()
    assert errors == pytest.approx(-4)


def test_printed_numbers_and_sentences_follow_from_the_results(found: dict[str, Any]) -> None:
    """The arithmetic that needs no statistics, from the saved results of the runs."""
    rows = {row["name"]: row for row in comparison(found)}
    assert list(rows) == list(SOURCE_VALUES)
    fits = found["stated"]["0.8"]["fits"]
    assert (
        rows["energy_mean_0.8"]["ours"]["value"] == fits["kinetic_energy"]["exponential"]["value"]
    )
    one, mean = (rows[f"pressure_{name}_0.8"]["ours"] for name in ("one", "mean"))
    assert (one["value"], mean["error"]) == (
        mean["value"],
        fits["pressure"]["exponential"]["error"],
    )
    assert one["error"] == pytest.approx(mean["error"] * 200**0.5, rel=1e-4)
    assert rows["doubled_0.8"]["ours"]["value"] == 2 * mean["value"]
    assert rows["cross_section"]["ours"]["value"] == pytest.approx(6.2832, abs=1e-4)
    assert rows["cross_section"]["formula"] == pytest.approx(0.4, abs=1e-4)
    assert rows["mean_free_path"]["formula"] == pytest.approx(15.0097, abs=1e-4)
    assert rows["tau_0.9"]["ours"]["value"] == pytest.approx(0.9555 / 5.2065, rel=1e-3)
    holds = {row["name"]: row["holds"] for row in statements(found)}
    assert list(holds) == list(STATEMENTS)
    assert all(rows[name]["agrees"] == row["agrees"] for name, row in by_name(found).items())
    # The source report contradicts these itself.
    assert [holds[name] for name in ("mean_free_path", "errors_of_theory", "divergence")] == [
        False
    ] * 3
    assert [holds[name] for name in ("radius_of_figure_17", "pressure_constant")] == [None] * 2


def by_name(found: dict[str, Any]) -> dict[str, Any]:
    return {row["name"]: row for row in found["printed"]}


@pytest.mark.long
def test_new_runs_support_each_sentence_and_give_the_saved_numbers(
    found: dict[str, Any], tmp_path: Path
) -> None:
    """`make report` without its pages: some minutes."""
    runs = {}
    for name in RUNS:
        config = load(ROOT / "configs" / f"{name}.yaml").config
        repeating.done(repeating.created(tmp_path / name, config))
        runs[name] = snooker.open(tmp_path / name)
    new = all_results(runs, {file: figure_data(runs, file) for file in REPORT_FIGURES})
    check(new | {"measured": found["measured"]})
    for row in new["printed"]:
        saved = by_name(found)[row["name"]]["ours"]
        tenth = saved["error"] / 10 + 1e-5 * abs(saved["value"])
        assert row["ours"]["value"] == pytest.approx(saved["value"], abs=tenth), row["name"]


def test_no_result_is_typed_in_the_text() -> None:
    for text in (PAPER, TABLES):
        prose = re.sub(r"\{\{.*?\}\}|\{[%#].*?[%#]\}", "", text, flags=re.DOTALL)
        assert not [typed for typed in re.findall(r"\d+\.\d+", prose) if typed not in SETTINGS]


SETTINGS = ("0.8", "0.9", "0.95", "0.01", "0.001")
"""CoR and radii that the text names."""
