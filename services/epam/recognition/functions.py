"""Functions of buildings: knowledge that comes with what EPAM was trained on."""

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

FUNCTIONS = {label: function for function, labels in LABELS_OF.items() for label in labels}


def function_of(label: str) -> str:
    """Return the function of an object with that label; empty if it is not known, as of one that
    was learned in an encounter.
    """
    return FUNCTIONS.get(label, "")
