"""Configuration: one TOML file and `--set module.key=value`, typed per module."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from cogmap.errors import ConfigError

C = TypeVar("C", bound=msgspec.Struct)
Sections = dict[str, dict[str, Any]]


def _parse(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def load(path: Path | None, settings: Iterable[str] = ()) -> Sections:
    """The sections of the file at `path`, overridden by `settings` such as `action.speed_m_s=3`.

    Raises ConfigError naming the file or the setting that cannot be read.
    """
    sections: Sections = {}
    if path is not None:
        try:
            sections = tomllib.loads(path.read_text())
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
        _keys_of(section, sections.setdefault(section, {}))[name] = _parse(value)
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
    """Section `name` as a `kind`, its defaults filled in. Raises ConfigError naming the key or the
    value.
    """
    section = sections.get(name, {})
    fields = [field.encode_name for field in msgspec.structs.fields(kind)]
    for key in section:
        if key not in fields:
            raise ConfigError(f"unknown key {key!r} in [{name}]{_nearest(key, fields)}")
    try:
        return msgspec.convert(section, kind)
    except msgspec.ValidationError as error:
        raise ConfigError(f"[{name}] {error}".replace("`$.", f"`{name}.")) from None


def _nearest(word: str, words: list[str]) -> str:
    close = difflib.get_close_matches(word, words, 1)
    return f": did you mean {close[0]!r}?" if close else f": it has {', '.join(words) or 'none'}"
