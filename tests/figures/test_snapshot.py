"""Pictures of states: which states, colours and pixels they have."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from figure_runs import STORED
from matplotlib.collections import LineCollection
from matplotlib.text import Text
from PIL import Image
from repeating import done, made

from snooker_cli.containers import Box, Channel, Container, PeriodicBox
from snooker_cli.engine import replay
from snooker_cli.errors import FigureError
from snooker_cli.figures.drawing import draw, save, to_json
from snooker_cli.figures.figure_data import FigureData, Picture, Pictures
from snooker_cli.figures.registry import FIGURES
from snooker_cli.figures.state_pictures import raster
from snooker_cli.figures.style import styled
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection

MIXTURE = """\
container: {shape: channel, width: 12, height: 10}
balls:
  - {count: 6, radius: 0.5, mass: 2, speed: 1}
  - {count: 20, radius: 0.25, mass: 1, speed: 1}
cor: 0.9
time: 20
"""


@pytest.fixture(scope="module")
def mixture(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    run = made(tmp_path_factory.mktemp("states") / "run", MIXTURE)
    done(run)
    return run


def drawn(run: RunFolder, *times: float, colour: str | None = None) -> FigureData:
    return FIGURES["snapshot"].make(run, Selection(times=times, colour=colour))


def test_it_shows_the_states_of_a_repeat(mixture: RunFolder) -> None:
    trace = mixture.read(mixture.points[0], 0)
    figure = drawn(mixture, 3.0, 7.5)
    states = replay(trace, [3.0, 7.5])
    for k, picture in enumerate(figure.pictures.each):
        assert picture.time == states.time[k]
        assert np.array_equal(picture.places, states.positions[k])
        speeds = np.hypot(*states.velocities[k].T)
        assert np.allclose(picture.values, speeds)
    assert "nearest" not in figure.caption
    (last,) = drawn(mixture, 20.0).pictures.each
    assert last.time == 20.0
    assert np.array_equal(last.values, np.hypot(*trace.finish.velocities.T))


def test_colours_show_species_and_density(mixture: RunFolder) -> None:
    species = drawn(mixture, 3.0, colour="species").pictures
    assert species.names == ("r = 0.5 m, m = 2 kg", "r = 0.25 m, m = 1 kg")
    assert species.each[0].values.tolist() == [0.0] * 6 + [1.0] * 20
    (dense,) = drawn(mixture, 3.0, colour="density").pictures.each
    area = 6 * math.pi * 0.25 + 20 * math.pi * 0.0625
    shares = math.pi * dense.radii**2 / dense.values
    assert shares.sum() <= 120 * (1 + 1e-9)  # of cells with balls
    assert 0.5 * area / 120 < np.mean(dense.values) < 4 * area / 120
    figure = drawn(mixture, 3.0, colour="density")
    assert 0 < figure.pictures.limits[0] <= dense.values.min()
    assert "White space has no balls." in figure.caption


def test_many_balls_have_cells_in_the_tones_of_the_scale(
    mixture: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Balls smaller than a dot of the printer would be paler than their packing."""
    figure = drawn(mixture, 3.0, colour="density")
    (picture,) = figure.pictures.each
    assert picture.cells is not None
    rows, columns = picture.cells.shape
    # The cells share out the channel, so their packings have the area of all balls.
    area = 6 * math.pi * 0.25 + 20 * math.pi * 0.0625
    assert picture.cells.mean() * 120 == pytest.approx(area, rel=1e-9)
    shares = picture.places / picture.size + 0.5
    column, row = (shares * (columns, rows)).astype(int).T
    assert np.array_equal(picture.cells[row, column], picture.values)
    monkeypatch.setattr("snooker_cli.figures.state_pictures.MOST_CIRCLES", 0)
    (image,) = draw(figure).axes[0].images
    occupied = picture.cells > 0
    seen = image.cmap(image.norm(image.get_array()))[..., :3]
    assert np.all(seen[~occupied] == 1.0)
    scale = image.cmap(image.norm(picture.cells[occupied]))[..., :3]
    assert np.array_equal(seen[occupied], scale)
    speeds = draw(drawn(mixture, 3.0)).axes[0].images[0].get_array()
    assert speeds.shape[-1] == 4  # other colours are those of the balls
    assert drawn(mixture, 3.0).pictures.each[0].cells is None


def test_times_without_a_state_are_refused_or_replaced(mixture: RunFolder, tmp_path: Path) -> None:
    with pytest.raises(FigureError, match="no time 21 s: it ends at 20 s"):
        drawn(mixture, 21.0)
    with pytest.raises(FigureError, match="12 times at most"):
        drawn(mixture, *range(13))
    stored = made(tmp_path / "run", MIXTURE, "record=snapshots", "snapshots=[5, 10]")
    done(stored)
    figure = drawn(stored, 4.0, 6.0, 10.0)
    assert figure.numbers["times"] == [5.0, 10.0]
    assert "states at some times: the picture is the nearest to 4 s and 6 s." in figure.caption


