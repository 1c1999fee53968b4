"""Random directions and normal deviates: the same bits everywhere, distributed as they should."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scenes import EPSILON
from scipy import stats

from snooker_cli.placement.random_numbers import logarithm, random_directions, random_normals

GOLDEN = {  # seed, repeat -> the first directions
    (1, 0): [
        ("0x1.0affd677f88eep-1", "-0x1.b4deb3eeb99f8p-1"),
        ("0x1.41922ab5871b4p-1", "-0x1.8e6ac142b40e6p-1"),
        ("-0x1.6c749bb11601dp-1", "0x1.679b08a5401fap-1"),
    ],
    (7, 3): [
        ("-0x1.ff97df78ecaf6p-1", "0x1.4678bff620424p-5"),
        ("-0x1.fc400db8088cbp-1", "0x1.eed1cdaab8096p-4"),
    ],
}


@pytest.mark.parametrize(("seed", "repeat"), GOLDEN)
def test_golden_directions(seed, repeat):
    expected = GOLDEN[seed, repeat]
    directions = random_directions(len(expected), seed, [repeat])[0].tolist()
    assert [(u.hex(), v.hex()) for u, v in directions] == expected


@pytest.fixture(scope="module")
def directions() -> np.ndarray:
    """100,000 of them."""
    return random_directions(100_000, 1, [0])[0]


def test_directions_are_unit_vectors(directions):
    assert np.max(abs(np.hypot(*directions.T) - 1)) <= 2 * EPSILON


def test_directions_are_uniform(directions):
    """By Kolmogorov and Smirnov on the circle and on its first four harmonics."""
    angles = np.arctan2(directions[:, 1], directions[:, 0])
    assert stats.kstest(angles, stats.uniform(-math.pi, 2 * math.pi).cdf).pvalue > 0.001
    for harmonic in (1, 2, 3, 4):
        # The mean of n unit vectors has |mean|^2 n ~ exponential(1).
        resultant = abs(np.mean(np.exp(1j * harmonic * angles))) ** 2 * len(angles)
        assert resultant < -math.log(0.001)


def test_normal_deviates():
    normals = random_normals(50_000, 1, [0])[0]
    for component in normals.T:
        assert stats.kstest(component, stats.norm.cdf).pvalue > 0.001
    assert abs(np.mean(normals[:, 0] * normals[:, 1])) < 4 / math.sqrt(50_000)
    assert abs(np.mean(normals[1:, 0] * normals[:-1, 1])) < 4 / math.sqrt(50_000)
    assert np.array_equal(normals[:100], random_normals(100, 1, [0])[0])
    assert not np.isin(normals, random_normals(100, 1, [1])[0]).any()
    assert np.isfinite(normals).all()


def test_golden_normal_deviates():
    """The bits from which stored runs started, on any machine."""
    assert [[x.hex() for x in pair] for pair in random_normals(2, 1, [0])[0].tolist()] == [
        ["-0x1.993e50a57ffefp+0", "-0x1.19a77a260976fp-1"],
        ["-0x1.9308e93dd6f8cp-1", "0x1.6c646aca89cc3p-2"],
    ]


def test_the_logarithm_is_that_of_decimals():
    """To two units in the last place, or of one near 1, where it vanishes."""
    random = np.random.default_rng(1)
    values = np.concatenate(
        [random.random(2000), 2.0 ** -random.integers(0, 110, 50), 1 - random.random(200) * 1e-6]
    )
    with localcontext() as context:
        context.prec = 40
        for value, found in zip(values.tolist(), logarithm(values).tolist(), strict=True):
            exact = Decimal(value).ln()
            assert abs(Decimal(found) - exact) <= 2 * Decimal(EPSILON) * abs(exact)
    assert logarithm(np.array([1.0]))[0] == 0.0
