"""`cogmap module` and `cogmap router`: run until they are stopped."""

from __future__ import annotations

from pathlib import Path

import click

from cogmap.cli.options import agent_option, config_option, connect_option, set_option
from cogmap.runtime import config, process
from cogmap.services import registry

tied_option = click.option("--tied", is_flag=True, help="End when standard input is closed.")


@click.command()
@click.argument("name", metavar="NAME")
@click.option(
    "--instance", default="", help="A name of its own, if several processes run this module."
)
@click.option(
    "--state",
    type=click.Path(path_type=Path),
    help="A folder in which it keeps its state over restarts.",
)
@click.option(
    "--memory",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The database of long-term memory.",
)
@click.option("--held", is_flag=True, help="Connect only after a line on standard input.")
@tied_option
@connect_option
@agent_option
@config_option
@set_option
def module(
    name: str,
    instance: str,
    state: Path | None,
    memory: Path | None,
    held: bool,
    tied: bool,
    connect: str,
    agent: str,
    config_path: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Run the module NAME as this process.

    `cogmap config` prints a section for each module that there is.
    """
    sections = config.load(config_path, settings)
    built = registry.build(name, sections, instance)
    if held and not process.await_line():
        return
    process.run_module(built, connect, agent, state, tied=tied, memory=memory)


@click.command()
@tied_option
@connect_option
def router(tied: bool, connect: str) -> None:
    """Run the router that all modules connect to."""
    process.run_router(connect, process.Stop(tied))