def test_a_gas_in_which_clusters_grow_has_its_density_at_four_times(tmp_path: Path) -> None:
    """The speeds of the last state alone do not show how they grew."""
    run = made(tmp_path / "run", STORED, "repeats=1", "cor=0.6")
    done(run)
    figure = drawn(run)
    trace = run.read(run.points[0], 0)
    stored = np.concatenate([[0.0], trace.snapshots.time, [trace.stop.time]])
    wanted = np.multiply((0.0, 0.01, 0.1, 1.0), trace.stop.time)
    nearest = [float(stored[np.argmin(np.abs(stored - time))]) for time in wanted]
    assert [picture.time for picture in figure.pictures.each] == nearest
    assert figure.pictures.high_is_dark
    assert "nearest" not in figure.caption  # no time was asked for
    assert drawn(run, colour="speed").pictures.label.startswith("speed")
    assert len(drawn(run, 5.0).pictures.each) == 1


def test_states_are_the_start_the_middle_and_the_end(mixture: RunFolder) -> None:
    trace = mixture.read(mixture.points[0], 0)
    figure = drawn(mixture)
    start, middle, end = figure.pictures.each
    assert np.array_equal(start.places, trace.start.positions)
    assert (start.time, end.time) == (0.0, 20.0)
    before = np.count_nonzero(trace.events.time <= middle.time)
    assert before == pytest.approx(trace.collisions / 2, abs=1)


def test_a_scale_bar_has_the_length_it_says(mixture: RunFolder) -> None:
    """1, 2 or 5 of a power of ten, up to a quarter of the container: 2 of 12 m."""
    axes = draw(drawn(mixture)).axes[0]
    (bar,) = axes.lines
    (text,) = axes.texts
    assert np.ptp(bar.get_xdata()) == 2.0
    assert text.get_text() == "2 m"


def test_it_is_saved_without_its_balls(mixture: RunFolder, tmp_path: Path) -> None:
    figure = drawn(mixture, *np.linspace(0.0, 20.0, 5))
    paths = save(figure, tmp_path / "states", ("png",))
    assert paths[1].stat().st_size < 2000
    assert '"times": [\n' in to_json(figure)
    assert "The colour of a ball shows: speed" in figure.alt
    with Image.open(paths[0]) as image:
        assert image.width == 7 * 200
        assert len(image.convert("RGB").getcolors(10**6)) > 100


# --- pixels -----------------------------------------------------------------------------------


def picture(places: list[tuple[float, float]], radii: list[float], side: float = 10.0) -> Picture:
    box = PeriodicBox(side, side)
    columns = np.array(places), np.array(radii), np.zeros(len(radii))
    return Picture(0.0, *columns, box.outline, box.size, box.periodic)


def test_pixels_cover_the_area_of_the_balls() -> None:
    """Of large ones, of one that is cut by two edges, and of ones smaller than a pixel."""
    white = np.ones((1, 3))
    for radius, place in ((3.0, (0.3, 0.2)), (2.0, (4.9, -4.8)), (1.0, (-5.0, 0.0))):
        image = raster(picture([place], [radius]), white, 400)
        covered = image[..., 3].sum() / 255 * (10 / 400) ** 2
        assert math.isclose(covered, math.pi * radius**2, rel_tol=0.02)
    dice = np.random.default_rng(1)
    places = dice.uniform(-50, 50, (4000, 2))
    image = raster(picture(places.tolist(), [0.2] * 4000, 100.0), np.ones((4000, 3)), 200)
    covered = image[..., 3].mean() / 255
    overlapping = 1 - math.exp(-4000 * math.pi * 0.2**2 / 100**2)
    assert math.isclose(covered, overlapping, rel_tol=0.15)  # parts are a third of a pixel


def test_pixels_have_the_colour_and_the_place_of_their_ball() -> None:
    """x to the right and y upwards: rows begin at the bottom."""
    colours = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    image = raster(picture([(-2.5, -2.5), (2.5, 2.5)], [1.0, 1.0]), colours, 40)
    assert image[10, 10].tolist() == [255, 0, 0, 255]
    assert image[30, 30].tolist() == [0, 0, 255, 255]
    assert image[10, 30].tolist() == [0, 0, 0, 0]


def test_a_million_balls_are_a_small_picture(tmp_path: Path) -> None:
    """The pixels, not the balls, decide the size."""
    dice = np.random.default_rng(1)
    number = 1_000_000
    balls = picture([], [], 1000.0)
    columns = dice.uniform(-500, 500, (number, 2)), np.full(number, 0.3), dice.uniform(size=number)
    many = Picture(0.0, *columns, balls.outline, balls.size, balls.periodic)
    pictures = Pictures((many,), "value", (0.0, 1.0))
    data = FigureData("snapshot", "Balls", "x", "y", (), "", pictures=pictures)
    svg, png, _ = save(data, tmp_path / "many", ("svg", "png"))
    assert max(svg.stat().st_size, png.stat().st_size) < 5_000_000


# --- what is drawn ----------------------------------------------------------------------------


