"""Pages of the reference that follow from the code: commands, settings and messages."""

from __future__ import annotations

from collections.abc import Iterator

import click
from click.testing import CliRunner

from cogmap.cli.main import VERBS, cogmap
from cogmap.cli.messages.interface import described
from cogmap.cli.messages.types import messages_and_parts
from cogmap.cli.verbs import LazyCommand
from cogmap.schemas import topics

WIDTH = 96
ALIASES = ("bag",)


def commands() -> str:
    """Return the page of every verb of the command line, with its help."""
    parts = ["# Commands", "What `cogmap VERB --help` prints, of every verb."]
    for name in sorted(VERBS.keys() - set(ALIASES)):
        parts.append(f"## {name}")
        for command, usage in _with_verbs(cogmap.commands[name], f"cogmap {name}"):
            context = click.Context(command, info_name=usage, terminal_width=WIDTH)
            parts.append(f"```text\n{command.get_help(context)}\n```")
    return "\n\n".join(parts) + "\n"


def _with_verbs(command: click.Command, usage: str) -> Iterator[tuple[click.Command, str]]:
    """Yield `command` and all verbs below it, each with how it is called."""
    if isinstance(command, LazyCommand):
        command = command.load()
    yield command, usage

    if isinstance(command, click.Group):
        for name, verb in sorted(command.commands.items()):
            yield from _with_verbs(verb, f"{usage} {name}")


def settings() -> str:
    """Return the page of every setting."""
    printed = CliRunner().invoke(cogmap, ["config"], catch_exceptions=False).output
    about = (
        "What `cogmap config` prints: every key of every module with its meaning, unit and range, "
        "and its value in a drive around the loop. A file of these is for `--config`, and "
        "`--set motor.cruise_m_s=3` changes one."
    )
    return f"# Settings\n\n{about}\n\n```toml\n{printed}```\n"


def messages() -> str:
    """Return the page of all topics, and of the types of their messages and parts."""
    parts = [
        "# Messages",
        "The topics, and what `cogmap interface show` prints of every type. A field's name states "
        "its unit. `python -m cogmap.schemas.export DIR` writes a JSON Schema a topic.",
        _table(
            ("topic", "message", "Hz", "delivery"),
            (
                (f"`{topic.name}`", topic.type.__name__, f"{topic.rate_hz:g}", topic.delivery.value)
                for topic in topics.ALL
            ),
        ),
    ]
    for struct in messages_and_parts().values():
        found = described(struct)
        parts += [f"## {found.name}", found.description]
        if found.topic:
            parts.append(f"On `{found.topic}`.")
        if found.fields:
            rows = ((f"`{each.name}`", each.type, each.unit, each.default) for each in found.fields)
            parts.append(_table(("field", "type", "unit", "default"), rows))
    return "\n\n".join(parts) + "\n"


def _table(columns: tuple[str, ...], rows: Iterator[tuple[str, ...]]) -> str:
    rule = tuple("---" for _ in columns)
    lines = [columns, rule, *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in lines)
