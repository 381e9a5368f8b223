"""Options that several commands share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from cogmap.bus.session import DEFAULT_AGENT, DEFAULT_ENDPOINT, check_name


class FiniteRange(click.FloatRange):
    """A range of finite numbers: click's own takes nan, and inf where an end is open."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


DASHBOARD_PORT = 8470
"""Where a dashboard serves, if that is free."""

connect_option = click.option(
    "--connect",
    default=DEFAULT_ENDPOINT,
    show_default=True,
    envvar="COGMAP_CONNECT",
    help="Where the router listens.",
)


def _checked(context: click.Context, option: click.Parameter, name: str) -> str:
    """Refuse a name that cannot be part of a key. Raises UsageError."""
    check_name("--agent", name)
    return name


agent_option = click.option(
    "--agent",
    callback=_checked,
    default=DEFAULT_AGENT,
    show_default=True,
    envvar="COGMAP_AGENT",
    help="The agent whose topics are meant, if several share a bus.",
)
config_option = click.option(
    "--config",
    "config_path",
    type=click.Path(path_type=Path),
    envvar="COGMAP_CONFIG",
    help="A file of settings in TOML, as `cogmap config` prints it.",
)
set_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="MODULE.KEY=VALUE",
    help="Override one setting; may be repeated.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
wait_option = click.option(
    "--wait",
    "timeout_s",
    type=FiniteRange(0, 3600),
    default=5.0,
    show_default=True,
    metavar="SECONDS",
    help="How long to wait for the agent.",
)
