"""`cogmap keys`: who may connect to a site's router, and what each may do there."""

from __future__ import annotations

import sys
from datetime import datetime, timedelta
from pathlib import Path

import click

from cogmap.bus.access import site
from cogmap.bus.access.certificates import now_utc
from cogmap.bus.access.keys import AUTHORITY, ROUTER_CONFIG_NAME
from cogmap.bus.access.site import DAYS, Holder
from cogmap.bus.access.subjects import ROUTER
from cogmap.cli.options import json_option
from cogmap.cli.printing import print_json

_EPILOG = """\b
Examples:
  cogmap keys make keys                     a site on this machine
  cogmap keys make keys --host robot.local  its router listens there, too
  cogmap run --keys keys --explore 45
  cogmap goal bakery --keys keys            or COGMAP_KEYS=keys for all commands
  cogmap keys show keys                     until when they hold

docs/security.md says what they protect, docs/operations.md how they are renewed.
"""

folder_argument = click.argument(
    "folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path)
)


@click.group(epilog=_EPILOG)
def keys() -> None:
    """Make the keys of a site: an authority, and a certificate for each module and role."""


@keys.command()
@folder_argument
@click.option(
    "--host",
    "hosts",
    multiple=True,
    metavar="HOST",
    help="A name or an address by which others reach the router; may be repeated.",
)
@click.option(
    "--days",
    type=click.IntRange(1, 3650),
    default=DAYS,
    show_default=True,
    help="How long new certificates hold.",
)
@click.option(
    "--modules",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="A file with rows for modules of yours: [NAME], publishes = [...], subscribes = [...].",
)
@click.option("--renew", is_flag=True, help="Renew all, not only what expires within 30 days.")
@json_option
def make(
    folder: Path,
    hosts: tuple[str, ...],
    days: int,
    modules: Path | None,
    renew: bool,
    as_json: bool,
) -> None:
    """Make the keys that DIR lacks, and renew those that expire within 30 days.

    Everybody gets a folder in DIR, and needs no other. The authority stays: keep DIR/authority
    apart, since whoever has its key can make keys. Also writes the rules of the router, for
    `zenohd --config DIR/router/router.json5`.
    """
    lasts = timedelta(days=days)
    new = site.make(folder, now_utc(), lasts, hosts=hosts, renews_all=renew, modules=modules)
    if as_json:
        print_json(new)
        return

    made = f"new keys of {', '.join(new)}" if new else "all keys hold for more than 30 days"
    click.echo(f"{made}; the router's rules are in {folder / ROUTER / ROUTER_CONFIG_NAME}")


@keys.command()
@folder_argument
@json_option
def show(folder: Path, as_json: bool) -> None:
    """Show whose keys DIR has, and until when they hold.

    Ends with 1 if one has expired, or expires within 30 days.
    """
    now = now_utc()
    holders = site.holders(folder)
    if as_json:
        print_json([_facts(each, now) for each in holders])
    else:
        width = max(len(each.name) for each in holders)
        for each in holders:
            problem = each.problem(now)
            text = f"{each.name:<{width}}  {each.until.date()}"
            click.echo(f"{text}  {problem}" if problem else text)

    wrong = [each for each in holders if each.problem(now)]
    if wrong:
        click.echo(_remedy(folder, wrong, now), err=True)
        sys.exit(1)


def _facts(holder: Holder, now: datetime) -> dict[str, object]:
    return {
        "name": holder.name,
        "until": holder.until.isoformat(),
        "problem": holder.problem(now),
    }


def _remedy(folder: Path, wrong: list[Holder], now: datetime) -> str:
    """Say in one sentence which keys do not hold, and how that is mended."""
    names = ", ".join(f"{each.name} ({each.problem(now)})" for each in wrong)
    if any(each.name == AUTHORITY for each in wrong):
        return f"{names}: make a new site with `cogmap keys make` in another folder"
    return f"{names}: renew with `cogmap keys make {folder}`, and start the processes again"
