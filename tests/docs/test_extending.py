"""docs/extending.md is made of the example packages, of what commands print, and of docstrings.

``pytest tests/docs/test_extending.py --write-goldens`` writes these parts.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from installed import PACKAGES, Installed, with_examples

from snooker_cli import extending
from snooker_cli.analysis.time_series import Averages
from snooker_cli.facts import FACTS

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
FILE = re.compile(r"`([\w./-]+)`:\n\n```(?:toml|python|yaml)\n(.*?)```", re.DOTALL)
"""A file and its content."""

PRINTED = re.compile(r"<!-- printed: ([\w -]+) -->\n```text\n(.*?)```", re.DOTALL)
"""The name of an output, and the output."""

TABLE = re.compile(r"<!-- table: (\w+) -->\n((?:\n(?:\|.*\n)+)?)")
"""The name of a table, and the table."""

LAYERS = (extending.Line, extending.Points, extending.Band, extending.Reference)
METHODS: dict[type, tuple[str, ...]] = {
    extending.Gas: (
        *("ratio", "temperature", "pressure", "ideal_pressure", "pair_rate", "wall_rate"),
        *("root_temperature", "fixed_speed", "mean_of_states"),
    ),
    extending.FigureBuilder: (
        *("points", "traces", "measurement", "repeats", "start", "label", "record"),
        *("add_points", "add_histogram", "add_means", "add_residuals", "predicted", "figure"),
    ),
}
GAS = {"number": "N", "density": "N over the area, 1/m²", "radius": "of the first ball, m"} | {
    "mass": "of the first ball, kg",
    "scene": "the start of the first repeat",
    "container": "of the scene",
    "means": "means over the part after the relaxation, or over the steady part",
    "measurement": "all that was measured in the repeats",
}
"""Attributes of a ``Gas`` without a docstring of their own."""


def described(entry: type) -> dict[str, str]:
    """What a docstring says of each field: ``name, name : text``."""
    found: dict[str, str] = {}
    for line in (inspect.getdoc(entry) or "").splitlines():
        if field := re.match(r"(\w+(?:, \w+)*) : (.*)", line):
            found[field[1]] = field[2]
        elif found and line.startswith("    "):
            found[next(reversed(found))] += f" {line.strip()}"
    return found


def first_sentence(member: Any) -> str:
    """The first paragraph of a docstring, without its marks of ReStructuredText."""
    return " ".join((inspect.getdoc(member) or "").split("\n\n")[0].split())


def parameters(function: Any) -> list[inspect.Parameter]:
    """The arguments of a function."""
    return [*inspect.signature(function).parameters.values()]


def signature(function: Any) -> str:
    """The name of a function and its arguments."""
    return f"{function.__name__}({', '.join(inspect.signature(function).parameters)})"


def methods(entry: type) -> dict[str, str]:
    """The chosen members with their arguments."""
    found = {}
    for name in METHODS[entry]:
        member = inspect.getattr_static(entry, name)
        sentence = first_sentence(getattr(member, "func", member))
        arguments = ""
        if inspect.isfunction(member):
            names = [
                str(each).partition(":")[0]
                for each in inspect.signature(member).parameters.values()
            ]
            arguments = f"({', '.join(names[1:])})"
        found[f"{name}{arguments}"] = sentence
    return found


def table(rows: Mapping[str, str | tuple[str, ...]], *headings: str) -> str:
    """Rows in Markdown: the name, and one text or one of each heading after the first."""
    headings = headings or ("name", "meaning")
    lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
    for name, texts in rows.items():
        found = (texts,) if isinstance(texts, str) else texts
        plain = (text.replace("``", "`").replace("|", "\\|") for text in found)
        lines.append(f"| `{name}` | {' | '.join(plain)} |")
    return "\n".join(["", *lines, ""])


def tables() -> dict[str, str]:
    """The tables of the page by their names."""
    classes = ("Quantity", "Theory", "FigureSpec", "Result", "Trace", "Events", "States", "Scene")
    found = {name: table(described(getattr(extending, name))) for name in (*classes, "Format")}
    found["Averages"] = table(described(Averages))
    found["Gas"] = table(GAS | methods(extending.Gas))
    found["FigureBuilder"] = table(methods(extending.FigureBuilder))
    found["Layers"] = table({signature(layer): first_sentence(layer) for layer in LAYERS})
    functions = (extending.near_pairs, extending.mean_and_error, extending.replay)
    found["functions"] = table(
        {signature(function): first_sentence(function) for function in functions}
        | {
            signature(
                extending.over_time
            ): "A function of places, velocities and scene at times, s."
        }
    )
    why = {
        name: (first_sentence(known.holds), re.sub(r"\{[^}]*\}", "…", known.absence))
        for name, known in FACTS.items()
    }
    found["facts"] = table(why, "fact", "meaning", "why a gas without it lacks something")
    return found


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return with_examples(tmp_path_factory.mktemp("installed"))


def printed(installed: Installed) -> dict[str, str]:
    """What commands print, by the names of the page."""
    lines = installed.snooker("plugins").splitlines()
    first = next(n for n, line in enumerate(lines) if "snooker-neighbour" in line)
    own = lines[first : first + 2]
    compared = installed.snooker("compare", "gas").splitlines()
    (row,) = (line for line in compared if line.startswith("alignment"))
    caption = installed.snooker("plot", "gas", "free-times").splitlines()[3:]
    return {
        "plugins of neighbour-alignment": "\n".join(own) + "\n",
        "row": f"{row}\n",
        "caption": "\n".join(caption) + "\n",
    }


def test_the_page_is_made_of_the_examples_of_outputs_and_of_docstrings(
    installed: Installed, request: pytest.FixtureRequest
) -> None:
    text = PAGE.read_text("utf-8")
    outputs, rows = printed(installed), tables()

    def file(found: re.Match[str]) -> str:
        path = PACKAGES / found[1]
        content = path if path.exists() else installed.here / found[1]
        return f"{found[0][: -len(found[2]) - 3]}{content.read_text('utf-8')}```"

    made = FILE.sub(file, text)
    made = PRINTED.sub(lambda m: f"<!-- printed: {m[1]} -->\n```text\n{outputs[m[1]]}```", made)
    made = TABLE.sub(lambda m: f"<!-- table: {m[1]} -->\n{rows[m[1]]}", made)
    if request.config.getoption("--write-goldens"):
        PAGE.write_text(made, encoding="utf-8")
    assert made == PAGE.read_text("utf-8")
    assert len(FILE.findall(text)) == 9
    assert {*outputs} == {name for name, _ in PRINTED.findall(text)}
    assert {*rows} <= {name for name, _ in TABLE.findall(text)}


def test_each_fact_has_a_meaning() -> None:
    assert [name for name, known in FACTS.items() if not first_sentence(known.holds)] == []


def test_a_range_of_pydantic_is_that_of_a_number(tmp_path: Path) -> None:
    """The law of the page, as a package."""
    (source,) = (
        block
        for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
        if "Annotated[float, Field(" in block
    )
    installed = Installed(tmp_path)
    installed.write("soft", source, laws="Soft")
    text = "balls: {count: 4, radius: 0.5, speed: 1}\ncor: 0.5\ncollisions: 1\n"
    for number, answer in (("3", "soft.yaml: valid"), ("3.5", "less than or equal to 3, not 3.5")):
        law = f"law: {{name: soft, steepness: {number}}}\n"
        (installed.here / "soft.yaml").write_text(f"{text}{law}container: {{radius: 10}}\n")
        done = installed.ended("-m", "snooker_cli", "validate", "soft.yaml")
        assert answer in " ".join((done.stdout + done.stderr).split())


def test_the_last_block_of_the_page_works(installed: Installed) -> None:
    *_, script = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert installed.ended("-c", script).returncode == 0
