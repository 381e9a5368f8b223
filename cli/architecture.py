"""`cogmap architecture`: the generated parts of docs/architecture.md."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import product
from pathlib import Path

import click

from cogmap.errors import CogmapError, UsageError
from cogmap.runtime.codelet import Written
from cogmap.runtime.module import Module
from cogmap.schemas import topics
from cogmap.schemas.topics import Delivery, Topic
from cogmap.services import registry
from cogmap.services.codelets.table import own_codelets

PAGE = Path("docs/architecture.md")
OBSERVERS = "observers"
EVERY = "every process"
_ARROWS = {Delivery.NEVER_DROP: "==>", Delivery.LATEST_WINS: "-->", Delivery.ON_REQUEST: "-.->"}
_WITHOUT_SCREEN = {"sim": {"egl": False}}


@click.command()
@click.option("--check", is_flag=True, help="Write nothing; fail where the page is out of date.")
@click.argument("page", type=click.Path(path_type=Path), default=PAGE)
def architecture(check: bool, page: Path) -> None:
    """Write the generated parts of docs/architecture.md.

    They are the diagram, the table of topics and that of codelets, from the tables and the modules.
    """
    try:
        before = page.read_text()
    except OSError as error:
        raise UsageError(
            f"cannot read {page}: {error.strerror}; run this in the sources, or name the page"
        ) from None

    after = renewed(before)
    if not check:
        page.write_text(after)
    elif before != after:
        raise CogmapError(f"{page} is out of date: `cogmap architecture` writes it anew")


def renewed(text: str) -> str:
    """Return `text` with each generated part, between its two comments, brought up to date.

    Raises UsageError if a part has no place.
    """
    modules = [registry.build(name, _WITHOUT_SCREEN) for name in registry.MODULES]
    for name, generate in _PARTS.items():
        begin = f"<!-- {name}: generated"
        end = f"<!-- end of {name} -->"
        place = re.search(f"{begin}.*?-->\n(.*?){end}", text, re.DOTALL)
        if place is None:
            raise UsageError(f"the page has no place for its {name}: {begin} --> {end}")
        text = text[: place.start(1)] + generate(modules) + text[place.end(1) :]
    return text


def diagram(modules: list[Module]) -> str:
    """Draw modules as boxes and topics as arrows, in Mermaid.

    A topic that no module subscribes to leads to the observers.
    """
    lines = ["```mermaid", "flowchart TD"]
    lines += [f'    {module.name}["{module.name}"]' for module in modules]
    lines.append(f'    {OBSERVERS}(["{OBSERVERS}"])')

    # One arrow for all topics of one delivery between the same two ends.
    arrows: dict[tuple[str, str, Delivery], list[str]] = {}
    for topic in topics.ALL:
        senders, receivers = ends(topic, modules)
        for sender, receiver in product(senders, receivers):
            if receiver != sender:
                arrows.setdefault((sender, receiver, topic.delivery), []).append(topic.name)
    for (sender, receiver, delivery), names in arrows.items():
        label = "<br/>".join(names)
        lines.append(f'    {sender} {_ARROWS[delivery]}|"{label}"| {receiver}')

    lines += ["```", ""]
    return "\n".join(lines)


def topic_table(modules: list[Module]) -> str:
    """Write the table of topics, with their publishers and subscribers."""
    lines = [
        "| topic | message | rate | delivery | scope | from | to |",
        "|---|---|---|---|---|---|---|",
    ]
    for topic in topics.ALL:
        senders, receivers = ends(topic, modules)
        facts = [
            f"`{topic.name}`",
            topic.type.__name__,
            f"{topic.rate_hz:g} Hz" if topic.rate_hz else "as it happens",
            topic.delivery.value,
            topic.scope.value,
            ", ".join(senders) or EVERY,
            ", ".join(receivers) or EVERY,
        ]
        lines.append(f"| {' | '.join(facts)} |")
    return "\n".join([*lines, ""])


def codelet_table(modules: list[Module]) -> str:
    """Write the table of codelets: when they run, what they read, and what they may write."""
    lines = ["| codelet | phase | reads | writes |", "|---|---|---|---|"]
    for codelet in own_codelets():
        reads = _kinds(codelet.reads)
        writes = _kinds(codelet.writes)
        lines.append(f"| `{codelet.name}` | {codelet.phase} | {reads} | {writes} |")
    return "\n".join([*lines, ""])


def _kinds(written: frozenset[Written]) -> str:
    """List the kinds of nodes, then those of links and place columns, by name."""
    nodes = sorted(kind.__name__ for kind in written if isinstance(kind, type))
    others = sorted(f"`{kind}`" for kind in written if not isinstance(kind, type))
    return ", ".join(nodes + others) or "nothing"


def ends(topic: Topic, modules: list[Module]) -> tuple[list[str], list[str]]:
    """Find who sends `topic` and who receives it: modules by name, else the observers; none where
    it is every process.
    """
    if topic is topics.SETTINGS_REQUEST:
        return [OBSERVERS], []
    if topic is topics.SETTINGS:
        return [], [OBSERVERS]
    if topic.delivery is not Delivery.ON_REQUEST:
        senders = [module.name for module in modules if topic in module.emits]
        receivers = [module.name for module in modules if topic in module.handlers]
        return senders, receivers or [OBSERVERS]

    asked = [module.name for module in modules if topic in module.served]
    replying = [
        module.name for module in modules if topic in [reply for reply, _ in module.served.values()]
    ]
    return replying or [OBSERVERS], asked or [OBSERVERS]


_PARTS: dict[str, Callable[[list[Module]], str]] = {
    "diagram": diagram,
    "topics": topic_table,
    "codelets": codelet_table,
}
