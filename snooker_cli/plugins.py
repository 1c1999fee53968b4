"""What installed packages add to tables of snooker, such as that of figures: entry points.

A table has what snooker has, and then what installed distributions have. Nothing else is loaded: no
file that a config or a run names, and nothing of the current folder. What cannot be added is kept
with the reason, and changes nothing else. Distributions are looked at when a table is asked for a
name that snooker does not have, or for all names.
"""

import hashlib
import json
import logging
import os
import sys
import sysconfig
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from snooker_cli.errors import PACKAGES, SnookerError, error_text
from snooker_cli.options import PLUGINS_LISTED

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

PREFIX = "snooker."  # of all groups of entry points for snooker

T = TypeVar("T")

_log = logging.getLogger(__name__)
_lock = threading.RLock()
_loading: list[str] = []  # the entry point that is being loaded, if one is


class PluginError(SnookerError):
    """Something of an installed package that snooker cannot use."""


class Origin(NamedTuple):
    """Where something comes from.

    sources : SHA-256 of the module, or of all files of the package that it is in
    """

    distribution: str
    version: str
    sources: str


@dataclass(frozen=True)
class Plugin:
    """An entry point of an installed distribution.

    entry : its name and what it names: ``free-times = free_times:FIGURE``
    origin : without ``sources`` if these are not found
    thing : what it names, if that could be loaded
    name : in its table; empty if it is not there
    problem : why it is not in its table; empty if it is
    """

    group: str
    entry: str
    origin: Origin
    thing: Any = field(default=None, repr=False)
    name: str = ""
    problem: str = ""

    @property
    def source(self) -> str:
        """Its distribution and the version."""
        return f"{self.origin.distribution} {self.origin.version}"


