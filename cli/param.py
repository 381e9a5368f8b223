"""`cogmap param`: the settings of a running system."""

from __future__ import annotations

import tomllib
from typing import Any

import click
import msgspec

from cogmap.bus.codec import decode, encode
from cogmap.bus.interface import Bus
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json
from cogmap.cli.topic.observing import observing
from cogmap.errors import MessageError, NoAnswerError, UsageError
from cogmap.files.toml import parsed
from cogmap.hints import did_you_mean
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from cogmap.runtime.program import agent_option, connect_option
from cogmap.schemas import topics
from cogmap.schemas.process import Settings, SettingsRequest
from cogmap.services import registry

ANSWER_S = 5.0
"""Time for an answer; a busy module gives it between two messages."""

_EPILOG = """\b
Examples:
  cogmap param list
  cogmap param list motor                 those of one module
  cogmap param get motor.cruise_m_s
"""


@click.group(epilog=_EPILOG)
def param() -> None:
    """Show the settings of a running system, each called MODULE.KEY.

    `cogmap config` says what each means, and which range it has.
    """


@param.command("list")
@click.argument("module", required=False)
@json_option
@connect_option
@agent_option
def list_(module: str | None, as_json: bool, connect: str, agent: str) -> None:
    """List the settings, or those of MODULE alone, with their values."""
    with observing(connect, agent, "param") as bus:
        sections = settings_of(bus, ANSWER_S)
    if module is not None:
        sections = {module: section_named(module, sections)}

    if as_json:
        print_json(sections)
        return
    for name, section in sections.items():
        for key, value in section.items():
            click.echo(f"{name}.{key} = {text(value)}")


@param.command()
@click.argument("name", metavar="MODULE.KEY")
@json_option
@connect_option
@agent_option
def get(name: str, as_json: bool, connect: str, agent: str) -> None:
    """Print the value of one setting."""
    with observing(connect, agent, "param") as bus:
        value = value_named(name, settings_of(bus, ANSWER_S))
    if as_json:
        print_json(value)
    else:
        click.echo(text(value))


@param.command("set")
@click.argument("name", metavar="MODULE.KEY")
@click.argument("value")
def set_(name: str, value: str) -> None:
    """Say how to start with another value: no setting changes while a system runs.

    What a person changes meanwhile has verbs of its own: goal, name, street, time.
    """
    sections = config.load(None, [f"{name}={value}"])
    config.check_sections(sections, registry.sections())
    for section in sections:
        config.typed(sections, section, registry.config_type(section))
    raise UsageError(
        f"settings are fixed while a system runs: start it by `cogmap run --set {name}={value}`"
    )


def settings_of(bus: Bus, timeout_s: float) -> Sections:
    """Ask the processes on `bus` for their settings, and return those of all modules. Those of a
    drive have one configuration: the first answer counts. Raises NoAnswerError.
    """
    answer = bus.query(topics.SETTINGS_REQUEST, encode(SettingsRequest()), timeout_s)
    try:
        settings = decode(topics.SETTINGS, answer.payload)
        assert isinstance(settings, Settings)
        given = parsed(settings.toml)
    except (MessageError, tomllib.TOMLDecodeError) as error:
        raise NoAnswerError(f"the answer has no settings: {error}") from None

    names = registry.sections()
    sections: Sections = {name: known for name, known in given.items() if name not in names}
    for name in names:
        typed = config.recorded(given, name, registry.config_type(name))
        sections[name] = msgspec.to_builtins(typed)
    return dict(sorted(sections.items()))


def section_named(name: str, sections: Sections) -> dict[str, Any]:
    """Return the settings of a module. Raises UsageError naming the nearest."""
    if name not in sections:
        hint = did_you_mean(name, sections, f"there are {', '.join(sections)}")
        raise UsageError(f"no module {name!r} has settings: {hint}")
    return sections[name]


def value_named(name: str, sections: Sections) -> Any:
    """Return the value of the setting `module.key`. Raises UsageError naming the nearest."""
    module, _, key = name.partition(".")
    section = section_named(module, sections)
    if key not in section:
        hint = did_you_mean(key, section, f"`cogmap param list {module}` names all")
        raise UsageError(f"{module} has no setting {key!r}: {hint}")
    return section[key]


def text(value: Any) -> str:
    """Write a value as it is given to --set, but for one that is not set."""
    if isinstance(value, str):
        return value
    return msgspec.json.encode(value).decode()
