"""What the options of a sweep mean: seeds, and settings that vary."""

from __future__ import annotations

import itertools
import re
import tomllib
from collections.abc import Sequence
from typing import Any

from cogmap.errors import ConfigError, UsageError
from cogmap.files.toml import parsed

MAX_SEEDS = 10_000
_SEEDS = re.compile(r"(\d+)(?:-(\d+))?")


def read_seeds(text: str) -> list[int]:
    """Read seeds and ranges of them, such as 1-5,8. Raises UsageError."""
    seeds: list[int] = []
    for part in text.split(","):
        found = _SEEDS.fullmatch(part.strip())
        if found is None:
            raise UsageError(f"--seeds {text}: write seeds and ranges of them, such as 1-5,8")
        first = int(found[1])
        last = int(found[2] or first)
        if not 0 <= last - first < MAX_SEEDS:
            raise UsageError(f"--seeds {text}: {part} is no range of up to {MAX_SEEDS} seeds")
        seeds += range(first, last + 1)
    return seeds


def every_variant(texts: Sequence[str]) -> list[dict[str, Any]]:
    """Read every combination of the values of settings such as motor.cruise_m_s=2,3. Raises
    ConfigError.
    """
    choices = []
    for text in texts:
        key, equals, values = text.partition("=")
        if not (equals and values):
            raise ConfigError(f"--vary {text}: write it as module.key=value,value")
        choices.append([(key, value) for value in _values(values)])
    return [dict(combination) for combination in itertools.product(*choices)]


def _values(text: str) -> list[Any]:
    """Read values that commas part: as TOML has them, or words, which need no quotes."""
    try:
        values: list[Any] = parsed(f"values = [{text}]")["values"]
    except tomllib.TOMLDecodeError:
        return [word.strip() for word in text.split(",")]
    return values
