"""The ids of nodes: how each is made of what the node is about."""

from __future__ import annotations

import enum
from string import ascii_lowercase

ROOT_MAP = "map:0"
COARSE_MAP = "map:coarse:"
SELF_ID = "self"
CORRECTION_ID = "correction"
PLAN_ID = "plan"
RECOLLECTION_ID = "recollection"
RELATION = "relation:"


class Side(enum.StrEnum):
    """On which side of an object another stands, as seen by the agent."""

    LEFT_OF = "left_of"
    RIGHT_OF = "right_of"


def object_id(label: str) -> str:
    """Return the id of the individual object of that label."""
    return f"object:{label}"


def name_id(name: str) -> str:
    """Return the id of the PAM node of all that has a name."""
    return f"name:{name}"


def category_id(function: str) -> str:
    """Return the id of the category of all objects with a function, such as shop."""
    return f"category:{function}"


def individual_label(cycle: int, number: int, origin: str = "") -> str:
    """Return the label of object `number`, from 0, that a cycle adds to the map: the cycle's number
    and a letter, as no other object has. What adds some to the map that perception did not has an
    `origin`, a word that its labels begin with.
    """
    letters = ""
    while True:
        number, last = divmod(number, len(ascii_lowercase))
        letters = ascii_lowercase[last] + letters
        if number == 0:
            return f"{origin}{cycle}{letters}"
        number -= 1


def goal_id(name: str) -> str:
    """Return the id of the goal that a person calls `name`."""
    return f"goal:{name}"


def feeling_id(name: str) -> str:
    """Return the id of the feeling `name`, such as danger."""
    return f"feeling:{name}"


def relation_id(side: Side, name: str) -> str:
    """Return the id of the relation of standing next to what has a name, on that side."""
    return f"{RELATION}{side}:{name}"


def is_relation(identifier: str) -> bool:
    """Return true if an id is that of a relation."""
    return identifier.startswith(RELATION)


def percept_id(label: str) -> str:
    """Return the id of the percept of the object of that label."""
    return f"percept:{label}"


def need_id(name: str) -> str:
    """Return the id of the need of `name`, such as energy."""
    return f"need:{name}"


def episode_id(number: int) -> str:
    """Return the id of the episode that long-term memory has under `number`."""
    return f"episode:{number}"


def attention_id(codelet: str) -> str:
    """Return the id of what attention codelet `codelet` keeps."""
    return f"attention:{codelet}"


def map_id(number: int) -> str:
    """Return the id of a sub-map. Sub-maps are numbered from 1; the root map is number 0."""
    return f"map:{number}"


def coarse_map_id(level: int) -> str:
    """Return the id of a map with the root map's places on a coarser grid, coarser with each level
    from 1 on.
    """
    return f"{COARSE_MAP}{level}"


def is_coarse_map(identifier: str) -> bool:
    """Return true if a map's id is that of a coarse map."""
    return identifier.startswith(COARSE_MAP)


def map_number(identifier: str) -> int | None:
    """Return the number of a map's id; None for a coarse map's, and any other id."""
    number = identifier.removeprefix("map:")
    if number == identifier or not number.isdecimal():
        return None

    return int(number)


def segment_id(number: int) -> str:
    """Return the id of a path segment."""
    return f"path:{number}"


def observations_id(number: int, label: str) -> str:
    """Return the id of the observations of landmark `label` along path segment `number`."""
    return f"observations:{number}:{label}"


def place_id(i: int, j: int, map_id: str = ROOT_MAP) -> str:
    """Return the id of the place node of grid cell (i, j)."""
    return f"place:{map_id}:{i}:{j}"


def place_cell(identifier: str) -> tuple[str, int, int] | None:
    """Return the map and the grid cell of a place node's id; None for any other node's."""
    if not identifier.startswith("place:"):
        return None

    try:
        map_id, i, j = identifier.removeprefix("place:").rsplit(":", 2)
        return map_id, int(i), int(j)
    except ValueError:
        return None


def nearest_place(x_m: float, y_m: float, cell_m: float, map_id: str = ROOT_MAP) -> str:
    """Return the id of the place node nearest to a position, in a grid of `cell_m`."""
    i = round(x_m / cell_m)
    j = round(y_m / cell_m)
    return place_id(i, j, map_id)
