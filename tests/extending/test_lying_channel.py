"""A shape that is not shipped: a channel that lies, with walls below and above.

From a config to a film, with what someone adds to the package. It is a channel turned by 90°, so
that all its results are known.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from extended import SAME_IN_V8, Edits, Extended

EDITS: Edits = {
    "containers.py": [
        (
            "SHAPES: dict[str, type[Container]] = {\n",
            '''\
@dataclass(frozen=True)
class LyingChannel(Rectangle):
    """A rectangle between a lower and an upper wall that repeats for ever to the left and right."""

    name: ClassVar[str] = "lying"
    title: ClassVar[str] = "lying channel"
    sides: ClassVar[tuple[str, ...]] = ("bottom", "top")
    across: ClassVar[Direction | None] = "y"
    periodic: ClassVar[tuple[bool, bool]] = (True, False)


SHAPES: dict[str, type[Container]] = {
''',
        ),
        (
            "(Circle, Box, PeriodicBox, Channel)\n",
            "(Circle, Box, PeriodicBox, Channel, LyingChannel)\n",
        ),
    ],
    "engine/boundaries.py": [
        (
            "# The boundary of a container\n",
            '''\
class LyingSides(
    Edge, NamedTuple("LyingSides", [("half_height", float), ("width", float)])
):
    """Fixed walls below and above; balls that leave right enter left. Half the height, width, m."""

    def time_at_wall(self, i: int, state: State) -> float:
        y, v = state.balls[Y, i], state.balls[V, i]
        reach = self.half_height - state.sizes.radius_of(i)
        delay = ((reach if v > 0.0 else -reach) - y) / v
        return float(state.balls[CLOCK, i] + max(delay, 0.0)) if v != 0.0 else NEVER

    def hit_wall(self, i: int, _now: float, state: State, elastic: bool) -> float:
        return hit_side(i, False, state, elastic)

    def nearest_image(self, x: float, y: float) -> tuple[float, float]:
        return x - self.width * np.rint(x / self.width), y

    def image_nearest_at(
        self, x: float, y: float, way_x: float, _way_y: float
    ) -> tuple[float, float]:
        return x - self.width * np.rint((x + way_x) / self.width), y

    def search_until(self, i: int, now: float, wall_time: float, state: State) -> float:
        return min(wall_time, now + image_delay(U, self.width, i, state))

    def same_image(self, x: float, _y: float, new_x: float, _new_y: float) -> bool:
        return bool(np.rint(x / self.width) == np.rint(new_x / self.width))

    def wrapped(self, column: int, row: int, columns: int, _rows: int) -> tuple[int, int]:
        column += columns if column < 0 else 0
        column -= columns if column >= columns else 0
        return column, row


# The boundary of a container
''',
        ),
        (
            '    "periodic": lambda width, height: PeriodicSides(width, height),\n',
            """\
    "periodic": lambda width, height: PeriodicSides(width, height),
    "lying": lambda width, height: LyingSides(height / 2, width),
""",
        ),
    ],
}

PLACES = [(x, y) for x in (-3.5, -1.0, 1.5) for y in (-4.5, -1.5, 1.5, 4.5)]
SPEEDS = [((3 * k) % 7 - 3.0, (5 * k) % 11 - 4.5) for k in range(12)]


def listed(shape: str, *, turned: bool) -> str:
    """The same balls in a channel 10 m wide and 14 m long, or all of it turned."""

    def pair(values: tuple[float, float]) -> list[float]:
        return [*(values[::-1] if turned else values)]

    balls = [
        {"position": pair(place), "velocity": pair(speed), "radius": 0.6}
        for place, speed in zip(PLACES, SPEEDS, strict=True)
    ]
    width, height = pair((10.0, 14.0))
    container = {"shape": shape, "width": width, "height": height}
    config = {"container": container, "balls": {"list": balls}, "cor": 0.9, "collisions": 200}
    return json.dumps(config)


WARM = """\
container: {shape: SHAPE, width: 20}
balls: {count: 30, radius: 0.5, speed: 5}
cor: 1
wall_temperature: {FIRST: 20, LAST: 80}
collisions: 3000
repeats: 6
"""


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Extended:
    """The package with this shape, and runs in it and in the channel that it is turned from."""
    extended = Extended(EDITS, tmp_path_factory.mktemp("lying"))
    extended.run("upright", listed("channel", turned=False))
    extended.run("lying", listed("lying", turned=True))
    return extended


def test_a_shape_needs_two_files() -> None:
    assert len(EDITS) == 2


def test_its_collisions_are_those_of_the_channel_to_the_bit(extended: Extended) -> None:
    script = """
import json, snooker_cli
print(json.dumps([snooker_cli.open(name)[0, 0].hashes() for name in ("upright", "lying")]))
"""
    upright, lying = extended.value(script)
    assert upright == lying


def test_each_wall_gives_the_energy_of_the_wall_that_it_is_turned_from(extended: Extended) -> None:
    """Left and right are below and above, to the bit."""
    script = """
