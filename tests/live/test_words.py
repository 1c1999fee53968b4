"""The words of the live page: each text has its translation, and a page has one language."""

from __future__ import annotations

import re

import pytest

import snooker_cli as snooker
from snooker_cli.live_page.page import (
    ENGINE_SCRIPTS,
    FIRST_POINT,
    FROM_CONFIG,
    LANGUAGES,
    LIVE,
    MEASURING,
    OWN,
    SHOWING,
    STARTING,
    presets,
    words_of,
)
from snooker_cli.live_page.page_theories import theories_source
from snooker_cli.pages.html_page import PAGES, PHRASE, SHARED, TEXT, VALUE, text_of

TEMPLATES = text_of(LIVE, "live.html") + text_of(PAGES, "shared.html")
SCRIPTS = "".join(
    [
        theories_source(),
        text_of(LIVE, *ENGINE_SCRIPTS, *STARTING, *MEASURING, *SHOWING),
        text_of(PAGES, *SHARED),
    ]
)
OTHERS = [language for language in LANGUAGES if language != "en"]


def english_texts() -> set[str]:
    """All texts that the English page can show."""
    templates = {text[2] for text in TEXT.finditer(TEMPLATES)}
    scripts = {VALUE.sub("{}", phrase) for phrase in PHRASE.findall(SCRIPTS)}
    scenes = {scene[key] for scene in presets() for key in ("title", "about")}
    return templates | scripts | scenes | {OWN, FROM_CONFIG, FIRST_POINT}


def longest_piece(text: str) -> str:
    """The longest part of a text between its values."""
    return max(text.split("{}"), key=len)


@pytest.mark.parametrize("language", OTHERS)
def test_a_language_has_each_text_and_no_other(language: str) -> None:
    texts, words = english_texts(), words_of(language)
    assert texts - set(words) == set(), "texts without a translation"
    assert set(words) - texts == set(), "translations that nothing uses"


def test_values_in_phrases_are_simple() -> None:
    """Else a text of a table would not be that of the script."""
    assert [text for text in english_texts() if re.search(r"[`$\\]|\{(?!\})", text)] == []


@pytest.mark.parametrize("language", OTHERS)
def test_a_translation_fits_where_the_text_was(language: str) -> None:
    """It has the same values, and nothing that ends a text of HTML or of a script.

    The page leaves out what follows the last semicolon of an ending.
    """
    for text, other in words_of(language).items():
        assert other.count("{}") == text.count("{}"), text
        assert other.count(";") == text.count(";"), text
        assert not re.search(r"[`$\\<>&\"]", other), text


@pytest.mark.parametrize("language", OTHERS)
def test_a_page_has_one_language(language: str) -> None:
    english, page = snooker.live().html, snooker.live(language=language).html
    assert english == snooker.live(language="en").html
    assert '<html lang="en">' in english
    assert f'<html lang="{language}">' in page
    sentences = {text: other for text, other in words_of(language).items() if text.endswith(".")}
    assert [text for text in sentences if longest_piece(text) in page] == []
    assert [other for other in sentences.values() if longest_piece(other) in english] == []


def test_an_unknown_language_is_refused() -> None:
    known = ", ".join(LANGUAGES)
    with pytest.raises(snooker.UserError, match=f"^language: .*'xx'; give one of {known}$"):
        snooker.live(language="xx")
