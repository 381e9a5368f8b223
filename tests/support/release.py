"""Checks a version before it is tagged: `make release` runs `python -m tests.support.release`."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable

from cogmap.version import VERSION
from tests.support.includes import ROOT

_SECTION = re.compile(r"^## (\S+)\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_CITED = re.compile(r"^version: (\S+)$", re.MULTILINE)


def problems(version: str, changelog: str, citation: str, tags: Iterable[str]) -> list[str]:
    """List what keeps `version` from being released; empty if nothing does."""
    found = []
    sections = dict(_SECTION.findall(changelog))
    newest = next(iter(sections), "")
    if not sections.get(version, "").strip():
        found.append(f"CHANGELOG.md has no section {version} with text")
    elif newest != version:
        found.append(f"CHANGELOG.md begins with {newest}, not with {version}")

    cited = _CITED.findall(citation)
    if cited != [version]:
        found.append(f"CITATION.cff has the version {', '.join(cited)}, not {version}")
    if f"v{version}" in tags:
        found.append(f"v{version} is tagged already: raise VERSION in cogmap/version.py")
    return found


def _git(*arguments: str) -> list[str]:
    run = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return run.stdout.splitlines()


def main() -> None:
    """The command. Exits with 1 and the reasons if the version cannot be released as it is."""
    changelog = (ROOT / "CHANGELOG.md").read_text()
    citation = (ROOT / "CITATION.cff").read_text()
    found = problems(VERSION, changelog, citation, _git("tag", "--list"))
    if _git("status", "--porcelain"):
        found.append("there are changes that are not committed")
    if found:
        sys.exit("\n".join(found))


if __name__ == "__main__":
    main()
