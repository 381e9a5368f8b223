"""Options that several commands share."""

from __future__ import annotations

import math
from typing import Any

import click

from cogmap.services.codelets.rules import PRESETS


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

rules_option = click.option(
    "--rules",
    type=click.Choice([*PRESETS]),
    help="The rules by which the agent localizes, closes loops, corrects its map and plans: paper "
    "has those of Madl et al. (2016) as printed, cogmap ours, spiking ours with localization by "
    "spikes. Without it the settings decide, cogmap's by default.",
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
