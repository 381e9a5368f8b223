"""`cogmap dashboard`: the mind in a browser, as it runs or from its log."""

from __future__ import annotations

import asyncio
import errno
import webbrowser
from collections.abc import Callable
from pathlib import Path

import click
from aiohttp import web

from cogmap.bus.access.subjects import ACTS_OR_READS
from cogmap.cli.dashboard.live import Live
from cogmap.cli.dashboard.playback import Playback
from cogmap.cli.dashboard.server import Dashboard
from cogmap.cli.dashboard.source import Source
from cogmap.cli.options import DASHBOARD_PORT
from cogmap.errors import PortInUseError
from cogmap.runtime import environment
from cogmap.runtime.company import company_at
from cogmap.runtime.process import Stop, give_way
from cogmap.runtime.program import (
    agent_option,
    connect_option,
    ends_with_option,
    tied_option,
)

LOOK_S = 0.1


@click.command()
@click.argument("log", required=False, type=click.Path(path_type=Path))
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="The address to serve at. Whoever reaches it can watch, and give the agent goals.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=DASHBOARD_PORT,
    show_default=True,
    envvar="COGMAP_DASHBOARD_PORT",
    help="The port to serve at; 0 for one that is free.",
)
@click.option("--open", "opens", is_flag=True, help="Open it in a browser.")
@tied_option
@ends_with_option
@connect_option
@agent_option
def dashboard(
    log: Path | None,
    host: str,
    port: int,
    opens: bool,
    tied: bool,
    ends_with: str,
    connect: str,
    agent: str,
) -> None:
    """Show the mind in a browser: of a running system, or of LOG, a log or a run's folder.

    What the agent sees, its map, what competes and becomes conscious, what it does and why, how
    fast it is, and every message. Of a running system a click on the map is a goal, keys drive the
    robot where nothing else does, and workers are added and killed; a log has a slider of time. It
    asks no other host for anything. Ctrl-C ends it.

    \b
    cogmap dashboard                  the system that runs on this machine
    cogmap dashboard runs/latest      the last run
    cogmap dashboard --connect tcp/robot:7447 --open
    """
    if log is None:
        give_way()
    source: Source = Live(connect, agent) if log is None else Playback(log)
    stop = Stop(tied)
    try:
        company = "" if log is not None else ends_with
        keys = environment.keys(*ACTS_OR_READS) if company else None
        with company_at(connect, agent, company, keys) as is_alone:
            asyncio.run(serve(source, host, port, opens, lambda: stop.asked or is_alone()))
    finally:
        source.close()


async def serve(
    source: Source, host: str, port: int, opens: bool, is_over: Callable[[], bool]
) -> None:
    """Serve the dashboard until it `is_over`. Raises PortInUseError if that address is taken."""
    runner = web.AppRunner(Dashboard(source, host).application(), access_log=None)
    await runner.setup()
    site = web.TCPSite(runner, host, port)
    try:
        await site.start()
    except OSError as error:
        await runner.cleanup()
        reason = "something listens there" if error.errno == errno.EADDRINUSE else error.strerror
        raise PortInUseError(
            f"cannot serve at {host}:{port} ({reason}): choose another with --port or --host"
        ) from None

    served = runner.addresses[0][1]
    address = f"http://{host}:{served}"
    click.echo(f"dashboard of {source.label}: {address} (Ctrl-C ends it)")
    if opens:
        webbrowser.open(address)
    try:
        while not is_over():
            await asyncio.sleep(LOOK_S)
    finally:
        await runner.cleanup()
