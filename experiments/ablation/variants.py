"""The variants of the agent's rules that are compared."""

from __future__ import annotations

from collections.abc import Mapping

from cogmap.runtime.config import Sections
from cogmap.services.codelets.rules import PRESETS, RULES

Rules = Mapping[str, str]
PLANNING = "planning"
OURS = "ours"
PAPER = "paper"

# By name, the rules that are not ours. All but the last have one of our additions taken away.
VARIANTS: dict[str, Rules] = {
    OURS: {},
    "localization_paper": {"localization": "paper"},
    "localization_spiking": {"localization": "spiking"},
    "closes_by_sighting": {"closes_by": "sighting"},
    "correct_positions": {"correct": "positions"},
    "correct_eq9": {"correct": "eq9"},
    "planning_gradient": {PLANNING: "gradient"},
    PAPER: PRESETS["paper"],
}
LABELS = {
    OURS: "ours, whole",
    "localization_paper": "localization = paper",
    "localization_spiking": "localization = spiking",
    "closes_by_sighting": "closes_by = sighting",
    "correct_positions": "correct = positions",
    "correct_eq9": "correct = eq9",
    "planning_gradient": "planning = gradient",
    PAPER: "the paper's, whole",
}


def with_variant(sections: Sections, rules: Rules) -> Sections:
    """Return the configuration of every module with these rules in the place of its own."""
    changed = {name: dict(section) for name, section in sections.items()}

    for rule, value in rules.items():
        section = changed.setdefault(RULES[rule], {})
        section[rule] = value

    return changed
