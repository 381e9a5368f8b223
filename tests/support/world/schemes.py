"""Schemes written to files, and situations for them to match."""

from __future__ import annotations

from pathlib import Path

from cogmap.schemas.nodes import GraphNode, Node
from cogmap.services.procedural.loading import load
from cogmap.services.procedural.patterns import Active
from cogmap.services.procedural.schemes import Scheme

HEADER = 'generic_kinds = ["sign", "door"]\n'
FOLLOW = """
[[scheme]]
name = "follow"
action = "follow_plan"
context = [{ kind = "plan", state = "ready" }]
adding = [{ kind = "sign", colour = "green", salience = 0.2 }]
within_s = 2.0
"""


def written(folder: Path, text: str) -> Path:
    """A file of schemes."""
    path = folder / "schemes.toml"
    path.write_text(text)
    return path


def scheme_of(folder: Path, text: str) -> Scheme:
    """The only scheme of a file, which may name signs and doors."""
    (scheme,) = load(written(folder, HEADER + text))
    return scheme


def sign(name: str = "a", activation: float = 1.0, **attributes: str | float) -> Node:
    """A node of a kind that is not known here."""
    return Node(id=f"sign:{name}", kind="sign", activation=activation, attributes=attributes)


def active(*nodes: GraphNode) -> tuple[Active, ...]:
    """Nodes as a situation has them."""
    return tuple(Active(node, min(1.0, node.activation + node.base_level)) for node in nodes)