@pytest.mark.parametrize("colour", ["speed", "species"])
@pytest.mark.parametrize(
    "times", [(), (0.0, 10.0, 20.0), (0.0, 1.0, 10.0, 20.0), (0.0, 1.0, 5.0, 10.0, 20.0)]
)
def test_it_is_drawn_legibly(mixture: RunFolder, colour: str, times: tuple[float, ...]) -> None:
    with styled():
        figure = draw(drawn(mixture, *times, colour=colour))
        figure.draw_without_rendering()
        shown = [axes for axes in figure.axes if axes.get_visible()]
        hidden = {id(text) for axes in shown if not axes.axison for text in axes.findobj(Text)}
        hidden -= {id(axes.title) for axes in shown}
        texts = [
            text for text in figure.findobj(Text) if text.get_text() and id(text) not in hidden
        ]
        boxes = [text.get_window_extent() for text in texts]
        for box in boxes:
            assert figure.bbox.contains(box.x0, box.y0)
            assert figure.bbox.contains(box.x1, box.y1)
    places = [axes.get_window_extent() for axes in shown]
    assert not any(one.overlaps(two) for one, two in itertools.combinations(places, 2))
    titles = [axes.get_title() for axes in shown]
    wanted = [f"t = {time:g} s" for time in times or (0.0, 8.146, 20.0)]
    assert titles == wanted + [""] * (colour == "speed")  # and the scale of colours


@pytest.mark.parametrize("number", [1, 3001])
def test_empty_space_has_the_colour_below_the_scale_of_density(number: int) -> None:
    """Of balls that are circles, and of ones that are pixels; the least dense one has another."""
    box = Box(10, 10)
    columns = np.full((number, 2), -3.0), np.full(number, 0.5), np.full(number, 0.2)
    one = Picture(0.0, *columns, box.outline, box.size, box.periodic)
    pictures = Pictures((one,), "packing", (0.2, 0.5), high_is_dark=True)
    figure = draw(FigureData("snapshot", "Balls", "x", "y", (), "", pictures=pictures))
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())  # type: ignore[attr-defined]
    axes, bar = figure.axes
    scale = bar._colorbar  # type: ignore[attr-defined]
    assert (scale.extend, scale.vmin) == ("both", 0.2)
    for place, value in (((2.5, 2.5), 0.0), ((-3.0, -3.0), 0.2)):
        column, row = axes.transData.transform(place)
        found = pixels[len(pixels) - 1 - int(row), int(column)]
        assert np.abs(found - 255 * np.array(scale.cmap(scale.norm(value)))).max() <= 1


SIDES = """\
container: {shape: box, width: 12, height: 10}
balls: {count: 20, radius: 0.25, speed: 1}
cor: 0.9
wall_temperature: {left: 2, right: 0.5}
wall_speed: {top: 0.3}
time: 5
"""


def test_walls_that_are_not_alike_have_a_key(tmp_path: Path) -> None:
    """Their temperatures from cold to hot, dark to light; then what drives, and the rest."""
    run = made(tmp_path / "run", SIDES)
    done(run)
    data = drawn(run)
    walls = data.pictures.walls
    named = {wall.name: wall for wall in walls}
    assert [*named] == ["wall at 0.5 J", "wall at 2 J", "wall driven at 0.3 m/s", "wall, CoR 0.9"]
    assert [wall.heat for wall in walls] == [0.0, 1.0, None, None]
    middles = [wall.lines.mean(axis=(0, 1)).tolist() for wall in walls]
    assert middles == [[6.0, 0.0], [-6.0, 0.0], [0.0, 5.0], [0.0, -5.0]]
    figure = draw(data)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [*named]
    cold, hot = (line.get_color() for line in legend.get_lines()[:2])
    assert np.dot(hot[:3], GREY) > np.dot(cold[:3], GREY) + 0.4
    drawn_walls = [one for one in figure.axes[0].collections if isinstance(one, LineCollection)][2:]
    assert [len(one.get_segments()) for one in drawn_walls] == [1] * 4
    assert np.allclose(drawn_walls[1].get_color()[0], hot)
    assert not drawn(run, 1.0, colour="speed").pictures.label.startswith("speed over")


GREY = np.array([0.299, 0.587, 0.114])
"""The lightness of red, green and blue."""


def test_walls_that_are_alike_and_give_no_energy_have_no_key(mixture: RunFolder) -> None:
    assert drawn(mixture).pictures.walls == ()


@pytest.mark.parametrize(
    ("container", "dashed"), [(PeriodicBox(10, 10), 4), (Channel(10, 10), 2), (Box(10, 10), 0)]
)
def test_edges_that_repeat_are_dashed(container: Container, dashed: int) -> None:
    columns = np.zeros((1, 2)), np.ones(1), np.zeros(1)
    one = Picture(0.0, *columns, container.outline, container.size, container.periodic)
    pictures = Pictures((one,), "value", (0.0, 1.0))
    axes, _ = draw(FigureData("snapshot", "Balls", "x", "y", (), "", pictures=pictures)).axes
    solid, repeating = (each for each in axes.collections if isinstance(each, LineCollection))
    assert [len(each.get_segments()) for each in (solid, repeating)] == [4 - dashed, dashed]
    for (x, y), (u, v) in repeating.get_segments():
        assert container.periodic[0 if x == u else 1]
        assert x == u or y == v
