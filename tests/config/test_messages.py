"""Configurations that must be refused: each problem with its position, key and sentence."""

import pickle
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from config_texts import BASE, PAIR

from snooker_cli.config import ConfigError, parse

TABLE: dict[str, Any] = yaml.safe_load(
    (Path(__file__).parents[1] / "data" / "bad_configs.yaml").read_text(encoding="utf-8")
)


def text_of(case: dict[str, Any]) -> str:
    if "text" in case:
        return str(case["text"])
    lines = dict(enumerate(TABLE["base"].splitlines(), start=1)) | case.get("line", {})
    text = "".join(f"{lines[number]}\n" for number in sorted(lines))
    return text.replace("{zeros}", "0" * 300).replace("{nines}", "9" * 5000)


def refusal(text: str, overrides: list[str] | None = None) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        parse(text, "bad.yaml", overrides or [])
    return caught.value


@pytest.mark.parametrize("name", TABLE["cases"])
def test_every_problem_is_named_with_its_position(name: str) -> None:
    case = TABLE["cases"][name]
    error = refusal(text_of(case), case.get("overrides"))
    lines = str(error).splitlines()
    assert len(lines) == len(case["says"]), "\n".join(lines)
    assert pickle.loads(pickle.dumps(error)).problems == error.problems
    for line, expected in zip(lines, case["says"], strict=True):
        pattern = ".*".join(re.escape(part) for part in expected.split("..."))
        wrong = f"{line}\ndoes not start with\n{expected}\nof tests/data/bad_configs.yaml"
        assert re.match(pattern, line), wrong
    for problem in error.problems:
        jargon = r"\b(Input|pydantic|validation|union|discriminator|tuple|dict|str|NoneType)\b"
        assert not re.search(jargon, problem.sentence)
        assert problem.sentence.isprintable()
        assert not problem.sentence.endswith(".")


def test_only_the_first_problems_are_shown() -> None:
    for number, rest in ((40, "... and 23 more;"), (100, "... and more;")):
        error = refusal("".join(f"k{n}: 1\n" for n in range(number)))
        lines = str(error).splitlines()
        assert [str(problem) for problem in error.problems[:20]] == lines[:20]
        assert len(lines) == 21
        assert lines[20].startswith(rest)


def test_values_that_do_not_fit_each_other_are_reported_with_their_point() -> None:
    error = refusal(BASE + "time: 1\nsweep: {collisions: [500, null], time: [1, null]}\n")
    assert re.fullmatch(
        r"bad\.yaml:7:27: sweep\.collisions\[1\]: neither collisions nor time is given; .*",
        str(error),
    )
    error = refusal(BASE + "sweep: {cor: [0.5], container.shape: [box]}\n")
    assert [problem.position.line for problem in error.problems] == [2, 2]
    assert all("(at the point cor=0.5, container.shape=box)" in str(x) for x in error.problems)


@pytest.mark.parametrize(
    ("text", "key", "position"),
    [
        (BASE, "balls.radius", "run.yaml:7:17"),
        (BASE, "balls.mass", "run.yaml:8:34"),
        (BASE, "cor", "-o cor=0.5"),
        (BASE, "wall_cor", "run.yaml:2:1"),
        (PAIR, "balls.list[1].position[1]", "run.yaml:5:23"),
        (PAIR, "balls.list[0].mass", "run.yaml:4:7"),
    ],
)
def test_an_error_found_later_has_the_position_of_its_key(
    text: str, key: str, position: str
) -> None:
    sweep = "sweep:\n  balls.radius: [0.1, 1.0]\n  zip: {cor: [0, 1], balls.mass: [1, 2]}\n"
    loaded = parse(text + (sweep if text == BASE else ""), "run.yaml", ["cor=0.5"])
    assert str(loaded.error(key, "is wrong")) == f"{position}: {key}: is wrong"
