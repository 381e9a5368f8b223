"""docs/troubleshooting.md explains sentences that the code says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from cogmap.cli.launch.outcome import Outcome

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs/troubleshooting.md"
_SPLIT_LITERAL = re.compile(r'"\s*\n\s*f?"')
_PLACEHOLDER = re.compile(r"\{[^{}]*\}")
_CODE = re.compile(r"`([^`]+)`")


def said() -> str:
    """Everything that the code may say, what differs left out."""
    folders = [ROOT / name for name in ("cogmap", "cli", "services")]
    sources = [path.read_text("utf-8") for folder in folders for path in folder.rglob("*.py")]
    joined = _SPLIT_LITERAL.sub("", "\n".join(sources))
    return _PLACEHOLDER.sub("...", joined)


def explained(heading: str) -> Iterator[str]:
    """What is in code in the first column of the tables under headings like that one."""
    for section in re.split(r"^## ", PAGE.read_text("utf-8"), flags=re.MULTILINE)[1:]:
        rows = [line for line in section.splitlines() if line.startswith("|")]
        if rows and rows[0].startswith(f"| {heading} "):
            for row in rows[2:]:
                yield from _CODE.findall(row.split("|")[1])


def test_every_sentence_that_is_explained_is_said() -> None:
    code = said()
    sentences = list(explained("it says"))

    parts = [part.strip() for sentence in sentences for part in sentence.split("...")]
    assert len(sentences) > 20
    assert [part for part in parts if part not in code] == []


def test_every_end_of_a_drive_that_is_none_of_its_goals_is_explained() -> None:
    aimed_at = {Outcome.ROUTE_COMPLETE, Outcome.RECORDING_OVER, Outcome.INTERRUPTED}
    others = {outcome.value for outcome in Outcome if outcome not in aimed_at}

    assert set(explained("`ended_by`")) == others
