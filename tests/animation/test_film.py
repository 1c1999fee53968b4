"""A film, its page, its frames and its movies show what the trace contains."""

from __future__ import annotations

import html
import math
import re
import shutil
from dataclasses import replace
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_pictures import (
    SHAPES,
    slack,
    sliding,
    sliding_films,
)
from PIL import Image
from scenes import gas

from snooker_cli.animation import Film, film, page, with_events
from snooker_cli.animation.film import Pace
from snooker_cli.animation.movie import BIN, FLASH, MOST_FLASHES, Screen, frames, save_movie
from snooker_cli.containers import Circle
from snooker_cli.engine import replay, series, simulate
from snooker_cli.errors import FigureError, UserError
from snooker_cli.figures.style import styled
from snooker_cli.laws import Surface
from snooker_cli.pages.html_page import embedded
from snooker_cli.trace import CONTAINER, StopReason, Trace


def pressures(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Times after zero and the mean pressure since the start, s and Pa m, at rows of the series."""
    columns, container = series(trace), trace.start.container
    later = columns.time > 0
    time = columns.time[later]
    if container.has_wall:
        return time, columns.wall_impulse[later] / (container.wall_length * time)
    moved = np.append(0.0, np.cumsum(columns.kinetic_energy[:-1] * np.diff(columns.time)))
    return time, (moved + columns.pair_virial / 2)[later] / (container.area * time)


@pytest.mark.parametrize("name", SHAPES)
def test_what_is_shown_is_in_the_trace(name: str, films: dict[str, Film]) -> None:
    made = films[name]
    found = series(made.trace)
    np.testing.assert_allclose(made.kinetic_energy, found.kinetic_energy, rtol=1e-13)
    time, pressure = pressures(made.trace)
    np.testing.assert_allclose(made.pressure(time), pressure, rtol=1e-12, atol=1e-12)
    scene = made.trace.start
    first = scene.kinetic_energy / scene.container.area if not scene.container.has_wall else 0.0
    assert made.pressure(np.zeros(1)) == pytest.approx(first, rel=1e-12)
    # Contacts are on both bodies and inside the container, also in a periodic box.
    reach = np.array(scene.container.size) / 2 + slack(made.trace)
    states = replay(made.trace, made.time)
    row = np.arange(len(made))
    to_ball = scene.container.nearest_image(made.contacts - states.positions[row, made.i])
    np.testing.assert_allclose(np.hypot(*to_ball.T), scene.radii[made.i], rtol=1e-12)
    pairs = made.j != CONTAINER
    to_other = made.contacts[pairs] - states.positions[row[pairs], made.j[pairs]]
    to_other = scene.container.nearest_image(to_other)
    assert np.max(np.abs(np.hypot(*to_other.T) - scene.radii[made.j[pairs]])) < slack(made.trace)
    assert np.all(abs(made.contacts - states.container_position) <= reach)
    out = made.contacts[~pairs] - states.container_position[~pairs]
    if isinstance(scene.container, Circle):
        gaps = np.hypot(*out.T) - scene.container.radius
    else:
        gaps = np.max(abs(out) - np.array(scene.container.size) / 2, axis=1)
    assert len(gaps) > 5 if scene.container.has_wall else len(gaps) == 0
    assert np.max(np.abs(gaps), initial=0.0) < slack(made.trace)


def test_a_film_shows_the_wanted_span(shown: dict[str, Trace]) -> None:
    for name in ("free", "periodic"):
        trace = shown[name]
        assert trace.events is not None
        whole, hits = film(trace, name), trace.events.time
        since, until = (hits[49] + hits[50]) / 2, (hits[149] + hits[150]) / 2
        part = film(trace, name, since=since, until=until)
        assert (part.before, len(part), part.left_out) == (50, 100, 0)
        np.testing.assert_array_equal(part.contacts, whole.contacts[50:150])
        np.testing.assert_allclose(part.kinetic_energy, whole.kinetic_energy[50:151], rtol=1e-13)
        np.testing.assert_allclose(
            part.pressure(part.rows[1:]), whole.pressure(whole.rows[51:151]), rtol=1e-12
        )
        short = film(trace, name, since=since, most=10)
        assert (short.end, len(short), short.left_out) == (hits[59], 10, 140)


@pytest.mark.parametrize("pace", ["time", "events"])
def test_marks_show_how_far_rough_balls_have_turned(pace: Pace) -> None:
    """By spin times time from one event to the next, also of a film that begins later."""
    scene = gas("periodic", 40, 0.3, cor=0.9)
    surface, spins = Surface(0.5, 0.5, 0.4, -1.0, 0.0), np.linspace(-3.0, 3.0, 40)
    trace = simulate(replace(scene, surface=surface, spins=spins), collisions=300)
    assert trace.events is not None
    made = film(trace, "rough", since=float(trace.events.time[99]))
    with styled():
        screen = Screen(made, pace)
        for frame in frames(made, pace, 7, 1.0):
            times = trace.events.time[trace.events.time < frame.time]
            states = replay(trace, times).spins
            turned = np.diff([0.0, *times, frame.time]) @ np.vstack([spins, states])
            np.testing.assert_allclose(frame.angles, turned, rtol=1e-11, atol=1e-11)
            screen.image(frame)
            lines = np.array(screen.marks.get_segments())
            assert len(lines) >= 40  # with images at the edges
            ways = np.diff(lines, axis=1)[:, 0]
            np.testing.assert_allclose(np.hypot(*ways.T), scene.radii[0], rtol=1e-12)
            ends = np.exp(1j * turned)
            for way in ways:
                assert np.min(abs(ends - complex(*way) / scene.radii[0])) < 1e-9


def test_the_energy_of_a_film_has_that_of_spins_and_follows_the_fitted_law() -> None:
    """α is of the whole energy; the temperature is of the motion alone."""
    scene = gas("periodic", 40, 0.3, cor=0.9)
    trace = simulate(replace(scene, surface=Surface(0.5, 0.5, math.inf, -1.0, 0.0)), collisions=300)
    made = film(trace, "rough")
    assert made.haff_rate is not None
    with styled():
        screen = Screen(made, "time")
    energy = screen.curves[0][-1]
    assert energy[0] == pytest.approx(scene.kinetic_energy, rel=1e-12)
    finish = trace.finish.kinetic_energy, trace.finish.spin_energy
    assert finish[1] > 0.1 * finish[0]
    assert energy[-1] == pytest.approx(sum(finish), rel=1e-12)
    assert made.kinetic_energy[-1] == pytest.approx(finish[0], rel=1e-12)


def test_smooth_balls_have_no_marks(films: dict[str, Film]) -> None:
    made = films["box"]
    with styled():
        screen = Screen(made, "time")
        (first, *_) = frames(made, "time", 2, 1.0)
        screen.image(first)
    assert first.angles is None
    assert len(screen.marks.get_segments()) == 0


def test_a_sliding_ball_presses() -> None:
    """The pressure is that of the observables at each row, and grows evenly between rows."""
    made = sliding_films()["whole"]
    time, pressure = pressures(made.trace)
    last = np.append(np.diff(time) > 0, True)  # of an instant
    np.testing.assert_allclose(made.pressure(time[last]), pressure[last], rtol=1e-12)
    ends = made.time[-1] + (made.end - made.time[-1]) * np.array([0.0, 0.5, 1.0])
    assert made.pressure_gain[-1] > 0
    np.testing.assert_allclose(np.diff(made.pressure(ends) * ends, 2), 0, atol=1e-12)


def test_what_cannot_be_shown_is_refused(
    traces: dict[str, Trace], shown: dict[str, Trace], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FigureError, match="summary"):
        film(traces["summary"], "")
    for since, until in ((-1.0, None), (0.0, 1e9), (0.5, 0.5), (math.nan, None)):
        with pytest.raises(FigureError, match="span"):
            film(shown["fixed"], "", since=since, until=until)
    monkeypatch.setattr(import_module("snooker_cli.animation.film"), "MOST_BALLS", 36)
    with pytest.raises(FigureError, match="37 balls"):
        film(shown["fixed"], "")
    monkeypatch.setattr(import_module("snooker_cli.animation.film"), "MOST_AGAIN", 100)
    assert with_events(traces["summary"], 0.0, 99).events is not None
    with pytest.raises(FigureError, match="simulated again"):
        with_events(traces["summary"], 0.0, 100)


def test_a_film_of_a_summary_is_that_of_its_events() -> None:
    """They are simulated again, as many as the film needs."""
    recorded = sliding()
    assert recorded.events is not None
    summary = simulate(recorded.start, collisions=recorded.collisions, summary=True)
    time = recorded.events.time
    for since, until, most in (
        (0.0, None, 10_000),
        (0.0, float(time[120]), 50),
        (time[70], None, 9),
    ):
        again = with_events(summary, since, most)
        assert again.events is not None
        assert len(again.events) >= min(most, 50)
        made, known = (film(trace, "", "", since, until, most) for trace in (again, recorded))
        assert (made.end, made.left_out > 0) == (known.end, known.left_out > 0)
        for field in ("time", "i", "j", "contacts", "kinetic_energy", "pressure_sum"):
            np.testing.assert_array_equal(getattr(made, field), getattr(known, field))


def test_a_film_without_collisions_and_one_that_ended_early(shown: dict[str, Trace]) -> None:
    """Texts may come from a folder's name."""
    trace = shown["fixed"]
    assert trace.events is not None
    still = film(trace, "", until=float(trace.events.time[0]) / 2)
    assert (len(still), still.before) == (0, 0)
    assert [frame.time for frame in frames(still, "events", 2, 1.0)] == [0.0, still.end]
    stop = trace.stop._replace(reason=StopReason.WALL_TRAP, message="a\u202eb")
    trapped = film(replace(trace, stop=stop), "a\u202eb", "a\u202eb")
    assert [trapped.title, trapped.subtitle, trapped.ending] == [r"a\u202eb"] * 3
    assert film(replace(trace, stop=stop), "", most=10).ending == film(trace, "").ending == ""


def test_a_page_loads_nothing_is_small_and_always_the_same() -> None:
    trace = simulate(gas("circle", 37, 0.3), collisions=10_000)
    text = page(film(trace, "of the report’s size"))
    assert len(text.encode()) < 150_000  # whatever the number of collisions
    assert page(film(trace, "of the report’s size")) == text
    assert not re.search(r"<(link|iframe|img)|<\w+[^>]*\s(src|href|data)=", text)
    assert "default-src 'none'" in text
    assert not re.search(r"https?:|@import|url\(|fetch\(|XMLHttp|import\(", text)

    fragment = embedded(text, 'CoR 0.9 & "more"')
    assert fragment.count("<") == 2  # an iframe and its end
    attributes = dict(re.findall(r'(\w+)="([^"]*)"', fragment))
    assert html.unescape(attributes["srcdoc"]) == text
    assert html.unescape(attributes["title"]) == 'CoR 0.9 & "more"'
    assert attributes["sandbox"] == "allow-scripts"


@pytest.mark.parametrize("pace", ["time", "events"])
def test_frames_are_replayed_and_flash_at_contacts(pace: Any, films: dict[str, Film]) -> None:
    made, seconds = films["free"], 4.0
    found = list(frames(made, pace, 41, seconds))
    times = np.array([frame.time for frame in found])
    hit = made.time / made.end
    if pace == "time":
        np.testing.assert_allclose(times, np.linspace(0, made.end, 41))
    else:  # each collision takes as long, and so does the time after the last
        hit = np.arange(1, len(made) + 1) / (len(made) + 1)
        counts = np.minimum(np.arange(41) * 201 // 40, 200)
        assert [frame.collisions for frame in found] == counts.tolist()
    assert (times[0], times[-1]) == (made.start, made.end)
    states = replay(made.trace, times)
    for k, frame in enumerate(found):
        np.testing.assert_array_equal(frame.positions, states.positions[k])
        np.testing.assert_array_equal(frame.speeds, np.hypot(*states.velocities[k].T))
        assert frame.collisions == np.count_nonzero(made.time <= frame.time)
        since = seconds * (k / 40 - hit[: frame.collisions])
        np.testing.assert_array_equal(frame.flashes, np.flatnonzero(since < FLASH))
        np.testing.assert_allclose(frame.ages, since[since < FLASH] / FLASH, atol=1e-9)
    *_, last = frames(made, pace, 3, FLASH)
    np.testing.assert_array_equal(last.flashes, np.arange(len(made))[-MOST_FLASHES:])


def test_a_movie_has_the_balls_by_speed(films: dict[str, Film]) -> None:
    """Of unequal masses: speeds over the root of 2T/m."""
    made = films["box"]
    frame = list(frames(made, "time", 3, 1.0))[1]
    with styled():
        screen = Screen(made, "time")
        screen.image(frame)
    scene, energies = made.trace.start, made.trace.start.masses * frame.speeds**2 / 2
    reduced = np.sqrt(energies / energies.mean())
    edges = np.append(BIN * np.arange(15), np.inf)
    shares = np.histogram(reduced, edges)[0] / scene.number
    np.testing.assert_allclose(screen.bars.get_data().values, shares, atol=1e-12)


def test_a_gif_has_its_frames_and_nothing_else(films: dict[str, Film], tmp_path: Path) -> None:
    path, again = tmp_path / "film.gif", tmp_path / "again.gif"
    for file in (path, again):
        save_movie(films["periodic"], file, pace="events", seconds=0.2, rate=20)
    assert again.read_bytes() == path.read_bytes()
    with Image.open(path) as image:
        assert (image.n_frames, image.size, image.info["duration"]) == (4, (840, 480), 50)
        pixels = []
        for k in range(4):
            image.seek(k)
            pixels.append(np.array(image.convert("RGB")))
    assert all((each[:3] == 255).all() for each in pixels)  # the margin is white, not nearly so
    assert all((a != b).any() for a, b in pairwise(pixels))
    with pytest.raises(UserError) as refused:
        save_movie(films["free"], path, pace="time", seconds=100, rate=20)
    assert refused.value.code == "too-many-frames"


def test_an_mp4_without_a_working_ffmpeg_is_refused(
    films: dict[str, Film], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    path, codes = tmp_path / "film.mp4", []
    for _ in range(2):
        with pytest.raises(UserError) as refused:
            save_movie(films["free"], path, pace="time", seconds=0.1, rate=20)
        codes.append(refused.value.code)
        assert not path.exists()
        failing = tmp_path / "ffmpeg"
        failing.write_text("#!/bin/sh\nexit 3\n")
        failing.chmod(0o755)
    assert codes == ["ffmpeg-missing", "ffmpeg-failed"]


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="there is no ffmpeg here")
def test_an_mp4_is_written_by_ffmpeg(films: dict[str, Film], tmp_path: Path) -> None:
    path = tmp_path / "film.mp4"
    save_movie(films["free"], path, pace="time", seconds=0.4, rate=20)
    assert path.read_bytes()[4:8] == b"ftyp"
