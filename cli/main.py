"""The `cogmap` command."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import click

from cogmap.runtime.command import run_command
from cogmap.version import VERSION

Loader = Callable[[], click.Command]


def _architecture() -> click.Command:
    """Write the generated parts of docs/architecture.md."""
    from cogmap.cli.architecture import architecture

    return architecture


def _config() -> click.Command:
    """Print every setting of every module, as TOML."""
    from cogmap.cli.config import print_config

    return print_config


def _doctor() -> click.Command:
    """Report what is wrong, and what to do about it."""
    from cogmap.cli.doctor.command import doctor

    return doctor


def _experiment() -> click.Command:
    """Run the paper's experiments."""
    from cogmap.cli.experiment.command import experiment

    return experiment


def _explain() -> click.Command:
    """Explain a moment of a recorded drive."""
    from cogmap.cli.explain.command import explain

    return explain


def _goal() -> click.Command:
    """Send the agent somewhere, and print its plan."""
    from cogmap.cli.goal import goal

    return goal


def _graph() -> click.Command:
    """Show which process publishes and subscribes what."""
    from cogmap.cli.graph import graph

    return graph


def _log() -> click.Command:
    """Record, inspect, draw, replay and compare logs."""
    from cogmap.cli.log.command import log

    return log


def _memory() -> click.Command:
    """Look into long-term memory; check, export, import it."""
    from cogmap.cli.memory.command import memory

    return memory


def _module() -> click.Command:
    """Run one module as this process."""
    from cogmap.cli.processes import module

    return module


def _new() -> click.Command:
    """Write a first version of a codelet or a module."""
    from cogmap.cli.new.command import new

    return new


def _router() -> click.Command:
    """Run the router that all modules connect to."""
    from cogmap.cli.processes import router

    return router


def _run() -> click.Command:
    """Drive the robot around a simulated town."""
    from cogmap.cli.run.command import run

    return run


def _schemes() -> click.Command:
    """Write the guidance schemes that a drive has taught."""
    from cogmap.cli.schemes import schemes

    return schemes


def _street() -> click.Command:
    """Close streets of the simulated town, and open them."""
    from cogmap.cli.street import street

    return street


def _topic() -> click.Command:
    """Watch topics of a running system, or publish on them."""
    from cogmap.cli.topic.command import topic

    return topic


def _train() -> click.Command:
    """Train the networks of perception."""
    from cogmap.training.command import train

    return train


COMMANDS: dict[str, Loader] = {
    "architecture": _architecture,
    "config": _config,
    "doctor": _doctor,
    "experiment": _experiment,
    "explain": _explain,
    "goal": _goal,
    "graph": _graph,
    "log": _log,
    "memory": _memory,
    "module": _module,
    "new": _new,
    "router": _router,
    "run": _run,
    "schemes": _schemes,
    "street": _street,
    "topic": _topic,
    "train": _train,
}


class LazyCommand(click.Command):
    """A command that is imported when it is called: help and modules need none of the others."""

    def __init__(self, name: str, load: Loader) -> None:
        super().__init__(name, help=load.__doc__)
        self._load = load

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        return self._load().make_context(info_name, args, parent, **extra)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, message="cogmap %(version)s")
@click.option("--verbose", is_flag=True, help="Log more.")
def cogmap(verbose: bool) -> None:
    """LIDA's cognitive cycle with spatial memory, every module a process on a message bus."""
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO,
        format="%(asctime)s %(message)s",
        datefmt="%H:%M:%S",
    )


for _name, _load in COMMANDS.items():
    cogmap.add_command(LazyCommand(_name, _load))


def main() -> None:
    """Run the command; what the user can mend is one sentence and exit code 2."""
    run_command(cogmap, "cogmap")


if __name__ == "__main__":
    main()
