"""The manifest of a run: what is refused in it, and with which sentence."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from repeating import made, run_of

from snooker_cli import runs
from snooker_cli.errors import StoreError
from snooker_cli.files import write_json
from snooker_cli.runs import MANIFEST, RunFolder

Content = dict[str, Any]

LARGE = 10**300
NUMBER = " is given where a whole number of 0 or more (below 2^63) is needed"
MAPPING = " is given where a mapping of keys to values is needed"


@pytest.fixture
def grown(tmp_path: Path, small_config: str) -> RunFolder:
    """A run with points that its sweep no longer lists; without repeats."""
    made(tmp_path, small_config, "container.mass=.inf,1e7")
    run = runs.continued(run_of(tmp_path, small_config, "container.mass=1e6,1e7"))
    runs.create(run)
    return run


def test_a_manifest_is_read_as_it_was_written(grown: RunFolder) -> None:
    assert [point.index for point in grown.points] == [4, 1, 5, 3]
    assert [point.index for point in grown.former] == [0, 2]
    assert runs.open_run(grown.directory) == grown


def changed(*path: str | int, to: Any) -> Callable[[Content], None]:
    """A change of the value at a path of the manifest."""

    def change(content: Any) -> None:
        for part in path[:-1]:
            content = content[part]
        content[path[-1]] = to

    return change


DAMAGES: dict[str, Callable[[Content], object]] = {
    **{
        f"{name}: {value}{NUMBER}": changed(*path, to=given)
        for name, path in (
            ("points[1].index", ("points", 1, "index")),
            ("former[0].index", ("former", 0, "index")),
            ("schema_version", ("schema_version",)),
            ("engine_version", ("engine_version",)),
        )
        for value, given in (
            (f"{LARGE}"[:59] + "…", LARGE),
            ("-1", -1),
            ("1.5", 1.5),
            (".inf", float("inf")),
            ("the text 1", "1"),
            ("the truth value true", True),
        )
    },
    "points: an empty mapping is given where a list is needed": changed("points", to={}),
    f"points[0]: 1{MAPPING}": changed("points", 0, to=1),
    f"experiment: nothing (null){MAPPING}": changed("experiment", to=None),
    f"former[0].parameters: an empty list{MAPPING}": changed("former", 0, "parameters", to=[]),
    "points[0].digest: 5 is given where a text is needed": changed("points", 0, "digest", to=5),
    "points[0].digest: the key is missing": lambda content: content["points"][0].pop("digest"),
    "points: the key is missing": lambda content: content.pop("points"),
    "two of its points have one number": changed("former", 0, "index", to=1),
    "its points are not those of its experiment": changed("points", 0, "digest", to="0"),
    "former[0]: its parameters are not those of its experiment": changed(
        *("former", 0, "parameters"), to={"container.mass": 5.0}
    ),
}


@pytest.mark.parametrize("reason", DAMAGES)
def test_a_wrong_value_is_named(reason: str, grown: RunFolder) -> None:
    path = grown.directory / MANIFEST
    content = json.loads(path.read_text())
    DAMAGES[reason](content)
    path.write_text(json.dumps(content))
    with pytest.raises(StoreError, match=re.escape(f"cannot be read ({reason})")):
        runs.open_run(grown.directory)


def test_a_mapping_is_no_value_of_a_swept_key(grown: RunFolder) -> None:
    path = grown.directory / MANIFEST
    content = json.loads(path.read_text())
    former = content["former"][0]
    former["parameters"] = {"container": former["experiment"]["container"]}
    write_json(path, content)
    with pytest.raises(StoreError, match="its parameters are not those of its experiment"):
        runs.open_run(grown.directory)


def test_a_new_point_has_a_number_that_can_be_stored(grown: RunFolder, small_config: str) -> None:
    """Even if another program gave a point the largest one."""
    path = grown.directory / MANIFEST
    content = json.loads(path.read_text())
    content["points"][0]["index"] = largest = 2**63 - 1
    write_json(path, content)
    run = runs.continued(run_of(grown.directory, small_config, "container.mass=1e6,1e8"))
    assert largest in run.by_number
    runs.create(run)
    assert runs.open_run(grown.directory) == run
