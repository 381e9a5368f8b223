"""The rules by which an agent localizes, closes loops, corrects its map and plans: which settings
they are, and presets of them. `paper` has those of Madl et al. (2016) as printed, `cogmap` ours,
and `spiking` ours with localization by spikes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cogmap.errors import UsageError

RULES = {
    "localization": "codelets",
    "closes_by": "codelets",
    "correct": "codelets",
    "planning": "planning",
}
"""The section of each rule's setting."""

OURS = "cogmap"
_OURS = {
    "localization": "cogmap",
    "closes_by": "agreement",
    "correct": "heading",
    "planning": "hierarchy",
}
PRESETS: dict[str, dict[str, str]] = {
    "paper": {
        "localization": "paper",
        "closes_by": "sighting",
        "correct": "eq9",
        "planning": "gradient",
    },
    "spiking": _OURS | {"localization": "spiking"},
    OURS: _OURS,
}
"""`cogmap` has the defaults of the settings."""


def settings_of(preset: str) -> list[str]:
    """Write a preset as the values of `--set`. Raises UsageError if there is none of that name."""
    if preset not in PRESETS:
        raise UsageError(f"rules {preset!r}: choose {' or '.join(PRESETS)}")

    return [f"{RULES[rule]}.{rule}={value}" for rule, value in PRESETS[preset].items()]


def with_rules(sections: Mapping[str, Mapping[str, Any]], preset: str) -> dict[str, dict[str, Any]]:
    """Return `sections` with the rules of a preset; those that are set there already stay."""
    chosen = {name: dict(section) for name, section in sections.items()}
    for rule, value in PRESETS[preset].items():
        chosen.setdefault(RULES[rule], {}).setdefault(rule, value)
    return chosen


def positions_rule(preset: str) -> str:
    """Return how a preset corrects positions alone: by reverse replay, if it has no rule of its own
    for that.
    """
    rule = PRESETS[preset]["correct"]
    return "positions" if rule == "heading" else rule


def rules_of(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return the value of each rule in `sections`, its default where it is not set."""
    return {
        rule: str(sections.get(section, {}).get(rule, PRESETS[OURS][rule]))
        for rule, section in RULES.items()
    }


def metrics_of(rules: Mapping[str, str]) -> dict[str, str]:
    """Return rules as metrics, such as `rules_localization`."""
    return {f"rules_{rule}": value for rule, value in rules.items()}


def described(rules: Mapping[str, str]) -> str:
    """Write rules in one line."""
    words = ", ".join(f"{rule} {value}" for rule, value in rules.items())
    return f"rules: {words}"
