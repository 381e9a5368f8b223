"""Configuration: one TOML file and `--set module.key=value`, typed per module."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from cogmap.errors import ConfigError
from cogmap.files.packed import read_text
from cogmap.files.toml import parsed
from cogmap.hints import did_you_mean

C = TypeVar("C", bound=msgspec.Struct)
Sections = dict[str, dict[str, Any]]


def load(path: Path | None, settings: Iterable[str] = ()) -> Sections:
    """Return the sections of the file at `path`, overridden by `settings` such as
    `action.speed_m_s=3`.

    Raises ConfigError that names the file or the setting that cannot be read.
    """
    sections: Sections = {}
    if path is not None:
        try:
            sections = parsed(read_text(path))
        except FileNotFoundError:
            raise ConfigError(
                f"no configuration file {path}: name one that exists, or leave --config out"
            ) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
            raise ConfigError(f"cannot read {path} as TOML: {error}") from None

    for setting in settings:
        key, equals, value = setting.partition("=")
        section, dot, name = key.partition(".")
        if not (equals and dot and name):
            raise ConfigError(f"--set {setting}: write it as module.key=value")

        keys = _keys_of(section, sections.setdefault(section, {}))
        try:
            keys[name] = parsed(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            # A word needs no quotes.
            keys[name] = value
    return sections


def check_sections(sections: Mapping[str, Any], known: Iterable[str]) -> None:
    """Raise ConfigError naming the first section that no module has."""
    names = sorted(known)
    for name, section in sections.items():
        if name not in names:
            raise ConfigError(f"unknown section [{name}]{_nearest(name, names)}")
        _keys_of(name, section)


def _keys_of(name: str, section: Any) -> dict[str, Any]:
    if not isinstance(section, dict):
        raise ConfigError(f"{name} must be a section [{name}] with keys in it")
    return section


def typed(sections: Sections, name: str, kind: type[C]) -> C:
    """Convert section `name` to a `kind`, its defaults filled in.

    Raises ConfigError that names the key or the value, also if a number is not finite.
    """
    section = sections.get(name, {})
    fields = list(kind.__struct_encode_fields__)
    for key, value in section.items():
        if key not in fields:
            raise ConfigError(f"unknown key {key!r} in [{name}]{_nearest(key, fields)}")
        _check_finite(f"{name}.{key}", value)

    try:
        return msgspec.convert(section, kind)
    except msgspec.ValidationError as error:
        raise ConfigError(f"[{name}] {error}".replace("`$.", f"`{name}.")) from None


def recorded(sections: Sections, name: str, kind: type[C]) -> C:
    """Convert section `name` of a log to a `kind`, without the keys that another version had.
    Raises ConfigError as `typed` does.
    """
    fields = set(kind.__struct_encode_fields__)
    section = sections.get(name, {})
    return typed({name: {key: section[key] for key in section.keys() & fields}}, name, kind)


def _check_finite(path: str, value: Any) -> None:
    """Raise ConfigError if `value`, or a value in it, is NaN or infinite."""
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"{path} is {value}: write a finite number")
    if isinstance(value, list):
        for index, item in enumerate(value):
            _check_finite(f"{path}[{index}]", item)
    if isinstance(value, dict):
        for key, item in value.items():
            _check_finite(f"{path}.{key}", item)


def _nearest(word: str, words: list[str]) -> str:
    """Return the end of a sentence about an unknown `word`: what was meant, or what there is."""
    hint = did_you_mean(word, words, f"it has {', '.join(words) or 'none'}")
    return f": {hint}"
