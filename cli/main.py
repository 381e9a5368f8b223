"""The `cogmap` command."""

from __future__ import annotations

import importlib
import logging
from pathlib import Path

import click

from cli.options import agent_option, config_option, connect_option, set_option
from cogmap.runtime import config, process
from cogmap.runtime.command import run_command
from services import registry

COMMANDS = {
    "architecture": "cli.architecture:architecture",
    "config": "cli.run.command:print_config",
    "doctor": "cli.doctor.command:doctor",
    "experiment": "cli.experiment.command:experiment",
    "graph": "cli.graph:graph",
    "log": "cli.log.command:log",
    "run": "cli.run.command:run",
    "topic": "cli.topic.command:topic",
}


class _Commands(click.Group):
    """Imports a command of COMMANDS when it is asked for: a module's process has no use for the
    others.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted([*super().list_commands(ctx), *COMMANDS])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return super().get_command(ctx, cmd_name)
        path, _, name = COMMANDS[cmd_name].partition(":")
        command: click.Command = getattr(importlib.import_module(path), name)
        return command


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--verbose", is_flag=True, help="Say more of what goes on.")
def cogmap(verbose: bool) -> None:
    """Cogmap: LIDA's cognitive cycle with spatial memory, every module a process on a message bus."""
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO,
        format="%(asctime)s %(message)s",
        datefmt="%H:%M:%S",
    )


@cogmap.command()
@click.argument("name", metavar="NAME")
@click.option("--instance", default="", help="Its own name, where several of one module run.")
@click.option(
    "--state", type=click.Path(path_type=Path), help="A folder for what it must not lose."
)
@click.option("--tied", is_flag=True, help="End when standard input ends.")
@connect_option
@agent_option
@config_option
@set_option
def module(
    name: str,
    instance: str,
    state: Path | None,
    tied: bool,
    connect: str,
    agent: str,
    config_path: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Run one module as this process."""
    built = registry.build(name, config.load(config_path, settings), instance)
    process.run_module(built, connect, agent, state, process.Stop(tied))


@cogmap.command()
@click.option("--tied", is_flag=True, help="End when standard input ends.")
@connect_option
def router(tied: bool, connect: str) -> None:
    """Run the router that all modules meet at."""
    process.run_router(connect, process.Stop(tied))


def main() -> None:
    """Run the command; what the user can mend is one sentence and exit code 2."""
    run_command(cogmap, "cogmap")


if __name__ == "__main__":
    main()
