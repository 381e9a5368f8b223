"""Where in a TOML file something stands, for the errors that name it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from cogmap.errors import ConfigError

SCHEME = "scheme"
GUIDANCE = "guidance"
_HEADER = re.compile(rf"^\s*\[\[\s*({SCHEME}|{GUIDANCE})\s*\]\]")


class Source:
    """The text of a file of schemes.

    TOML's reader gives no line numbers, so a word is searched for among the lines of its scheme: of
    those that have it, the first with most of the words that stand `near` it. If none has it, the
    scheme's first line is named.
    """

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._lines = text.splitlines()
        self._headers: list[int] = []
        self._of_table: dict[str, list[int]] = {SCHEME: [], GUIDANCE: []}
        for number, line in enumerate(self._lines):
            header = _HEADER.match(line)
            if header is not None:
                self._headers.append(number)
                self._of_table[header[1]].append(number)

    def error(
        self,
        scheme: int | None,
        word: str,
        text: str,
        near: Iterable[str] = (),
        table: str = SCHEME,
    ) -> ConfigError:
        """Make an error about a word in the scheme of that number, from 0, among those of a table
        of TOML; `scheme` is None if the word is in none.
        """
        bounds = [*self._headers, len(self._lines)]
        headers = self._of_table.get(table, [])
        if scheme is None:
            first, end = 0, bounds[0]
        elif scheme >= len(headers):
            first, end = 0, len(self._lines)
        else:
            place = self._headers.index(headers[scheme])
            first, end = bounds[place], bounds[place + 1]

        found = [number for number in range(first, end) if self._has(number, word)]
        words = [*near]

        def share(number: int) -> int:
            return sum(self._has(number, each) for each in words)

        number = max(found, key=share, default=first)
        return ConfigError(f"{self._path}:{number + 1}: {text}")

    def _has(self, number: int, word: str) -> bool:
        """Decide whether a line has a word, outside comments."""
        code = self._lines[number].partition("#")[0]
        return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", code) is not None
