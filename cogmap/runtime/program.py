"""A module as a program of its own: its options and environment variables, and how it is run."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypedDict, TypeVar, Unpack

import click
import msgspec
import tomli_w

from cogmap.bus.session import DEFAULT_AGENT, DEFAULT_ENDPOINT, check_name
from cogmap.runtime import config, environment
from cogmap.runtime.command import run_command
from cogmap.runtime.config import Sections
from cogmap.runtime.module import Module
from cogmap.runtime.process import await_line, run_module
from cogmap.schemas import topics
from cogmap.schemas.process import Settings

C = TypeVar("C", bound=msgspec.Struct)
F = TypeVar("F", bound=Callable[..., Any])

_endpoint_option = click.option(
    "--connect",
    default=DEFAULT_ENDPOINT,
    show_default=True,
    envvar=environment.CONNECT,
    help="Where the router listens.",
)


def _use_keys(context: click.Context, option: click.Parameter, folder: Path | None) -> None:
    """Let this process, and those that it starts, use the keys in `folder`."""
    if folder is not None:
        os.environ[environment.KEYS] = str(folder.resolve())


_keys_option = click.option(
    "--keys",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    callback=_use_keys,
    expose_value=False,
    envvar=environment.KEYS,
    metavar="DIR",
    help="The folder of keys that `cogmap keys make` made; all connections are TLS then.",
)


def connect_option(command: F) -> F:
    """Give a command the options of where its router is and whose keys open it."""
    return _endpoint_option(_keys_option(command))


def _checked(context: click.Context, option: click.Parameter, name: str) -> str:
    """Refuse a name that cannot be part of a key. Raises UsageError."""
    check_name("--agent", name)
    return name


agent_option = click.option(
    "--agent",
    callback=_checked,
    default=DEFAULT_AGENT,
    show_default=True,
    envvar=environment.AGENT,
    help="The agent whose topics are meant, if several share a bus.",
)
config_option = click.option(
    "--config",
    "config_path",
    type=click.Path(path_type=Path),
    envvar=environment.CONFIG,
    help="A file of settings in TOML, as `cogmap config` prints it.",
)
set_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="MODULE.KEY=VALUE",
    help="Override one setting; may be repeated.",
)
tied_option = click.option("--tied", is_flag=True, help="End when standard input is closed.")
ends_with_option = click.option(
    "--ends-with",
    default="",
    metavar="MODULE",
    envvar=environment.ENDS_WITH,
    help="End when MODULE has left the bus, or does not come: `observer` is a drive's.",
)
_OPTIONS = (
    click.option(
        "--instance", default="", help="A name of its own, if several processes run this module."
    ),
    click.option(
        "--state",
        type=click.Path(path_type=Path),
        help="A folder in which it keeps its state over restarts.",
    ),
    click.option(
        "--memory",
        type=click.Path(dir_okay=False, path_type=Path),
        help="The database of long-term memory.",
    ),
    click.option("--held", is_flag=True, help="Connect only after a line on standard input."),
    tied_option,
    ends_with_option,
    connect_option,
    agent_option,
    config_option,
    set_option,
)


class ModuleOptions(TypedDict):
    """The values of the options of a module that is a program."""

    instance: str
    state: Path | None
    memory: Path | None
    held: bool
    tied: bool
    ends_with: str
    connect: str
    agent: str
    config_path: Path | None
    settings: tuple[str, ...]


def module_options(command: F) -> F:
    """Give a command the options of a module, which it takes as ModuleOptions."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def run_with(options: ModuleOptions, build: Callable[[Sections, str], Module]) -> None:
    """Run the module that `build` makes of the configuration and the name of an instance; whoever
    asks is told that configuration. Raises as `run_module` does, and ConfigError.
    """
    sections = config.load(options["config_path"], options["settings"])
    module = build(sections, options["instance"])
    settings = Settings(instance=module.instance, toml=tomli_w.dumps(sections))
    module.serve(topics.SETTINGS_REQUEST, topics.SETTINGS, lambda _request: settings)
    if options["held"] and not await_line():
        return

    run_module(
        module,
        options["connect"],
        options["agent"],
        options["state"],
        tied=options["tied"],
        memory=options["memory"],
        ends_with=options["ends_with"],
    )


def run_program(build: Callable[[C, str], Module], kind: type[C], section: str) -> None:
    """Run a module of your own as the program that was started: with the options of
    `cogmap module`, and the same environment variables, such as COGMAP_CONNECT.

    `build` makes it of its settings, a `kind`, and the name of its instance, empty where it has
    none of its own. The settings are those of `section` in the file of `--config`, and of
    `--set SECTION.KEY=VALUE`. What the user can mend is one sentence and exit code 2.
    """

    @click.command(help=f"Run this module; its settings are in the section [{section}].")
    @module_options
    def program(**options: Unpack[ModuleOptions]) -> None:
        run_with(options, lambda sections, name: build(config.typed(sections, section, kind), name))

    run_command(program, section)
