"""The `cogmap` command."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import click

from bus import config, runner
from bus.errors import CogmapError, UsageError
from bus.session import DEFAULT_ENDPOINT
from services import table

connect_option = click.option(
    "--connect", default=DEFAULT_ENDPOINT, show_default=True, envvar="COGMAP_CONNECT", help="The router's endpoint."
)
agent_option = click.option(
    "--agent",
    default="agent",
    show_default=True,
    envvar="COGMAP_AGENT",
    help="Whose topics, where several agents share a bus.",
)
config_option = click.option(
    "--config", "config_path", type=click.Path(path_type=Path), help="A TOML file, a section a module."
)
set_option = click.option(
    "--set", "settings", multiple=True, metavar="MODULE.KEY=VALUE", help="Override one key; repeat at will."
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--verbose", is_flag=True, help="Say more of what goes on.")
def cogmap(verbose: bool) -> None:
    """Cogmap: LIDA's cognitive cycle with spatial memory, every module a process on a message bus."""
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO, format="%(asctime)s %(message)s", datefmt="%H:%M:%S"
    )


@cogmap.command()
@click.argument("name", metavar="NAME")
@click.option("--instance", default="", help="Its own name, where several of one module run.")
@click.option("--state", type=click.Path(path_type=Path), help="A folder for what it must not lose.")
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
    built = table.build(name, config.load(config_path, settings), instance)
    runner.run_module(built, connect, agent, state, runner.Stop(tied))


@cogmap.command()
@click.option("--tied", is_flag=True, help="End when standard input ends.")
@connect_option
def router(tied: bool, connect: str) -> None:
    """Run the router that all modules meet at."""
    runner.run_router(connect, runner.Stop(tied))


def main() -> None:
    """Run the command; what the user can mend is one sentence and exit code 2."""
    try:
        cogmap(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except click.Abort:
        sys.exit(130)
    except UsageError as error:
        click.echo(f"cogmap: {error}", err=True)
        sys.exit(2)
    except CogmapError as error:
        click.echo(f"cogmap: {error}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
