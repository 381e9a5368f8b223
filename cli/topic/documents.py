"""The messages in a text of several: JSON lines, or YAML documents."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import msgspec

SEPARATOR = "---"


def documents(lines: Iterable[str]) -> Iterator[str]:
    """Yield the documents in `lines`: a line of JSON is one, others end at a line `---`.

    This is what `cogmap topic echo` prints, with --json and without.
    """
    written: list[str] = []
    for line in lines:
        is_whole = not written and _is_json(line)
        if line.strip() != SEPARATOR:
            written.append(line)
        if is_whole or line.strip() == SEPARATOR:
            yield from _joined(written)
            written = []

    yield from _joined(written)


def _joined(written: list[str]) -> Iterator[str]:
    """Yield the document of these lines, unless it is blank."""
    text = "".join(written).strip()
    if text:
        yield text


def _is_json(line: str) -> bool:
    if not line.startswith("{"):
        return False

    try:
        msgspec.json.decode(line)
    except (msgspec.DecodeError, RecursionError):
        return False
    return True