import json
from dataclasses import replace
import numpy as np
import snooker_cli
from snooker_cli.analysis.observables import wall_energies
from snooker_cli.engine import series, simulate
from snooker_cli.laws import Constant, Driven, Sides
given = []
for name, laws in (("upright", (0, 1, 2, 3)), ("lying", (2, 3, 0, 1))):
    walls = Driven(0.9, 2.0), Driven(0.9, 0.5), Constant(0.5), Constant(0.5)
    scene = replace(
        snooker_cli.open(name)[0, 0].scene, wall_law=Sides(*(walls[k] for k in laws))
    )
    trace = simulate(scene, collisions=200)
    edges = np.array([0.0, trace.stop.time])
    given.append(wall_energies(trace, series(trace).kinetic_energy, edges)[0].tolist())
print(json.dumps(given))
"""
    upright, lying = extended.value(script)
    assert upright == pytest.approx(lying, rel=1e-12)
    assert upright[0] > 2 * upright[1] > 0


def test_theories_that_need_walls_all_round_are_missing(extended: Extended) -> None:
    models = {row["model"] for row in json.loads(extended.snooker("compare", "lying", "--json"))}
    assert not models & {"hard disks, finite N", "fixed energy"}
    text = " ".join(extended.snooker("compare", "lying").split())
    assert "there is no theory for N balls in a lying channel" in text


def numbers_of(extended: Extended, figure: str) -> dict[str, float]:
    """The numbers of the only point in a figure of the warm gas."""
    drawn = Path(extended.folder, f"runs/warm/figures/{figure}.json").read_text("utf-8")
    (point,) = json.loads(drawn)["numbers"]["points"]
    return point


def test_a_figure_goes_from_wall_to_wall(extended: Extended) -> None:
    """The gas is warmer at the upper wall, which has four times the temperature."""
    warm = WARM.replace("SHAPE", "lying").replace("FIRST", "bottom").replace("LAST", "top")
    with extended.compiling():
        extended.run("warm", warm)
        extended.snooker("plot", "warm", "profiles", "heat-flux")
    profile, flux = numbers_of(extended, "profiles"), numbers_of(extended, "heat-flux")
    assert profile["first_temperature"] < 0.7 * profile["last_temperature"]
    # Downwards, and of elastic balls the same through both walls.
    assert flux["top"] < -5 * flux["top_error"]
    assert abs(flux["top"] - flux["bottom"]) < 4 * math.hypot(
        flux["top_error"], flux["bottom_error"]
    )


def test_its_geometry_is_that_of_the_channel(extended: Extended) -> None:
    script = """
import json
import numpy as np
from snooker_cli.containers import SHAPES
lying, upright = SHAPES["lying"](14.0, 10.0), SHAPES["channel"](10.0, 14.0)
places = np.array([(6.5, 4.2), (-3.0, -1.0), (0.0, -4.9)])
turned, radii, rings = places[:, ::-1].copy(), np.full(3, 0.5), np.array([1.0, 2.0, 4.0])
pairs = [
    (lying.accessible(0.5), upright.accessible(0.5)),
    (lying.wall_gaps(places, radii), upright.wall_gaps(turned, radii)),
    (lying.wall_directions(places), upright.wall_directions(turned)[:, ::-1]),
    (lying.ring_shares(places, rings, 0.5), upright.ring_shares(turned, rings, 0.5)),
    (lying.distance_density(rings, 0.5), upright.distance_density(rings, 0.5)),
    (lying.longest_wave, upright.longest_wave),
    (lying.side_lengths(0.5)["top"], upright.side_lengths(0.5)["right"]),
    (np.sort(lying.wall_lines, axis=None), np.sort(upright.wall_lines, axis=None)),
]
print(json.dumps([bool(np.allclose(*pair, rtol=1e-12)) for pair in pairs]))
"""
    assert extended.value(script) == [True] * 8


def test_films_draw_it(extended: Extended) -> None:
    extended.snooker("animate", "lying", "--out", "lying.gif", "--seconds", "1")
    assert Path(extended.folder, "lying.gif").read_bytes().startswith(b"GIF89a")
    with extended.compiling():
        here, stored = extended.value(SAME_IN_V8.format(boundaries=["lying"], run="lying"))
    assert here == stored


def test_pages_draw_its_walls_and_know_its_theory(extended: Extended) -> None:
    script = """
import json
from javascript import JavaScript
from snooker_cli.live_page.page import LIVE
from snooker_cli.pages.html_page import PAGES, text_of
lying = json.dumps(dict(shape="lying", size=[14.0, 10.0]))
with JavaScript(["lying"]) as page:
    page.context.eval(text_of(LIVE, "theory.js") + text_of(PAGES, "arena.js"))
    view = page.answer(f"JSON.stringify(viewOf({lying}))")
    region = page.answer(f"JSON.stringify(accessible({lying}, 0.5))")
    others = page.answer(
        f"JSON.stringify([hasWalls({lying}), keepsDrift({lying}), wallLengthOf({lying})])"
    )
print(json.dumps([view["sides"], view["periodic"], region, others]))
"""
    with extended.compiling():
        sides, repeats, region, others = extended.value(script)
    assert (sides, repeats) == (["bottom", "top"], True)
    assert region == {"area": 14 * 9, "edge": 28, "spreading": 0}
    assert others == [True, True, 28]


def test_the_exact_twin_proves_its_collisions(extended: Extended) -> None:
    script = """
from exact import compared
import snooker_cli
print(compared(snooker_cli.open("lying")[0, 0].scene, 30))
"""
    assert extended.value(script) == 30
