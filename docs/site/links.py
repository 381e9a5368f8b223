"""Links of the documentation as they are in the site. Pure.

A link to a file of the repository leads to its page where it has one, else it is text: the sources
have no address of their own yet.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = "docs"
TUTORIAL = "examples/tutorial.ipynb"
PLACES = {
    "README.md": "index.md",
    TUTORIAL: "tutorial.md",
    "examples/README.md": "examples.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "reporting.md",
}
"""The pages of files outside of docs/, by their paths in the repository."""
_LINK = re.compile(r"(?P<image>!?)\[(?P<label>[^\]]*)\]\((?P<target>[^)\s]+)\)")
_FENCE = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)


def linked(text: str, place: str) -> str:
    """Return the text of the page at `place` with each of its links as it is in the site, but for
    what is code. Raises ValueError for a link to a file that does not exist.
    """
    parts = _FENCE.split(text)
    shown = [part if part.startswith("```") else _linked(part, place) for part in parts]
    return "".join(shown)


def _linked(text: str, place: str) -> str:
    return _LINK.sub(lambda match: _link(match, place), text)


def _link(match: re.Match[str], place: str) -> str:
    target, _, anchor = match["target"].partition("#")
    if not target or ":" in target:
        return match[0]

    source = source_of(place)
    path = Path(os.path.normpath(source.parent / target))
    if not (ROOT / path).exists():
        raise ValueError(f"{source} links {target}, which does not exist")

    page = page_of(path)
    if page is None:
        return match["label"]

    relative = os.path.relpath(page, Path(place).parent)
    fragment = f"#{anchor}" if anchor else ""
    return f"{match['image']}[{match['label']}]({relative}{fragment})"


def source_of(place: str) -> Path:
    """Return the file of the repository that is the page at `place`."""
    sources = {page: source for source, page in PLACES.items()}
    return Path(sources.get(place, f"{DOCS}/{place}"))


def page_of(path: Path) -> str | None:
    """Return the place of the page, or of the picture, that a file or folder of the repository has;
    None if it has none.
    """
    if (ROOT / path).is_dir():
        path /= "README.md"
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS).as_posix()
    return PLACES.get(path.as_posix())
