"""Configurations that must be refused: what is said, where, and that nothing else is raised."""

import os
import pickle
import re
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from snooker_cli.config import ConfigError, load, parse

TABLE: dict[str, Any] = yaml.safe_load(
    (Path(__file__).parents[1] / "data" / "bad_configs.yaml").read_text(encoding="utf-8")
)
BASE: str = TABLE["base"]


def text_of(case: dict[str, Any]) -> str:
    if "text" in case:
        return str(case["text"])
    lines = dict(enumerate(BASE.splitlines(), start=1)) | case.get("line", {})
    text = "".join(f"{lines[number]}\n" for number in sorted(lines))
    return text.replace("{zeros}", "0" * 300).replace("{nines}", "9" * 5000)


def refusal(text: str, overrides: list[str] | None = None) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        parse(text, "bad.yaml", overrides or [])
    return caught.value


@pytest.mark.parametrize("name", TABLE["cases"])
def test_every_problem_is_named_with_its_position(name: str) -> None:
    case = TABLE["cases"][name]
    lines = str(refusal(text_of(case), case.get("overrides"))).splitlines()
    assert len(lines) == len(case["says"]), "\n".join(lines)
    for line, expected in zip(lines, case["says"], strict=True):
        pattern = ".*".join(re.escape(part) for part in expected.split("..."))
        assert re.match(pattern, line), f"{line}\ndoes not start with\n{expected}"


@pytest.mark.parametrize("name", TABLE["cases"])
def test_sentences_are_plain(name: str) -> None:
    case = TABLE["cases"][name]
    for problem in refusal(text_of(case), case.get("overrides")).problems:
        jargon = r"\b(Input|pydantic|validation|union|discriminator|tuple|dict|str|NoneType)\b"
        assert not re.search(jargon, problem.sentence)
        assert problem.sentence.isprintable()
        assert not problem.sentence.endswith(".")


def test_the_table_is_as_large_as_it_should_be() -> None:
    assert len(TABLE["cases"]) >= 65


def test_error_survives_pickling() -> None:
    error = refusal("cor: 2\n")
    copy = pickle.loads(pickle.dumps(error))
    assert copy.problems == error.problems
    assert str(copy) == str(error)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"absent\.yaml: there is no such file"):
        load(tmp_path / "absent.yaml")


def test_directory(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="this is a directory; name a YAML file in it"):
        load(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="has other pipes")
def test_pipes_and_devices(tmp_path: Path) -> None:
    """A pipe into which nobody writes would never end, and a device may have no end."""
    os.mkfifo(tmp_path / "pipe.yaml")
    for path in (tmp_path / "pipe.yaml", "/dev/zero", "/dev/null"):
        with pytest.raises(ConfigError, match="this is a pipe or a device; name a YAML file"):
            load(path)


def test_file_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("cor: 1\n")
    with pytest.raises(ConfigError, match="the file cannot be read"):
        load(tmp_path / "plain" / "inner.yaml")


def test_null_byte_in_the_name() -> None:
    with pytest.raises(ConfigError, match="the file cannot be read"):
        load("a\0b")


def test_file_that_is_not_utf8(tmp_path: Path) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes(b"title: caf\xe9\n")
    with pytest.raises(ConfigError, match="byte 11 is not UTF-8 text"):
        load(path)


def test_file_in_utf16(tmp_path: Path) -> None:
    path = tmp_path / "wide.yaml"
    path.write_text(BASE, encoding="utf-16")
    with pytest.raises(ConfigError, match="byte 1 is not UTF-8 text"):
        load(path)


def test_large_file(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_bytes(BASE.encode() + b"#" * (1 << 20))
    with pytest.raises(ConfigError, match="the file is over 1 MiB"):
        load(path)


def test_large_text() -> None:
    assert "the text is over 1 MiB" in str(refusal("#" * (1 << 20) + "#"))


@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "[{a: "])
def test_deep_nesting_is_refused_without_recursion(opening: str) -> None:
    assert "more than 20 levels of nesting" in str(refusal("a: 1\nb:\n  " + opening * 20_000))


def test_aliases_are_not_expanded() -> None:
    """The billion laughs: each line would be ten times the one before."""
    lines = ["a0: &a0 [x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    problems = refusal("\n".join(lines)).problems
    assert sum("aliases" in problem.sentence for problem in problems) == 110
    assert sum("anchors" in problem.sentence for problem in problems) == 12


def test_very_many_problems_are_not_all_shown() -> None:
    error = refusal("".join(f"k{n}: 1\n" for n in range(100)))
    assert len(error.problems) == 104
    lines = str(error).splitlines()
    assert [str(problem) for problem in error.problems[:20]] == lines[:20]
    assert lines[20:] == ["... and 84 more; correct these first"]


def test_long_values_are_shortened() -> None:
    (problem,) = refusal(BASE + f"record: {'x' * 5000}\n").problems
    assert len(problem.sentence) < 200


def test_combination_of_values_that_leaves_no_end() -> None:
    sweep = "time: 1\nsweep: {collisions: [500, null], time: [1, null]}\n"
    loaded = parse(BASE + sweep, "run.yaml")
    with pytest.raises(ConfigError) as caught:
        loaded.points()
    assert re.fullmatch(
        r"run\.yaml:6:21: collisions: neither collisions nor time is given; .* "
        r"\(at the point collisions=null, time=null\)",
        str(caught.value),
    )


def test_error_about_a_key_after_loading() -> None:
    loaded = parse(BASE, "run.yaml")
    error = loaded.error("balls.radius", "balls 1 and 2 overlap; make them smaller")
    assert str(error) == "run.yaml:2:27: balls.radius: balls 1 and 2 overlap; make them smaller"