class Table(Mapping[str, T]):
    """Things by their names: those of snooker, then those of installed distributions.

    group : of the entry points
    own : what snooker has
    taken : what an entry point names -> its name and its value; raises ``PluginError`` if it cannot
        be in this table

    A name that snooker has stays what it is. If two distributions have a name, neither counts.
    """

    def __init__(
        self, group: str, own: Mapping[str, T], taken: Callable[[Any], tuple[str, T]]
    ) -> None:
        self.group, self.own, self._taken = group, own, taken

    def __getitem__(self, name: str) -> T:
        return self.own[name] if name in self.own else self._added[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.own
        yield from self._added

    def __len__(self) -> int:
        return len(self.own) + len(self._added)

    def origin(self, name: str) -> Origin | None:
        """Where something comes from; ``None`` if snooker has it. Raises ``KeyError``."""
        if name in self.own:
            return None
        return {plugin.name: plugin.origin for plugin in self.plugins if plugin.name}[name]

    def absence(self, distribution: str) -> str:
        """Why this table lacks what a distribution has: left out, or not installed."""
        if any(p.problem and p.origin.distribution == distribution for p in self.plugins):
            return f"left out ({PLUGINS_LISTED} has the reason)"
        return "not installed"

    @cached_property
    def plugins(self) -> tuple[Plugin, ...]:
        """The entry points of the group, each with its name in this table or with its problem."""
        return tuple(self._found[1])

    @cached_property
    def _added(self) -> dict[str, T]:
        """What distributions add. What they cannot add is logged."""
        for plugin in self._found[1]:
            if plugin.problem:
                _log.warning("%s: %s is left out: %s", plugin.source, plugin.entry, plugin.problem)
        return self._found[0]

    @cached_property
    def _found(self) -> tuple[dict[str, T], list[Plugin]]:
        values: dict[str, T] = {}
        plugins = []
        for plugin in installed(self.group):
            if not plugin.problem:
                try:
                    name, value = self._taken(plugin.thing)
                    if name in self.own:
                        raise PluginError(f"snooker has {name} itself", "give it another name")
                    plugin = replace(plugin, name=name)
                    values.setdefault(name, value)
                except PluginError as error:
                    plugin = replace(plugin, problem=str(error))
            plugins.append(plugin)
        return self._without_twins(values, plugins)

    def _without_twins(
        self, values: dict[str, T], plugins: list[Plugin]
    ) -> tuple[dict[str, T], list[Plugin]]:
        """Without the names that occur twice: it is not known which one is meant."""
        names = [plugin.name for plugin in plugins if plugin.name]
        twins = {name for name in names if names.count(name) > 1}
        for place, plugin in enumerate(plugins):
            if plugin.name in twins:
                others = (p.source for p in plugins if p.name == plugin.name and p is not plugin)
                problem = f"{' and '.join(sorted(set(others)))} has {plugin.name}, too; remove one"
                plugins[place] = replace(plugin, problem=problem)
        found = [replace(p, name="") if p.problem else p for p in plugins]
        return {name: value for name, value in values.items() if name not in twins}, found


def check_function(function: object, name: str, *arguments: str) -> None:
    """Raise ``PluginError`` for what is no function that takes these arguments in this order.

    ``None`` is no function that is needed.
    """
    if function is None:
        return
    if not callable(function):
        raise PluginError(f"`{name}` is no function of {', '.join(arguments)}")
    with suppress(ValueError):  # a function of C may have no signature
        try:
            signature(function).bind(*arguments)
        except TypeError:
            has = ", ".join(signature(function).parameters)
            raise PluginError(
                f"`{name}` has the arguments {has}; it gets {', '.join(arguments)}"
            ) from None


def origins(*tables: Table[Any]) -> list[Origin]:
    """Where the things come from that distributions add to these tables, each once, in order."""
    found = (plugin for table in tables for plugin in table.plugins)
    return sorted({plugin.origin for plugin in found if not plugin.problem})


def installed(group: str) -> tuple[Plugin, ...]:
    """The entry points of a group by their distributions; each is loaded, or has a problem.

    Raises ``PluginError`` for a package that asks for it while it is being loaded.
    """
    with _lock:
        if _loading:
            raise PluginError(
                "it asks for what is installed while it is loaded", "do so in a function instead"
            )
        return _installed(group)


@cache
def _installed(group: str) -> tuple[Plugin, ...]:
    return tuple(_loaded(*found) for found in _entries() if found[0].group == group)


def without_table(*tables: Table[Any]) -> tuple[Plugin, ...]:
    """Entry points of other groups than these tables have; they are not loaded."""
    groups = [table.group for table in tables]
    return tuple(
        replace(_named(*pair), problem=f"the groups are {', '.join(groups)}; give one of them")
        for pair in _entries()
        if pair[0].group not in groups
    )


@cache
def _entries() -> "tuple[tuple[EntryPoint, Distribution], ...]":
    """The entry points of snooker's groups of all installed distributions, in order of names."""
    from importlib.metadata import distributions  # takes a while to load

    places = [place for place in sys.path if not _is_here(Path(place))]
    names = {
        found.name
        for found in distributions(path=places)
        if f"[{PREFIX}" in (found.read_text("entry_points.txt") or "") and found.name
    }
    first = (next(iter(distributions(name=name, path=places))) for name in sorted(names))
    entries = ((entry, found) for found in first for entry in found.entry_points)
    ours = [pair for pair in entries if pair[0].group.startswith(PREFIX)]
    return tuple(sorted(ours, key=lambda pair: (pair[1].name, pair[0].group, pair[0].name)))


def _is_here(place: Path) -> bool:
    """Whether a folder is the current one, unless packages are installed there."""
    sites = {Path(sysconfig.get_path(name)).resolve() for name in ("purelib", "platlib")}
    return place.resolve() == Path.cwd() and place.resolve() not in sites


def _named(entry: "EntryPoint", found: "Distribution") -> Plugin:
    """An entry point that is not loaded."""
    origin = Origin(found.name, found.version, "")
    return Plugin(entry.group, f"{entry.name} = {entry.value}", origin)


def _loaded(entry: "EntryPoint", found: "Distribution") -> Plugin:
    """An entry point with what it names, or with the reason why that cannot be loaded."""
    plugin = _named(entry, found)
    try:
        root = _root(entry.module, found)
        sources = _sources_hash(root)
        PACKAGES[f"{root}{os.sep}" if root.is_dir() else str(root)] = plugin.source
        _loading.append(plugin.entry)
        try:
            thing = entry.load()
        finally:
            _loading.pop()
    except PluginError as error:
        return replace(plugin, problem=str(error))
    except (Exception, SystemExit) as error:  # a package of others may raise anything
        text = error_text(error) if isinstance(error, Exception) else str(error)
        return replace(plugin, problem=f"{type(error).__name__}: {text}")
    return replace(plugin, thing=thing, origin=plugin.origin._replace(sources=sources))


def _root(module: str, found: "Distribution") -> Path:
    """The folder of the package, or the file, that a module is in.

    Raises ``PluginError`` without one, and for one in the current folder that is not installed.
    """
    from importlib.util import find_spec

    name = module.partition(".")[0]
    spec = find_spec(name)
    if spec is None:
        raise PluginError(f"there is no module {name}", "install the package again")
    path = Path([*(spec.submodule_search_locations or ()), spec.origin or ""][0])
    if not path.exists():
        raise PluginError(f"the sources of {name} are not in files", "install it in a folder")
    editable = json.loads(found.read_text("direct_url.json") or "{}").get("dir_info", {})
    if _is_here(path.parent) and not editable.get("editable"):
        raise PluginError(f"{path.name} in the current folder hides {name}", "use another folder")
    return path


@cache
def _sources_hash(path: Path) -> str:
    """SHA-256 of a file, or of the names and files of a folder without compiled ones."""
    total = hashlib.sha256()
    files = [path] if path.is_file() else sorted(path.rglob("*"))
    for file in files:
        if file.is_file() and "__pycache__" not in file.parts:
            content = file.read_bytes()
            total.update(f"{file.relative_to(path.parent).as_posix()} {len(content)}\n".encode())
            total.update(content)
    return total.hexdigest()
