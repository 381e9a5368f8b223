"""Tables that people write as TOML, read with errors that name the line of what is wrong."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

import msgspec

from cogmap.errors import ConfigError
from cogmap.files.packed import read_text
from cogmap.files.toml import parsed
from cogmap.hints import did_you_mean

S = TypeVar("S", bound=msgspec.Struct)
_HEADER = re.compile(r"^\s*\[{1,2}\s*([A-Za-z]\w*)\s*\]{1,2}\s*(#.*)?$")


class Source:
    """The text of a file of tables, such as [start] and several [[street]].

    TOML's reader gives no line numbers, so a word is searched for among the lines of its table: of
    those that have it, the first with most of the words that stand `near` it. If none has it, the
    table's first line is named.
    """

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._lines = text.splitlines()
        self._headers: list[int] = []
        self._of_table: dict[str, list[int]] = {}
        for number, line in enumerate(self._lines):
            header = _HEADER.match(line)
            if header is not None:
                self._headers.append(number)
                self._of_table.setdefault(header[1], []).append(number)

    def error(
        self, table: str, number: int | None, word: str, text: str, near: Iterable[str] = ()
    ) -> ConfigError:
        """Make an error about a word in the table of that name and `number`, from 0, among those of
        its name; `number` is None if the word is in none.
        """
        bounds = [*self._headers, len(self._lines)]
        headers = self._of_table.get(table, [])
        if number is None:
            first, end = 0, bounds[0]
        elif number >= len(headers):
            first, end = 0, len(self._lines)
        else:
            place = self._headers.index(headers[number])
            first, end = bounds[place], bounds[place + 1]

        found = [line for line in range(first, end) if self._has(line, word)]
        words = [*near]

        def share(line: int) -> int:
            return sum(self._has(line, each) for each in words)

        line = max(found, key=share, default=first)
        return ConfigError(f"{self._path}:{line + 1}: {text}")

    def located(self, error: msgspec.ValidationError, kind: type[msgspec.Struct]) -> ConfigError:
        """Locate an error of converting to `kind`, which names its place by a path such as
        $.scheme[1].name.
        """
        text = str(error)
        place = re.search(r"\$\.(\w+)(?:\[(\d+)\])?", text)
        table = place[1] if place else ""
        words = re.findall(r"[A-Za-z]\w*", text.rpartition("$")[2]) or [""]
        word = words[-1]
        unknown = re.search(r"unknown field `(\w+)`", text)
        if unknown is not None:
            word = unknown[1]
            known = _fields_of(kind, table)
            remedy = did_you_mean(word, known, f"there are {', '.join(known)}")
            text = f"{text}: {remedy}"
        if place is None:
            return self.error(word, 0, word, text)
        return self.error(table, int(place[2] or 0), word, text)

    def _has(self, number: int, word: str) -> bool:
        """Decide whether a line has a word, outside comments."""
        code = self._lines[number].partition("#")[0]
        return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", code) is not None


def _fields_of(kind: type[msgspec.Struct], table: str) -> list[str]:
    """Return the fields that a table of a `kind` may have, its own tables for an empty name."""
    fields = {field.encode_name: field.type for field in msgspec.structs.fields(kind)}
    if table not in fields:
        return [*fields]

    info = msgspec.inspect.type_info(fields[table])
    of = info.item_type if isinstance(info, msgspec.inspect.ListType) else info
    if isinstance(of, msgspec.inspect.StructType):
        return [field.encode_name for field in of.fields]
    return []


def read_tables(path: Path, kind: type[S], what: str, remedy: str) -> tuple[Source, S]:
    """Read a file of tables as a `kind`. `what` it is, such as "file of schemes", and the `remedy`
    are for the error if there is none.

    Raises ConfigError that names the file, and the line of what is wrong in it.
    """
    try:
        text = read_text(path)
    except FileNotFoundError:
        raise ConfigError(f"no {what} {path}: {remedy}") from None
    except (UnicodeDecodeError, OSError) as error:
        raise ConfigError(f"cannot read {path} as TOML: {error}") from None

    source = Source(path, text)
    try:
        return source, msgspec.convert(parsed(text), kind)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"cannot read {path} as TOML: {error}") from None
    except msgspec.ValidationError as error:
        raise source.located(error, kind) from None
