"""What the shell offers on Tab: keys, runs, figures, templates and configs, loaded when asked."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import typer

RUNS, MANIFEST, PACKED = Path("runs"), "run.json", ".h5"
"""As in ``results``, which takes a second to load: too long to wait for after a Tab."""

LINE = 72
"""Characters of an explanation: rich breaks longer ones, and fish takes a line for a candidate."""

Offer = tuple[str, str]
"""What can be typed, and what it means."""


class Key(NamedTuple):
    """A key that -o can set: its path, what it means, and its values if those are words."""

    path: str
    description: str
    words: tuple[str, ...]


def rejoined() -> str:
    """Undo that bash takes ``cor=0.5`` for three words, as it does at each ``=`` and ``:``.

    Changes the words in the environment, by which bash asks. It will replace only what is behind
    the ``=``, so that this alone is left there as the last word; what is before it is returned.
    """
    if os.environ.get("_SNOOKER_COMPLETE") != "complete_bash":
        return ""
    words = os.environ.get("COMP_WORDS", "").split("\n")[: int(os.environ.get("COMP_CWORD", 0)) + 1]
    whole = words[:1]
    for before, word in pairwise(words):
        if _breaks(before) or _breaks(word):
            whole[-1] += word
        else:
            whole.append(word)
    if len(whole) == len(words):
        return ""
    last = "" if _breaks(words[-1]) else words[-1]
    typed = whole.pop().removesuffix(last)
    if typed.startswith("--"):
        option, _, typed = typed.partition("=")
        whole.append(option)
    os.environ["COMP_WORDS"] = "\n".join([*whole, last])
    os.environ["COMP_CWORD"] = str(len(whole))
    return typed


def _breaks(word: str) -> bool:
    """Whether a word is none but what bash has between two that were one."""
    return word != "" and not word.strip("=:")


def configs(incomplete: str) -> list[str]:
    """YAML files in the folder that is typed and one below; without any, the shell offers files."""
    folder, _, _ = incomplete.rpartition("/")
    start = Path(folder or ("/" if incomplete.startswith("/") else "."))
    found = [path for pattern in ("*.y*ml", "[!.]*/*.y*ml") for path in start.glob(pattern)]
    return sorted(path.as_posix() for path in found)


def runs() -> list[str]:
    """Names of the runs in runs/, packed ones too; what is elsewhere is for the shell.

    A packed run has its ending where a folder has its name, which then means the folder.
    """
    folders = {path.parent.name for path in RUNS.glob(f"*/{MANIFEST}")}
    packed = RUNS.glob(f"*{PACKED}")
    return sorted(folders | {path.name if path.stem in folders else path.stem for path in packed})


def figures(context: typer.Context) -> list[Offer]:
    """Figures that are not on the command line yet."""
    from snooker_cli.gallery import KINDS

    given = context.params.get("figures") or ()
    return [(name, _plain(kind.title)) for name, kind in KINDS.items() if name not in given]


def templates() -> list[Offer]:
    """Templates of ``init``."""
    from snooker_cli.cli.templates import purpose
    from snooker_cli.cli.templates import templates as found

    return [(name, _plain(purpose(template))) for name, template in found().items()]


def executors(context: typer.Context) -> list[Offer]:
    """Who can simulate."""
    meant = "Workers of the dask scheduler at HOST:PORT."
    offers = [
        ("threads", "Threads of this machine."),
        ("dask=tcp://", meant),
        ("dask=tls://", meant),
    ]
    return _behind(context, offers)


def overrides(context: typer.Context, incomplete: str) -> list[Offer]:
    """Keys for -o; when only one is left, its values: the words it can be, or the config's own."""
    return _behind(context, _overrides(context, f"{context.obj or ''}{incomplete}"))


def _behind(context: typer.Context, offers: list[Offer]) -> list[Offer]:
    """Of offers what bash will put behind what ``rejoined`` has returned."""
    before = context.obj or ""
    return [
        (offer.removeprefix(before), meaning)
        for offer, meaning in offers
        if offer.startswith(before) and offer != before
    ]


def _overrides(context: typer.Context, wanted: str) -> list[Offer]:
    """What an override can be that begins with what is wanted."""
    typed, equals, _ = wanted.partition("=")
    keys = [key for key in _keys(typed) if key.path.startswith(typed)]
    keys = [key for key in keys if key.path == typed] if equals else keys
    offers = [(f"{key.path}=", _plain(key.description)) for key in keys]
    if len(keys) != 1:
        return offers
    (key,) = keys
    if key.words:
        return [(f"{key.path}={word}", _plain(key.description)) for word in key.words]
    # An -o without its value ends the parsing before arguments get their names.
    config = next(iter(context.args), None)
    present = _present(config, key.path)
    return [*offers, *((f"{key.path}={value}", _plain(f"as in {config}")) for value in present)]


def _keys(typed: str) -> list[Key]:
    """All keys of a config; in a list those of the item that is typed, else of the first."""
    from snooker_cli.config import schema

    document = schema()
    index = re.search(r"\[[0-9]+\]", typed)
    found: dict[str, Key] = {}
    for key in _inside("", document, document["$defs"]):
        path = key.path.replace("[0]", index[0] if index else "[0]")
        found.setdefault(path, key._replace(path=path))
    return list(found.values())


def _inside(path: str, entry: Mapping[str, Any], models: Mapping[str, Any]) -> Iterator[Key]:
    """The keys in an entry of the schema, itself if it is one that holds no other."""
    alternatives = [
        models[each["$ref"].rpartition("/")[2]] if "$ref" in each else each
        for each in (entry, *entry.get("oneOf", ()), *entry.get("anyOf", ()))
    ]
    words = tuple(str(word) for each in alternatives for word in each.get("enum", ()))
    inner = {
        name: value for each in alternatives for name, value in each.get("properties", {}).items()
    }
    lists = [each["items"] for each in alternatives if isinstance(each.get("items"), Mapping)]
    models_in_lists = [each for each in lists if "$ref" in each]
    if path and (words or not (inner or models_in_lists)):
        yield Key(path, entry.get("description", ""), words)
    for name, value in inner.items():
        if path or name != "sweep":
            yield from _inside(f"{path}.{name}".removeprefix("."), value, models)
    for each in models_in_lists:
        yield from _inside(f"{path}[0]", each, models)


def _present(config: str | None, path: str) -> list[str]:
    """The value that a key has in a config, as -o is given it; none if it cannot be told."""
    import json

    from snooker_cli.config import ConfigError, load, to_json

    if config is None:
        return []
    try:
        value = json.loads(to_json(load(config).experiment))
        for name, index in re.findall(r"(\w+)|\[(\d+)\]", path):
            value = value[int(index) if index else name]
    except (ConfigError, OSError, LookupError, TypeError):
        return []
    return [json.dumps(value, ensure_ascii=False, separators=(",", ":"))]


def _plain(text: str) -> str:
    """Text as Typer's scripts can show it: a line, no apostrophes for zsh, no markup for rich."""
    from textwrap import shorten

    from rich.markup import escape

    return escape(shorten(text.replace("'", "’"), LINE, placeholder="…"))
