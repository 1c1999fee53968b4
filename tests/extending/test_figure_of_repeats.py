"""A figure that is not shipped: a histogram over the repeats. It is one function and its words."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from extended import Edits, Extended
from figure_runs import made

EDITS: Edits = {
    "figures/conservation.py": [
        (
            "def energy(build: FigureBuilder)",
            '''\
def energies_left(build: FigureBuilder) -> FigureData:
    """How many repeats have which share of the energy left."""
    for index, point in enumerate(build.points):
        left = course(build.measurement(point), "kinetic_energy").value[:, -1]
        repeats, edges = np.histogram(left)
        build.add_histogram(index, point, edges, repeats, np.full(len(repeats), np.nan))
        build.record(point, left=mean_and_error(left))
    return build.figure()


def energy(build: FigureBuilder)''',
        )
    ],
    "figures/registry.yaml": [
        (
            "snapshot:\n",
            """\
energies-left:
  title: Energies at the end
  draw: conservation.energies_left
  result: {quantity: energy left at the end, number: left, when: at the end}
  needs: Any run.
  shows: The number of repeats by the energy at the end over that at the start.
  x_label: E / E(0)
  y_label: number of repeats

snapshot:
""",
        )
    ],
}


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """The package with this figure, and a run of the package without it."""
    extended = Extended(EDITS, tmp_path_factory.mktemp("repeats"))
    made(extended.folder / "gas", "record=summary", "cor=0.8", "repeats=8")
    return extended


def test_a_figure_is_a_function_and_its_words() -> None:
    assert len(EDITS) == 2


def test_its_caption_has_the_result(extended: Extended) -> None:
    printed = " ".join(extended.snooker("plot", "gas", "energies-left").split())
    assert [*Path(extended.folder, "gas/figures").glob("energies-left.svg")]
    result = r"at the start\. Energy left E/E₀ at the end = 0\.\d+ ± 0\.\d+\. "
    assert re.search(result, printed), printed


def test_reports_have_it_last(extended: Extended) -> None:
    script = "import json; from snooker_cli.report import run_report as r; "
    assert extended.value(f"{script}print(json.dumps(r.ordered()[-1]))") == "energies-left"
