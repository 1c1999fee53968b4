"""Templates, scripts and data -> one HTML page that works from a file."""

import html
import json
import re
from collections.abc import Mapping
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

PAGES = "snooker_cli.pages"
MARK, HEAD = b'<meta name="generator" content="snooker">', 1000
"""What page.html has, within this number of bytes."""

SHARED = ("page.js", "drawing.js", "arena.js", "panels.js")
"""The scripts that all pages have, in an order in which they can run."""

SPEED_COLOURS = (
    *("#0d0887", "#41049d", "#6a00a8", "#8f0da4", "#b12a90"),
    *("#cc4778", "#e16462", "#f2844b", "#fca636", "#fcce25"),
)
"""From slow to fast, for the pages and the movies: matplotlib's plasma up to 0.9.

The steps of lightness are even, also for colour-blind people. The yellow end is too light on white.
"""

TEXT = re.compile(
    r"""((?<!<code)>\s*|\s(?:aria-label|title)=")([^<>"{}]*[^\W\d]{2}[^<>"{}]*?)(?=\s*[<"])"""
)
"""A text that a template shows, in group 2: of an element, or an attribute. It has a word."""

PHRASE = re.compile(r"phrase`([^`]*)`")
"""A text that a script shows, in group 1."""

VALUE = re.compile(r"\$\{[^{}]*\}")
"""A value in such a text; it is ``{}`` in a table of words."""

Words = Mapping[str, str]
"""English texts -> those of another language, which has the values in the same order."""


def text_of(package: str, *names: str) -> str:
    """The texts of files of a package, one after the other."""
    return "\n".join((files(package) / name).read_text(encoding="utf-8") for name in names)


def script_of(package: str, *names: str) -> str:
    """The scripts in files of a package without comments and indentation: a fifth of a page.

    A comment at the end of a line has spaces around its slashes; texts of one line have none.
    """
    code = re.sub(r"(?m)^ *(//.*|/\*\*[\s\S]*?\*/)\n", "", text_of(package, *names))
    return re.sub(r"(?m)^ +|(?<=\S) +// .*$", "", code)


def translated_script(script: str, words: Words) -> str:
    """A script with its phrases in other words; they are template literals without a tag then."""

    def literal(phrase: re.Match[str]) -> str:
        text, values = VALUE.sub("{}", phrase[1]), iter(VALUE.findall(phrase[1]))
        filled = re.sub(r"\{\}", lambda _: next(values), words.get(text, text))
        return f"`{filled}`"

    return PHRASE.sub(literal, script)


def translated_template(template: str, words: Words) -> str:
    """A template with its texts in other words."""
    return TEXT.sub(lambda text: text[1] + words.get(text[2], text[2]), template)


def html_page(
    package: str,
    name: str,
    title: str,
    parts: dict[str, str],
    *,
    simulates: bool = False,
    language: str = "en",
    words: Words = MappingProxyType({}),
) -> str:
    """A page with the body NAME.html and the style NAME.css of a package.

    parts : for each ``{{part}}`` of the body that is not in shared.html
    simulates : whether its script may run WebAssembly, and start workers that it makes itself
    language : of its texts, as HTML names it
    words : for the texts of the body; parts stay as they are
    """
    body = text_of(package, f"{name}.html")
    around = {
        "language": language,
        "more": " 'wasm-unsafe-eval'; worker-src blob:" if simulates else "",
        "title": html.escape(title),
        "style": text_of(PAGES, "page.css") + text_of(package, f"{name}.css"),
        "body": _filled(translated_template(body, words), _shared_parts(words) | parts),
    }
    return _filled(text_of(PAGES, "page.html"), around)


def is_page(path: Path) -> bool:
    """Whether a file is such a page."""
    with suppress(OSError):
        if path.is_file():
            with path.open("rb") as file:
                return MARK in file.read(HEAD)
    return False


def _shared_parts(words: Words) -> dict[str, str]:
    """The elements that several pages have, by the names above them in shared.html."""
    shared = translated_template(text_of(PAGES, "shared.html"), words)
    _, *pieces = re.split(r"<!-- (\w+) -->\n(.*)\n", shared)
    return dict(zip(pieces[::3], pieces[1::3], strict=True))


def _filled(template: str, parts: Mapping[str, str]) -> str:
    """The template with a part for each ``{{name}}``."""
    return re.sub(r"\{\{(\w+)\}\}", lambda mark: parts[mark[1]], template)


def script_data(data: Any) -> str:
    """Data as JSON for a script element, which they cannot end."""
    content = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return content.replace("<", "\\u003c")


def embedded(page: str, label: str, rights: str = "allow-scripts") -> str:
    """An ``iframe`` with a page; ``label`` describes it.

    rights : what the page may do: run its script, and no more
    """
    return (
        f'<iframe class="player" title="{html.escape(label)}" loading="lazy" '
        f'sandbox="{rights}" allow="fullscreen" srcdoc="{html.escape(page)}"></iframe>'
    )


def in_notebook(page: str, label: str, height: float, rights: str = "allow-scripts") -> str:
    """``embedded`` with the width of a notebook's cell and a height, em."""
    style = f"<style>iframe.player {{width: 100%; height: {height:g}em; border: 0}}</style>"
    return style + embedded(page, label, rights)
