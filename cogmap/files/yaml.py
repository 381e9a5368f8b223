"""YAML that others wrote: lists and tables are not nested without end."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import yaml

MAX_DEPTH = 64
"""Readers in Python take the square of the depth: some seconds for 20 kB of brackets."""

TOO_DEEP = f"it is nested more than {MAX_DEPTH} deep"


def parsed(text: str) -> Any:
    """Return what is in `text`. Raises yaml.YAMLError for what YAML does not allow, and for what is
    nested too deep; ValueError for a date that there is not, or thousands of digits.
    """
    if is_too_deep(text):
        raise yaml.YAMLError(TOO_DEEP)
    return yaml.safe_load(text)


def is_too_deep(text: str) -> bool:
    """Decide whether lists and tables in `text` are nested more than MAX_DEPTH deep, before
    anything in it that is no YAML.
    """
    depth = 0
    with suppress(yaml.YAMLError):
        for event in yaml.parse(text, Loader=yaml.CSafeLoader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > MAX_DEPTH:
                return True
    return False
