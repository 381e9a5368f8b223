"""`cogmap architecture`: the parts of docs/architecture.md that follow from the topic table and the
modules.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import product
from pathlib import Path

import click

from cogmap.errors import CogmapError, UsageError
from cogmap.runtime.module import Module
from schemas import topics
from schemas.topics import Delivery, Topic
from services import registry

PAGE = Path("docs/architecture.md")
OBSERVERS = "observers"
_ARROWS = {Delivery.NEVER_DROP: "==>", Delivery.LATEST_WINS: "-->", Delivery.ON_REQUEST: "-.->"}
_WITHOUT_SCREEN = {"sim": {"egl": False}}


@click.command()
@click.option(
    "--check", is_flag=True, help="Write nothing; fail where the page is not what the code says."
)
@click.argument("page", type=click.Path(path_type=Path), default=PAGE)
def architecture(check: bool, page: Path) -> None:
    """Write the diagram and the tables of docs/architecture.md, from the topic table and the
    modules.
    """
    try:
        before = page.read_text()
    except OSError as error:
        raise UsageError(
            f"cannot read {page}: {error.strerror}; call this in the sources, or name the page"
        ) from None
    after = renewed(before)
    if not check:
        page.write_text(after)
    elif before != after:
        raise CogmapError(f"{page} is not what the code says: `cogmap architecture` writes it anew")


def renewed(text: str) -> str:
    """`text` with each generated part, which lies between two comments, as it is now. Raises
    UsageError.
    """
    modules = [registry.build(name, _WITHOUT_SCREEN) for name in registry.MODULES]
    for name, part in _PARTS.items():
        place = re.search(
            f"<!-- {name}: generated.*?-->\n(.*?)<!-- end of {name} -->", text, re.DOTALL
        )
        if place is None:
            raise UsageError(
                f"the page has no place for its {name}: <!-- {name}: generated --> <!-- end of {name} -->"
            )
        text = text[: place.start(1)] + part(modules) + text[place.end(1) :]
    return text


def diagram(modules: list[Module]) -> str:
    """Modules as boxes, topics as arrows, in Mermaid's language. What no module takes in goes to
    the observers.
    """
    arrows: dict[tuple[str, str, Delivery], list[str]] = {}
    for topic in topics.ALL:
        senders, receivers = _ends(topic, modules)
        for sender, receiver in product(senders, receivers):
            if receiver != sender:
                arrows.setdefault((sender, receiver, topic.delivery), []).append(topic.name)
    lines = [
        "```mermaid",
        "flowchart TD",
        *(f'    {module.name}["{module.name}"]' for module in modules),
    ]
    lines.append(f'    {OBSERVERS}(["{OBSERVERS}"])')
    for (sender, receiver, delivery), names in arrows.items():
        lines.append(f'    {sender} {_ARROWS[delivery]}|"{"<br/>".join(names)}"| {receiver}')
    return "\n".join([*lines, "```", ""])


def topic_table(modules: list[Module]) -> str:
    """The table of topics, with who says each and who takes it in."""
    lines = [
        "| topic | message | rate | delivery | about | from | to |",
        "|---|---|---|---|---|---|---|",
    ]
    for topic in topics.ALL:
        rate = f"{topic.rate_hz:g} Hz" if topic.rate_hz else "as it happens"
        senders, receivers = _ends(topic, modules)
        ends = (", ".join(senders) or "every process", ", ".join(receivers))
        facts = (
            f"`{topic.name}`",
            topic.type.__name__,
            rate,
            topic.delivery.value,
            topic.about.value,
            *ends,
        )
        lines.append(f"| {' | '.join(facts)} |")
    return "\n".join([*lines, ""])


def _ends(topic: Topic, modules: list[Module]) -> tuple[list[str], list[str]]:
    """Who says `topic`, and who takes it in: modules by name, else the observers."""
    if topic.delivery is Delivery.ON_REQUEST:
        asked = [module.name for module in modules if topic in module.served]
        replying = [
            module.name
            for module in modules
            if topic in [reply for reply, _ in module.served.values()]
        ]
        return replying or [OBSERVERS], asked or [OBSERVERS]
    takers = [module.name for module in modules if topic in module.handlers]
    return [module.name for module in modules if topic in module.emits], takers or [OBSERVERS]


_PARTS: dict[str, Callable[[list[Module]], str]] = {"diagram": diagram, "topics": topic_table}
