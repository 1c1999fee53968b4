"""Series that a reader tells apart: with the three common kinds of colour blindness, and in grey.

What a colour-blind reader sees is simulated by the matrices of Machado, Oliveira & Fernandes (IEEE
Trans. Vis. Comput. Graph. 15, 1291, 2009, doi:10.1109/TVCG.2009.113), severity 1, in linear RGB.
Differences are distances in CIELAB (CIE 1976), where 2.3 is just noticeable (Mahy, Van Eycken &
Oosterlinck, Color Res. Appl. 19, 105, 1994).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from figure_runs import shown
from matplotlib.colors import to_rgb

from snooker_cli.figures.figure_data import MOST_ENTRIES, NEUTRAL, Line
from snooker_cli.figures.legends import _HUES, _MARKERS, colour, pattern
from snooker_cli.figures.series import MOST_SERIES
from snooker_cli.runs import RunFolder

SEEN = {
    "usual": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
JUST_NOTICEABLE = 2.3
APART = 17.0
"""The least difference of two colours of series, for each reader: over seven times noticeable."""

GREY_APART = 6.0
"""The least difference in lightness of two series in grey that have the same markers."""

NAMED = 10  # colours; a further series has the colour of an earlier one, with another marker


def lab(name: Any, sight: str = "usual") -> np.ndarray:
    """CIELAB (D65) of a colour of matplotlib as a reader sees it."""
    rgb = np.array(to_rgb(name))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(SEEN[sight] @ linear, 0.0, 1.0)
    xyz = (
        np.array(
            [
                [0.4124564, 0.3575761, 0.1804375],
                [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041],
            ]
        )
        @ linear
        / (0.95047, 1.0, 1.08883)
    )
    x, y, z = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_the_simulation_has_known_values() -> None:
    """White and grey stay; pure red is L 53.24, a 80.09, b 67.20, and darker without red cones."""
    for sight in SEEN:
        assert lab("white", sight) == pytest.approx([100, 0, 0], abs=0.1)
        assert lab("0.5", sight)[1:] == pytest.approx([0, 0], abs=0.1)
    assert lab("red") == pytest.approx([53.24, 80.09, 67.20], abs=0.05)
    assert lab("red", "protanopia")[0] < 0.8 * lab("red")[0]


def least(colours: Sequence[str], sight: str) -> float:
    pairs = itertools.combinations([lab(name, sight) for name in colours], 2)
    return float(min(np.linalg.norm(one - two) for one, two in pairs))


@pytest.mark.parametrize("sight", SEEN)
def test_colours_of_series_differ_for_every_reader(sight: str) -> None:
    assert least([colour(series) for series in range(NAMED)], sight) >= APART
    # The one colour of what belongs to no series is darker than all of them.
    assert min(lab(colour(k))[0] for k in range(6)) > lab(colour(NEUTRAL))[0]


def test_series_in_grey_differ_in_lightness_or_in_markers() -> None:
    assert len(_MARKERS) == len({pattern(k) for k in range(MOST_SERIES)})
    for one, two in itertools.combinations(range(MOST_SERIES), 2):
        if pattern(one) == pattern(two):
            assert abs(lab(colour(one))[0] - lab(colour(two))[0]) >= GREY_APART, (one, two)


@pytest.mark.parametrize("number", [2, MOST_ENTRIES, 8, MOST_SERIES])
@pytest.mark.parametrize("sight", SEEN)
def test_shades_of_a_sweep_differ_for_every_reader_and_rise_in_grey(
    sight: str, number: int
) -> None:
    shades = tuple(np.linspace(0, 1, number))
    colours = [colour(series, shades) for series in range(number)]
    assert least(colours, sight) >= JUST_NOTICEABLE
    lightness = [lab(name, sight)[0] for name in colours]
    assert min(np.diff(lightness)) > 0
    assert min(np.diff([lab(name)[0] for name in colours])) >= JUST_NOTICEABLE


def test_no_colour_is_too_pale_on_white() -> None:
    """A line of lightness 100 is not there. The palest of all is a light blue."""
    ranks = tuple(np.linspace(0, 1, MOST_SERIES))
    palest = [colour(k, (1.0,) * len(_HUES), range(len(_HUES))) for k in range(len(_HUES))]
    drawn = [*palest, *(colour(series, ranks) for series in range(MOST_SERIES))]
    assert max(lab(name)[0] for name in drawn) <= 82


def test_what_is_fitted_and_what_is_predicted_have_colours_of_their_own(
    decaying: RunFolder,
) -> None:
    """Of one point, all lines of Haff's law had one colour."""
    found = shown(decaying, "cooling", cor=0.8)
    lines = [layer for layer in found.layers if isinstance(layer, Line)]
    fitted, theory = (
        [line for line in lines if line.label and word in line.label]
        for word in ("fitted", "hard disks")
    )
    colours = [line.series for line in (*fitted, *theory)]
    assert len(fitted) == 1
    assert len(set(colours)) == len(colours) == 2


@pytest.mark.parametrize(
    "name",
    ["energy", "pressure", "pair-distances", "pair-correlation", "a2"],
)
def test_a_single_curve_has_a_legend_entry(name: str, decaying: RunFolder) -> None:
    found = shown(decaying, name, cor=0.8)
    named = [layer for layer in found.layers if str(layer.label).startswith("simulation")]
    assert len(named) == 1
    assert named[0].label == "simulation"
    assert len(named[0].x) > 0


def test_a_curve_that_the_legend_explains_has_no_second_name(driven: RunFolder) -> None:
    found = shown(driven, "energy-balance", cor=0.9)
    labels = [layer.label for layer in found.layers if layer.label]
    assert "in: walls give" in labels
    assert not any(label.startswith("simulation") for label in labels)
