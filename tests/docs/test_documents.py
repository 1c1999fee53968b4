"""The documents show what the commands print; ``pytest tests/docs --write-goldens`` updates them.

Numbers in docs/accuracy.md are those of the saved measurements and of the audit.
"""

from __future__ import annotations

import json
import math
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import make_schema
import numpy as np
import pytest
import repeating
import yaml
from direct_simulation import ROUGH_MOMENTS

from snooker_cli import __version__, two_temperatures
from snooker_cli.analysis.comparison import compare
from snooker_cli.analysis.decay import decays
from snooker_cli.cli.app import COMMANDS, loaded
from snooker_cli.config import digest, load, parse
from snooker_cli.config.template_configs import templates
from snooker_cli.engine.simulation import simulate_batch
from snooker_cli.errors import ExitCode
from snooker_cli.figures.registry import FIGURES
from snooker_cli.formatting import rough, short, with_error
from snooker_cli.placement.starting_scene import starting_scenes
from snooker_cli.reproduction.claims import decay_factors
from snooker_cli.reproduction.reproduce import measurement, text_of_file
from snooker_cli.runs import RunFolder
from snooker_cli.validation.gas_samples import DIRECT
from snooker_cli.validation.physics_study import SCALED_PARTICLES
from snooker_cli.validation.spinning_gases import DIRECT_ROUGH

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
README, TUTORIAL, STUDENT, RUNS, ACCURACY = (
    ROOT / "README.md",
    *(DOCS / f"{name}.md" for name in ("tutorial", "student", "runs", "accuracy")),
)
CONSOLE = re.compile(r"```console\n\$ ((?:snooker|python) .*)\n((?:.*\n)*?)```")
PYTHON = re.compile(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", re.DOTALL)
"""A block of docs/python.md and what it prints."""

HELP = re.compile(r"## (snooker.*)\n\n```text\n((?:.*\n)*?)```")
"""A command and its help in docs/cli.md."""

SESSIONS = {"readme": (README, RUNS), "tutorial": (TUTORIAL,), "student": (STUDENT,)}
"""Documents whose commands run one after the other in one folder."""

SLOW = re.compile(r"brownian|snooker (report|animate)")
"""Commands of the student's session that take most of its time."""

PICTURES = {
    "readme": {"gas.gif": "gas.gif"},
    "tutorial": {"cooling.png": "runs/haff/figures/cooling.png"},
    "student": {
        "student-pressure.png": "runs/pressure/figures/gas-law.png",
        "student-speeds.png": "runs/pressure/figures/speeds-balls.speed-20.png",
        "student-cooling.png": "runs/cooling/figures/cooling.png",
        "student-path.png": "runs/brownian/figures/tagged-path.png",
        "student-displacement.png": "runs/brownian/figures/mean-squared-displacement.png",
        "student-heat.png": "runs/heat/figures/profiles.png",
        "student-rotation.png": "runs/rough/figures/rotation.png",
        "student-balance.png": "runs/driven/figures/energy-balance-wall_speed-1.png",
    },
}
"""The pictures in docs/ that the commands of a session make."""

VARIES = re.compile(
    r" in [\d.]+ s \([\d,]+ events/s\)( after \d+ s of compiling)?"
    r"|\d{4}-\d\d-\d\d \d\d:\d\d"
    r"|[\d.]+ [kMG]?B\b"
)
"""Durations, dates, and sizes of files, which contain the names of versions and machines."""


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def sentences_of(path: Path) -> str:
    """The text with single spaces."""
    return " ".join(text_of(path).split())


def block(path: Path, language: str) -> str:
    """The only block in a language."""
    (found,) = re.findall(rf"```{language}\n(.*?)```", text_of(path), flags=re.DOTALL)
    return str(found)


def words(output: str) -> list[list[str]]:
    """What does not vary, without the widths of columns."""
    return [line.split() for line in VARIES.sub("", output).splitlines()]


def printed_by(code: str, names: dict[str, Any]) -> str:
    """What Python code prints; its names stay for the next block."""
    with redirect_stdout(StringIO()) as out:
        exec(compile(code, "block", "exec"), names)
    return out.getvalue()


def run_line(line: str, snooker: Callable[..., Any]) -> str:
    """What a command prints, without starting Python again."""
    program, *arguments = shlex.split(line)
    if program == "python":
        with redirect_stdout(StringIO()) as out:
            runpy.run_path(arguments[0])
        return out.getvalue()
    ended = snooker(*arguments)
    assert ended.code == 0, ended.err
    # Whether this machine had to compile does not matter to the reader.
    return re.sub(r" after \d+ s of compiling", "", ended.out)


Agree = Callable[..., None]


@pytest.fixture
def agree(request: pytest.FixtureRequest) -> Agree:
    """Compares texts that a document shows with those that are printed now, or writes these there.

    of : what has to be equal
    """
    write = request.config.getoption("--write-goldens")

    def call(path: Path, pairs: Iterable[tuple[str, str]], of: Callable[[str], Any] = str) -> None:
        text = text_of(path)
        for shown, printed in pairs:
            same = of(printed) == of(shown)
            assert same or (write and shown), (
                f"{path.name} shows:\n{shown}\nand this is printed:\n{printed}"
            )
            text = text if same else text.replace(shown, printed)
        if write:
            path.write_text(text, encoding="utf-8")

    return call


@pytest.mark.parametrize(
    ("session", "whole"),
    [
        ("readme", True),
        ("tutorial", True),
        ("student", False),
        pytest.param("student", True, marks=pytest.mark.long),
    ],
)
def test_commands_print_what_the_documents_show(
    session: str,
    whole: bool,
    agree: Agree,
    tmp_path: Path,
    snooker: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    (tmp_path / "haff.py").write_text(block(TUTORIAL, "python"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    for path in SESSIONS[session]:
        shown = [
            found for found in CONSOLE.findall(text_of(path)) if whole or not SLOW.search(found[0])
        ]
        assert shown
        agree(path, ((output, run_line(command, snooker)) for command, output in shown), words)
    if session == "readme":
        (film,) = re.findall("`(snooker animate .*)`", text_of(README))
        assert run_line(film, snooker) == "gas.gif\n"

    for name, made in PICTURES[session].items() if whole else ():
        assert Path(made).exists()
        if request.config.getoption("--write-goldens"):
            shutil.copy(made, DOCS / name)


def test_the_prose_has_the_diffusion_coefficients_that_the_command_prints() -> None:
    text = text_of(DOCS / "student.md")
    value = r"([\d.]+ ± [\d.]+)\s+m²/s"
    printed = re.findall(rf"Diffusion\s+coefficient\s+D\s+=\s+{value}", text)
    assert len(printed) == 2
    shown = re.findall(value, text)
    assert set(shown) == set(printed)
    assert len(shown) == 4  # the prose has each, too


def test_python_blocks_print_what_their_document_shows(
    agree: Agree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path, names = DOCS / "python.md", {"__name__": "__main__"}
    blocks = PYTHON.findall(text_of(path))
    assert len(blocks) >= 6
    agree(path, ((shown, printed_by(code, names)) for code, shown in blocks))


SLURM = """
from unittest.mock import MagicMock

SLURMCluster = MagicMock()
cluster = SLURMCluster.return_value.__enter__.return_value
cluster.scheduler_address = "tcp://10.0.0.1:8786"
"""


def test_the_script_for_slurm_runs_the_command(tmp_path: Path) -> None:
    """With substitutes for SLURM and snooker."""
    (tmp_path / "on_slurm.py").write_text(block(DOCS / "cluster.md", "python"))
    (tmp_path / "dask_jobqueue.py").write_text(SLURM)
    (tmp_path / "snooker").write_text('#!/bin/sh\necho "$@"')
    (tmp_path / "snooker").chmod(0o755)
    done = subprocess.run(
        [sys.executable, "on_slurm.py", "decay.yaml", "--out", "decay"],
        cwd=tmp_path,
        env={**os.environ, "PATH": os.pathsep.join([str(tmp_path), os.environ["PATH"]])},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "run decay.yaml --out decay --executor dask=tcp://10.0.0.1:8786\n"


def test_the_site_has_all_pages_and_known_figures_and_the_citation_this_version() -> None:
    assert yaml.safe_load(text_of(ROOT / "CITATION.cff"))["version"] == __version__
    groups = yaml.safe_load(text_of(ROOT / "mkdocs.yml"))["nav"]
    pages = {page for group in groups for pages in group.values() for page in pages}
    assert {path.name for path in DOCS.glob("*.md")} - {"gallery.md"} < pages
    figures = runpy.run_path(str(DOCS / "site" / "gallery.py"))["FIGURES_OF"].values()
    names = [name for _, figures_of_run in figures for name in figures_of_run]
    assert len(names) >= 20
    assert FIGURES.keys() >= {*names}


def test_all_commands_have_the_help_that_their_page_shows(
    agree: Agree, snooker: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    path = DOCS / "cli.md"
    shown = HELP.findall(text_of(path))
    commands = ["snooker", *(f"snooker {name}" for name in COMMANDS)]
    commands += [f"snooker bench {name}" for name in loaded("bench").commands]
    assert {command for command, _ in shown} == {*commands}
    agree(path, ((text, run_line(f"{command} --help", snooker)) for command, text in shown))
    codes = re.findall(r"^\| (\d+) \|", text_of(path), re.MULTILINE)
    assert codes == [str(int(code)) for code in ExitCode]


def test_the_configs_shown_are_the_files() -> None:
    assert parse(block(TUTORIAL, "yaml")).config == load(templates()["haff"]).config
    shown = parse(block(README, "yaml")).config
    decay = load(ROOT / "configs" / "decay.yaml").config
    assert digest(shown) == digest(decay)
    assert (shown.sweep, shown.repeats) == (decay.sweep, decay.repeats)


def test_the_schema_of_the_command_and_of_the_configs_is_that_of_the_models(
    snooker: Callable[..., Any],
) -> None:
    made = json.loads(make_schema.text())  # some versions of pydantic write 0.0 for 0
    assert json.loads(run_line("snooker schema", snooker)) == made
    stored = json.loads(text_of(make_schema.FILE))
    assert stored == made, "configs/schema.json is another; run python tests/make_schema.py"


def test_links_lead_to_files_and_headings() -> None:
    for path in (*ROOT.glob("*.md"), *DOCS.glob("*.md")):
        for link, heading in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", text_of(path)):
            if not link.startswith("https://"):
                target = path.parent / link if link else path
                assert target.exists(), (path, link)
                found = re.findall(r"^#+ (.*)", text_of(target), re.MULTILINE) if heading else ()
                named = {re.sub(r"[^\w -]", "", text.lower()).replace(" ", "-") for text in found}
                assert not heading or heading in named, f"{path}: {link}#{heading}"


def test_files_that_developers_are_sent_to_exist() -> None:
    for path in (ROOT / "CONTRIBUTING.md", DOCS / "architecture.md"):
        for name in re.findall(r"`([\w./]+/[\w.]+\.[a-z0-9]+)`", text_of(path)):
            here = (ROOT / name).exists() or any((ROOT / "snooker_cli").rglob(name))
            assert here or "NAME" in name, (path, name)


def test_errors_and_costs_are_the_saved_measurements() -> None:
    text, found = sentences_of(ACCURACY), measurement("error")
    scene = found["scenes"][0]
    place = scene["checkpoints"].index(100)
    ours, source, coarse, *_, fine = scene["results"]
    for one in (ours, source, coarse, fine):
        error = short(one["place_errors"][place], 2)
        assert f"| {error} m | {rough(one['events_per_second'])} |" in text
    for value in (source["first_different"] + 1, short(source["overlap"], 2)):
        assert str(value) in text
    assert f"{found['date'][:10]} on one processor: {found['machine']['processor']}" in text
    for proof in measurement("certain")["proofs"]:
        certain = " to ".join(dict.fromkeys(f"{number:,}" for number in proof["certain"]))
        row = f"{proof['points']} | {proof['events']:,} | {certain} | {proof['all']}"
        assert f"| `{proof['config']}` | {row} |" in text


def test_agreement_with_known_physics_is_that_of_the_saved_measurement() -> None:
    text, rows = sentences_of(ACCURACY), measurement("physics")["rows"]
    closed = [row["agreement"] for row in rows if not row["systematic"]]
    others = [row["agreement"] for row in rows if row["systematic"]]
    assert set(closed) == {"yes"}
    within = f"agree within {measurement('physics')['allowed_errors']:g} standard errors"
    assert f"All {len(closed)} values without an uncertainty of their own {within}" in text
    assert f"So do {others.count('yes')} of the {len(others)} others" in text
    # The uncertainty of pressures on walls was chosen from these rows, that of rough balls is the
    # distance from the direct simulation; both documents say so.
    paper = " ".join(text_of_file("templates/paper.md.j2").split())
    assert f"We chose {100 * SCALED_PARTICLES:g} % for pressures on walls" in paper
    assert f"We chose {100 * SCALED_PARTICLES:g} %" in text
    for row in rows:
        if row["source"].startswith("mean field") and row["quantity"] == "T_rot/T_tr":
            beta = row["setting"]["keys"]["tangential_cor"]
            apart = abs(row["expected"] - DIRECT_ROUGH[beta]["ratio"][0])
            assert row["systematic"] == pytest.approx(apart)
    for row in rows:
        if row["agreement"] != "yes":
            assert row["agreement"] == "only with open"
            side = "below" if row["left_in_errors"] < 0 else "above"
            number = re.compile(rf" {abs(row['left_in_errors']):.1f}[ ,]")
            assert any(number.search(one) and side in one for one in text.split(". ")), number


def test_the_table_of_rough_balls_is_that_of_the_saved_measurement() -> None:
    """The last columns are those of tests/validation/direct_simulation.py."""
    text, of_gas = ACCURACY.read_text("utf-8"), {}
    for row in measurement("physics")["rows"]:
        if row["quantity"] == "T_rot/T_tr" and row["source"] == DIRECT:
            of_gas[row["setting"]["keys"]["tangential_cor"]] = row
    assert of_gas.keys() == ROUGH_MOMENTS.keys()
    farthest = max(abs(row["left_in_errors"]) for row in of_gas.values())
    sentence = f"of the five values, the farthest is {farthest:.1f} standard errors away"
    assert sentence in sentences_of(ACCURACY)
    for beta, row in of_gas.items():
        limit = two_temperatures.rough_ratio(0.9, beta, 0.5)
        measured = with_error(row["measured"], row["error"])
        kurtosis, correlation = (f"{value:.3f}" for value in ROUGH_MOMENTS[beta])
        simulated = with_error(row["expected"], row["expected_error"])
        cells = f"{beta:g}", measured, simulated, short(limit, 4), kurtosis
        line = " | ".join((*cells, correlation)).replace("-", "−")
        assert f"| {line} |" in text
        above = 100 * (limit / row["expected"] - 1)
        assert (2.45 < above < 5.85) is (beta < 0.9)


def simulated(name: str, folder: Path) -> RunFolder:
    """The run of a config."""
    run = repeating.created(folder / name, load(ROOT / "configs" / f"{name}.yaml").config)
    assert not any(result.error for result in repeating.done(run))
    return run


def test_the_audit_of_the_source_report() -> None:
    """The sentences in docs/accuracy.md and the README, from the saved results."""
    found = json.loads((ROOT / "tests" / "golden" / "reproduction.json").read_text("utf-8"))
    text, readme, rows = sentences_of(ACCURACY), sentences_of(README), found["printed"]
    agree, follow, again = (
        sum(map(bool, (row[key] for row in rows))) for key in ("agrees", "follows", "repeats")
    )
    assert f"Of {len(rows)} numbers that it prints about its results, {agree} agree" in text
    assert f"Of {len(rows)} numbers, {agree} agree" in readme
    assert f"{follow} follow from others, and {again} are printed again" in text
    factors = decay_factors(found)
    for one in (text, readme):
        assert f"are {min(factors):.0f} to {max(factors):.0f} times as large" in one
        best = [*found["explanations"].values()][-1]
        assert f"gives {len(best['agreeing'])} of {len(best['values'])}" in one
    stated = found["stated"].values()
    counts = [sum(one[key] for one in stated) for key in ("complete", "repeats")]
    assert "{} of {} complete".format(*counts) in text
    slopes = [f"{one['slope']['value']:.2f}" for one in stated]
    rates = "falls at {} (CoR 0.8) and {} (CoR 0.9) of the logarithmic rate".format(*slopes)
    assert rates in text
    rings = max(row["excess"] for row in found["haff"]["restitution"])
    assert f"α is up to {100 * rings:.0f} % too high" in text
    mixed = [row["excess"] for rows in found["mixed"] for row in rows]
    low, high = f"{-100 * min(mixed):.1f}", f"{100 * max(mixed):.1f}"
    assert f"it is {low} % too low to {high} % too high" in text


@pytest.mark.long
def test_haffs_law_depends_on_the_start_and_the_error_of_a_single_fit_is_too_small(
    tmp_path: Path,
) -> None:
    """The sentences in docs/accuracy.md on Haff's law with the stated wall.

    The factor in the README is the spread over repeats, over the error that a fit gives.
    """
    held, factors = {}, []
    for name in ("restitution", "mixed"):
        run = simulated(name, tmp_path)
        for point in run.points:
            if point.config.wall_cor is None and point.config.cor < 1:
                models = decays(run.traces(point), ("kinetic_energy",))
                held[name, point.config.cor] = models[1].goodness
                for model in models if name == "restitution" else ():
                    spread = model.over_repeats.error * math.sqrt(model.over_repeats.repeats)
                    factors.append(spread / np.median([fit.error for fit in model.fits]))
    text = sentences_of(ACCURACY)
    for cor in (0.8, 0.95):
        assert held["restitution", cor].probability < 0.001
        assert held["restitution", cor].holds_to == held["restitution", cor].judged_from
    assert held["mixed", 0.95].holds_to == held["mixed", 0.95].judged_to
    assert f"at CoR 0.95 (p = {held['mixed', 0.95].probability:.2g})" in text
    assert f"for {held['mixed', 0.8].holds_to:.2g} s at CoR 0.8" in text
    factor = f"{min(factors):.0f} to {max(factors):.0f} times too small"
    assert factor in sentences_of(README)


def test_only_without_a_common_rotation_a_driven_gas_forgets_its_start() -> None:
    """The sentence in docs/how-it-works.md; errors are standard errors of independent means."""
    found = {}
    for rotates in ("true", "false"):
        for speed in (10, 40):
            balls = f"{{rings: 3, radius: 1, speed: {speed}, common_rotation: {rotates}}}"
            text = f"container: {{radius: 10}}\nballs: {balls}\ncor: 0.9\nwall_cor: 1\n"
            gas = parse(f"{text}wall_speed: 1\ncollisions: 10000\n").config
            starts = starting_scenes(gas, range(100))
            rows, notes = compare(simulate_batch(starts, collisions=10_000, summary=True))
            (warm,) = (row for row in rows if row.quantity == "temperature")
            found[rotates, speed] = warm
            (note,) = (note.note for note in notes if note.note.startswith("common rotation: "))
            assert ("`common_rotation: false`" in note) == (rotates == "true")
    (slow, fast), (slower, faster) = (
        [found[rotates, speed] for speed in (10, 40)] for rotates in ("true", "false")
    )
    assert abs(fast.measured - slow.measured) > 4 * math.hypot(fast.error, slow.error)
    assert abs(faster.measured - slower.measured) < 3 * math.hypot(faster.error, slower.error)
    for turning, still in ((slow, slower), (fast, faster)):
        assert turning.measured - still.measured > 4 * math.hypot(turning.error, still.error)
    values = [with_error(row.measured, row.error) for row in (slow, fast, slower, faster)]
    text = sentences_of(DOCS / "how-it-works.md")
    assert "reach {} J from 10 m/s and {} J from 40 m/s (100 repeats)".format(*values) in text
    assert "Then they reach {} J and {} J".format(*values[2:]) in text


def test_200_repeats_refuse_haffs_law_where_10_do_not(tmp_path: Path) -> None:
    """The sentences in docs/student.md on the cooling gas."""
    text = templates()["report"].read_text("utf-8")
    assert "200 refuse it" in sentences_of(STUDENT)
    for repeats, is_refused in ((10, False), (200, True)):
        run = repeating.made(tmp_path / str(repeats), text, "cor=0.85", f"repeats={repeats}")
        repeating.done(run)
        (point,) = run.points
        haff = decays(run.traces(point), ("kinetic_energy",))[1]
        assert (haff.goodness.probability < 0.01) == is_refused
