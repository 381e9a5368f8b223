"""`cogmap interface`: the types of messages, and their fields."""

from __future__ import annotations

from inspect import getdoc
from typing import Any

import click
import msgspec
from msgspec import inspect

from cogmap.cli.messages.types import default_of, messages_and_parts, unit_of, words
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json, print_table
from cogmap.errors import UsageError
from cogmap.hints import did_you_mean
from cogmap.schemas import topics
from cogmap.schemas.base import Message

COLUMNS = ["field:", "type:", "unit:", "default:"]
_EPILOG = """\b
Examples:
  cogmap interface list
  cogmap interface show Percept
  cogmap interface show motor/command     what travels on a topic
"""


class Field(msgspec.Struct, frozen=True):
    """A field of a message; `default` is empty where it has to be given."""

    name: str
    type: str
    unit: str
    default: str


class Interface(msgspec.Struct, frozen=True):
    """A type of message, with the topic that carries it, or of a part, which none does."""

    name: str
    topic: str
    description: str
    fields: list[Field]


@click.group(epilog=_EPILOG)
def interface() -> None:
    """List the types of messages, and show their fields."""


@interface.command("list")
@click.option("-m", "--only-msgs", is_flag=True, help="Leave out types of parts of messages.")
@json_option
def list_(only_msgs: bool, as_json: bool) -> None:
    """List the types of messages with their topics, and those of their parts."""
    found = [described(struct) for struct in messages_and_parts().values()]
    if only_msgs:
        found = [each for each in found if each.topic]
    if as_json:
        print_json([{"name": each.name, "topic": each.topic} for each in found])
        return

    for each in found:
        click.echo(f"{each.name}  {each.topic}".rstrip())


@interface.command()
@click.argument("name")
@json_option
def show(name: str, as_json: bool) -> None:
    """Show the fields of NAME, a type of message or of a part, or the topic that carries it.

    A field's name states its unit. One without a default has to be given.
    """
    found = described(struct_named(name))
    if as_json:
        print_json(found)
        return

    carried = f", on {found.topic}" if found.topic else ""
    click.echo(f"{found.name}{carried}: {found.description}\n")
    rows = [(each.name, each.type, each.unit, each.default) for each in found.fields]
    print_table(COLUMNS, rows)


def struct_named(name: str) -> type[msgspec.Struct]:
    """Find the type of that name, or of what travels on that topic. Raises UsageError."""
    known = messages_and_parts()
    topic = topics.BY_NAME.get(name.strip("/"))
    if topic is not None:
        return topic.type
    for each, struct in known.items():
        if each.lower() == name.lower():
            return struct

    meant = did_you_mean(name, [*known, *topics.BY_NAME], "see `cogmap interface list`")
    raise UsageError(f"no type of message {name!r}: {meant}")


def described(struct: type[msgspec.Struct]) -> Interface:
    """Describe a type."""
    kind = inspect.type_info(struct)
    assert isinstance(kind, inspect.StructType)
    fields = [
        Field(each.encode_name, words(each.type), unit_of(each.name), default_of(each))
        for each in kind.fields
    ]
    if kind.tag_field is not None:
        fields.insert(0, Field(kind.tag_field, str(kind.tag), "", ""))

    topic: Any = topics.BY_TYPE.get(struct) if issubclass(struct, Message) else None
    return Interface(
        name=struct.__name__,
        topic=topic.name if topic is not None else "",
        description=getdoc(struct) or "",
        fields=fields,
    )
