"""Rows of the table for modules that are no part of this project, from a file in TOML:

[wanderer]
publishes = ["motor/program"]
subscribes = ["clock", "workspace/delta"]
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec

from cogmap.bus.access.keys import AUTHORITY
from cogmap.bus.access.subjects import SUBJECTS, Subject, module_row
from cogmap.errors import AccessError
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic

MODULES_NAME = "modules.toml"
"""The file with these rows, in the folder of the router's keys."""


class Row(msgspec.Struct, forbid_unknown_fields=True):
    """What a module declares, by the names of topics; `answers` are requests."""

    publishes: tuple[str, ...] = ()
    subscribes: tuple[str, ...] = ()
    answers: tuple[str, ...] = ()


def everybody(router: Path) -> dict[str, Subject]:
    """Return the table with the rows that the folder of a router's keys has besides. Raises
    AccessError.
    """
    path = router / MODULES_NAME
    return SUBJECTS | read(path) if path.exists() else SUBJECTS


def read(path: Path) -> dict[str, Subject]:
    """Read rows. Raises AccessError if they are no rows, or of a subject that there is already."""
    try:
        rows = msgspec.convert(tomllib.loads(path.read_text("utf-8")), dict[str, Row])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise AccessError(
            f"{path} has no rows of modules ({error}): write [NAME], and lists of topics as "
            "publishes, subscribes and answers"
        ) from None

    found = {}
    for name, row in rows.items():
        if not name.isidentifier() or name in SUBJECTS or name == AUTHORITY:
            raise AccessError(f"{path}: no module of yours can be called {name!r}: rename it")
        found[name] = module_row(
            name,
            publishes=_topics(path, row.publishes),
            subscribes=_topics(path, row.subscribes),
            answers=_topics(path, row.answers),
        )
    return found


def _topics(path: Path, names: tuple[str, ...]) -> list[Topic]:
    for name in names:
        if name not in topics.BY_NAME:
            raise AccessError(f"{path}: there is no topic {name!r}: see `cogmap interface list`")
    return [topics.BY_NAME[name] for name in names]
