"""What kinds of buildings are used for: knowledge that comes with what EPAM was trained on."""

from __future__ import annotations

LABELS_OF = {
    "shop": (
        "bakery",
        "bookshop",
        "cafe",
        "florist",
        "greengrocer",
        "pharmacy",
        "tailor",
        "toy_shop",
    ),
    "home": ("farmhouse", "hotel"),
    "school": ("cinema", "library", "museum", "school", "theatre"),
    "office": ("bank", "clinic", "police_station", "post_office", "town_hall"),
    "works": ("boathouse", "brewery", "fire_station", "workshop"),
}
"""The labels of EPAM's own objects, by function."""

_FUNCTIONS = {label: function for function, labels in LABELS_OF.items() for label in labels}


def function_of(label: str) -> str:
    """What an object with that label is used for; empty where it is not known, as of one that was
    learned in an encounter.
    """
    return _FUNCTIONS.get(label, "")
