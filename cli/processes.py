"""`cogmap module` and `cogmap router`: run until they are stopped."""

from __future__ import annotations

from typing import Unpack

import click

from cogmap.runtime import process
from cogmap.runtime.program import (
    ModuleOptions,
    agent_option,
    connect_option,
    ends_with_option,
    module_options,
    run_with,
    tied_option,
)
from cogmap.services import registry


@click.command()
@click.argument("name", metavar="NAME")
@module_options
def module(name: str, **options: Unpack[ModuleOptions]) -> None:
    """Run the module NAME as this process.

    `cogmap config` prints a section for each module that there is.
    """
    run_with(options, lambda sections, instance: registry.build(name, sections, instance))


@click.command()
@tied_option
@ends_with_option
@connect_option
@agent_option
def router(tied: bool, ends_with: str, connect: str, agent: str) -> None:
    """Run the router that all modules connect to."""
    process.run_router(connect, process.Stop(tied), agent, ends_with)
