"""Every option of a command, declared once, and how errors name it to a user.

A command takes its parameters from these (``cli/parameters.py``), and a method of ``api`` that has
the same argument takes its word, its default and its help (``api/arguments.py``). An error prints
an option itself: ``--from`` for a user of a command, ``since`` for a script.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

ENDINGS = "ENDINGS"
"""In the help of an option: the endings of files, which are known when the help is printed."""

_in_command = False


@contextmanager
def in_command() -> Iterator[None]:
    """Inside, a command runs, so that errors name its options, and not arguments of Python."""
    global _in_command
    before, _in_command = _in_command, True
    try:
        yield
    finally:
        _in_command = before


@dataclass(frozen=True)
class Wording:
    """What a user can give: as a text in a command, and in Python."""

    command: str
    python: str

    def __str__(self) -> str:
        return self.command if _in_command else self.python


@dataclass(frozen=True)
class Option:
    """An option of commands, which some methods of ``api`` have as an argument.

    name : on the command line
    help : with the default in brackets
    type : of its value on the command line; a flag is ``bool``
    metavar : stands for the value in the help of the command
    word : the argument in Python [the name]
    default : of both
    python_default : of Python, if it is another one
    least, most : limits of a number
    short : a second name, such as ``-j``
    python : what a sentence names in Python [the word; of a flag it is true]
    """

    name: str
    help: str
    type: Any = bool
    metavar: str | None = None
    word: str = ""
    default: Any = None
    python_default: Any = None
    least: float | None = None
    most: float | None = None
    short: str = ""
    python: str = ""

    def __post_init__(self) -> None:
        word = self.word or self.name.removeprefix("--").replace("-", "_")
        object.__setattr__(self, "word", word)
        if self.type is bool and self.default is None:
            object.__setattr__(self, "default", False)

    def __str__(self) -> str:
        if _in_command:
            return self.name
        return self.python or (f"{self.word}=True" if self.type is bool else self.word)

    def of(self, value: Any) -> str:
        """The option with a value, as a user gives it: ``--size 3x3``, ``size='3x3'``."""
        if _in_command:
            return f"{self.name} {value}"
        return f"{self.word}={value if isinstance(value, int | float) else repr(str(value))}"


# Of several commands.

WHERE = Option(
    "--where",
    "Only points with this: `cor=0.8,0.9`, `cor=0.7:0.9` or `'cor>0.8'`. Can be repeated.",
    list[str],
    "KEY=VALUE",
    default=(),
    python="keywords, as in cor=0.8",
)
OVERRIDES = Option(
    "--override",
    "Set a key; `-o cor=0.8,0.9`, `-o cor=0.5:1.0:11` and `-o balls.rings=range(1,6)` sweep it. "
    "Can be repeated.",
    list[str],
    "KEY=VALUE",
    "overrides",
    short="-o",
)
QUANTITY = Option(
    "--quantity", "Only what has NAME in it. Can be repeated.", list[str], "NAME", default=()
)
MODEL = Option(
    "--model", "Only what has NAME in it. Can be repeated.", list[str], "NAME", default=()
)
AS_JSON = Option("--json", "Print JSON on stdout.", word="as_json")
REPLACE = Option("--replace", "Replace the file if it exists.", python_default=True)
JOBS = Option(
    "--jobs",
    "Repeats at a time [all cores].",
    int | None,
    "N",
    least=1,
    most=1024,
    short="-j",
)
OPEN = Option("--open", "Show it in the browser.", word="open_page")

# Of `snooker init`.

CONFIG_OUT = Option("--out", "The config; - prints it [TEMPLATE.yaml].", Path | None, "FILE")
LIST_TEMPLATES = Option("--list", "List templates and example configs.", word="list_all")

# Of `snooker run`.

RUN_OUT = Option("--out", "The run's folder [runs/CONFIG's name].", Path | None, "DIR")
EXECUTOR = Option("--executor", "threads, or dask=tcp://HOST:PORT.", str, "NAME", default="threads")
FRESH = Option("--fresh", "Replace all results in the folder.")
PART = Option("--part", "Only every N-th batch from the K-th on.", str | None, "K/N")
CHECKPOINT = Option(
    "--checkpoint",
    "Save unfinished repeats this often.",
    float,
    "MINUTES",
    "minutes",
    default=10.0,
    least=0,
)
DRY_RUN = Option("--dry-run", "Only show the search, time, disk and typical scales.")
YES = Option("--yes", "Allow runs over a week or the free disk space.", python_default=True)
NO_PROGRESS = Option("--no-progress", "No progress bar or lines.")

# Of `snooker show` and `verify`.

HASHES = Option(
    "--hash", "Print a hash of the first 1,000, 10,000 … and of all collisions.", word="hashes"
)
HASHES_POINT = Option("--point", "Hashes: only this point, from 0.", int | None, "N", least=0)
HASHES_REPEAT = Option("--repeat", "Hashes: only this repeat, from 0.", int | None, "N", least=0)
REPLAY = Option("--replay", "Simulate every repeat again, and compare.")
EXACT = Option("--exact", "Prove which events of a repeat are certain.")
EXACT_POINT = Option("--point", "With --exact: this point [all].", int | None, "N", least=0)
EXACT_REPEAT = Option(
    "--repeat", "With --exact: this repeat of a point.", int, "N", default=0, least=0
)
EXACT_COLLISIONS = Option(
    "--collisions", "With --exact: at most these.", int, "N", default=10_000, least=1
)
CERTIFICATE = Option("--out", "With --exact: write the certificate.", Path | None, "FILE")

# Of `snooker fit` and `compare`.

FIT_SINCE = Option("--from", "Fit from this time on, s.", float, "T", "since", default=0.0)
FIT_UNTIL = Option("--until", "Fit up to this time, s.", float | None, "T")
ALL = Option("--all", "Print more columns and rows.", word="every")
BRIEF = Option("--brief", "Print what holds for each point, without tables.")

# Of `snooker plot`.

LIST_FIGURES = Option("--list", "List figures; with RUN those that fit.", word="list_figures")
REPEAT = Option("--repeat", "Only this one [the first, or all].", int | None, "K", least=0)
TIMES = Option(
    "--time",
    "Times of snapshot, s [start, middle, end].",
    str | None,
    "T,T,…",
    "times",
)
COLOUR = Option(
    "--colour",
    "Of snapshot: speed, species, density.",
    Literal["speed", "species", "density"] | None,
    "WORD",
)
FIGURES_OUT = Option("--out", "Folder [RUN/figures].", Path | None, "DIR")
FORMATS = Option("--format", "Formats: svg, png, pdf.", str, "F,F,…", "formats", default="svg,png")
SIZE = Option("--size", "Inches, as 6x4 [a column of a page].", str | None, "WxH")
DPI = Option("--dpi", "PNG: pixels per inch [200].", int | None, "N", least=20, most=2000)
LOG_X = Option("--log-x", "Logarithmic x axis.")
LOG_Y = Option("--log-y", "Logarithmic y axis.")

# Of `snooker animate`.

FILM_OUT = Option("--out", "A name in .html, .gif or .mp4 [RUN/film….html].", Path | None, "FILE")
FILM_POINT = Option("--point", "Point, from 0 [0].", int | None, "N", least=0)
REPEATS = Option(
    "--repeat",
    "Repeat, from 0 [0]. Can be repeated.",
    list[int],
    "N",
    "repeats",
    default=(),
    least=0,
)
SINCE = Option("--from", "Start time, s.", float, "T", "since", default=0.0)
UNTIL = Option("--until", "End time, s [the end].", float | None, "T")
COLLISIONS = Option("--collisions", "At most this many [10,000].", int | None, "N", "most", least=1)
PACE = Option(
    "--pace",
    "Time or collisions pass evenly.",
    Literal["time", "events"],
    "time|events",
    default="time",
)
SECONDS = Option(
    "--seconds",
    "Length [12; a page: by its content].",
    float | None,
    "S",
    least=0.1,
    most=3600,
)
FPS = Option("--fps", "GIF, MP4: frames/s [20].", int | None, "N", least=1, most=60)

# Of `snooker live`.

PAGE_OUT = Option("--out", "The page [gas.html].", Path | None, "FILE")
CONTROLS = Option(
    "--controls",
    "Show only these sliders and menus, as in cor,radius [all].",
    str | None,
    "NAME,…",
)
BEGINNER = Option("--beginner", "Leave out virial, momentum, config and hashes.")
LANGUAGE = Option("--language", "Language of the page: en or de.", str, "NAME", default="en")

# Of `snooker report` and `reproduce`.

REPORT_OUT = Option("--out", "The report's folder [RUN/report].", Path | None, "DIR")
FIGURES = Option(
    "--figures", "Also these figures; all: every possible one.", str, "F,F,…", default=""
)
MARKDOWN = Option("--markdown", "Write report.md instead, with figures beside it.")
RUNS = Option("--runs", "The folder with the runs of configs/.", Path, "DIR", default=Path("runs"))
REPRODUCTION_OUT = Option("--out", "The report's folder.", Path, "DIR", default=Path("runs/report"))

# Of `snooker export`.

POINT = Option("--point", "Point, from 0.", int, "N", default=0, least=0)
EXPORT_REPEAT = Option("--repeat", "Repeat, from 0.", int, "N", default=0, least=0)
STATES = Option("--states", "Export positions and velocities.")
STATE_TIMES = Option(
    "--times",
    "States: times in s, or start:stop:count [0 and the end].",
    str | None,
    "T,T,…",
)
FRAMES = Option(
    "--frames", "States: number of even times.", int | None, "N", least=2, most=10_000_000
)
TABLE = Option("--table", "Export a row for each repeat of all points.", python="run.export")
EXPORT_OUT = Option("--out", f"A {ENDINGS} [stdout].", Path | None, "FILE")

# Of `snooker bench`.

QUICK = Option("--quick", "A small measurement, in seconds; do not quote it.")
EARLIER = Option("--compare", "Compare with this earlier speed.json.", Path | None, "FILE")
BENCH_OUT = Option("--out", "Also write tables, JSON and figures here.", Path | None, "DIR")

# Of none: what sentences name besides options.

OUT = Option("--out", "", str, python="out=…")
JSON_HAS_ALL = Wording("; --json prints all", "")
FIGURE_NAMES = Wording("`snooker plot --list`", "snooker.figure_list()")
TEMPLATE_NAMES = Wording("`snooker init --list`", "snooker.templates()")
RUNS_LISTED = Wording("`snooker ls`", "snooker.statuses()")
PLUGINS_LISTED = Wording("`snooker plugins`", "snooker.plugin_list()")
RUN_CONFIG = Wording("`snooker run CONFIG`", "snooker.run(CONFIG)")
