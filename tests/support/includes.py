"""Files that pages of docs/ show: `python -m tests.support.includes` writes them in anew.

A page names a file between two comments; the code between them is that of the file:

    <!-- include: examples/wanderer.py -->
    <!-- end of include -->
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
LANGUAGES = {".py": "python", ".rs": "rust", ".mjs": "javascript", ".toml": "toml"}

_INCLUDE = re.compile(
    r"(?P<begin><!-- include: (?P<path>\S+) -->\n).*?(?P<end><!-- end of include -->)", re.DOTALL
)


def included(text: str) -> str:
    """`text` with each file that it includes as it is now."""
    return _INCLUDE.sub(_block, text)


def _block(match: re.Match[str]) -> str:
    path = ROOT / match["path"]
    language = LANGUAGES[path.suffix]
    code = path.read_text()
    return f"{match['begin']}```{language}\n{code}```\n{match['end']}"


def included_paths(text: str) -> list[str]:
    """The files that `text` includes, from the root."""
    matches = _INCLUDE.finditer(text)
    return [match["path"] for match in matches]


def main() -> None:
    """Write every page anew."""
    for page in PAGES:
        text = page.read_text()
        page.write_text(included(text))


if __name__ == "__main__":
    main()
