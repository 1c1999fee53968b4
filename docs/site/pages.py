"""Adds pages to the site that are not in docs/: the README and its neighbours, the reference, and
the live page.

MkDocs calls the two functions. Links are written for a code host; here they lead to pages of the
site, and links to sources become plain text.
"""

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

import snooker_cli

ROOT = Path(__file__).parents[2]
PAGES = {name: name for name in ("CONTRIBUTING.md", "CHANGELOG.md")} | {"README.md": "index.md"}
LIVE = "gas.html"
REFERENCE = """# Reference of the Python interface

`import snooker_cli as snooker` has these names. [Python](python.md) shows them at work. Units are
SI with k_B = 1.

"""


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of the root folder, and the reference of all public names."""
    for name, page in PAGES.items():
        text = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](")
        files.append(File.generated(config, page, content=text))
    places = [f"{getattr(snooker_cli, name).__module__}.{name}" for name in snooker_cli.__all__]
    text = REFERENCE + "\n\n".join(f"::: {place}" for place in places)
    files.append(File.generated(config, "reference.md", content=text))
    files.append(File.generated(config, LIVE, content=snooker_cli.live().html))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """The page with links that exist on the site."""
    if page.file.src_uri == "live.md":
        markdown = markdown.replace(
            "![The live page", f"[Open the page]({LIVE}).\n\n![The live page", 1
        )
    for name, page in PAGES.items():
        markdown = re.sub(rf"\]\((?:\.\./)?{name}", f"]({page}", markdown)
    return re.sub(r"\[([^]]*)\]\((?:\.\./\w+/[^)]*|CITATION\.cff|LICENSE)\)", r"\1", markdown)
