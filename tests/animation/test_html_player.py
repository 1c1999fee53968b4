"""The page of a film contains the trace and needs nothing else."""

from __future__ import annotations

import html
import re

import numpy as np
import pytest
from moving_pictures import SHAPES, apart, content, slack, times_of
from scenes import gas

from snooker_cli.animation import Film, embedded, film, page
from snooker_cli.engine import replay, simulate
from snooker_cli.trace import Trace


@pytest.mark.parametrize("name", SHAPES)
def test_moving_straight_between_the_pages_collisions_gives_the_trace(
    name: str, films: dict[str, Film]
) -> None:
    """The player's method, in Python: a body changes only when it collides."""
    trace, data = films[name].trace, content(page(films[name]))
    container, times = trace.start.container, times_of(trace)
    assert (data["outline"], tuple(data["size"])) == (container.outline.tolist(), container.size)
    assert (data["start"], data["end"]) == (0.0, trace.stop.time)
    balls = data["balls"].reshape(5, -1)
    np.testing.assert_array_equal(balls[4], trace.start.radii)
    place = np.vstack([balls[:2].T, data["container"][:2]])
    motion = np.vstack([balls[2:4].T, data["container"][2:]])
    clock = np.zeros(len(place))
    after = data["after"].reshape(-1, 2, 2)
    done, found = 0, []
    for time in times:
        while done < len(data["time"]) and data["time"][done] <= time:
            bodies = [data["i"][done], data["j"][done]]  # the container, -1, is the last
            ages = data["time"][done] - clock[bodies]
            place[bodies] += motion[bodies] * ages[:, None]
            motion[bodies], clock[bodies] = after[done], data["time"][done]
            done += 1
        found.append(place + motion * (time - clock)[:, None])
    states = replay(trace, times)
    assert apart(trace, np.array(found)[:, :-1], states.positions) < slack(trace) < 1e-6
    assert apart(trace, np.array(found)[:, -1], states.container_positions) < slack(trace)


def test_a_page_loads_nothing_is_small_and_always_the_same() -> None:
    trace = simulate(gas("circle", 37, 0.3), collisions=500)
    text = page(film(trace, "of the report’s size"))
    assert len(text.encode()) < 300_000
    assert page(film(trace, "of the report’s size")) == text
    assert not re.search(r"<(link|iframe|img)|<\w+[^>]*\s(src|href|data)=", text)
    assert "default-src 'none'" in text
    assert not re.search(r"https?:|@import|url\(|fetch\(|XMLHttp|import\(", text)


def test_texts_cannot_break_a_page(shown: dict[str, Trace]) -> None:
    text_given = "</script><script>alert(1)</script> {{film}} & \"R\" 'é'"
    text = page(film(shown["fixed"], text_given, text_given))
    assert (content(text)["title"], content(text)["subtitle"]) == (text_given, text_given)
    assert f"<title>{html.escape(text_given)}</title>" in text
    assert text.count("</script>") == 2


def test_an_embedded_page_is_one_quoted_attribute(shown: dict[str, Trace]) -> None:
    text = page(film(shown["fixed"], 'a "title"'))
    fragment = embedded(text, 'CoR 0.9 & "more"')
    assert fragment.count("<") == 2  # an iframe and its end
    attributes = dict(re.findall(r'(\w+)="([^"]*)"', fragment))
    assert html.unescape(attributes["srcdoc"]) == text
    assert html.unescape(attributes["title"]) == 'CoR 0.9 & "more"'
    assert attributes["sandbox"] == "allow-scripts"
