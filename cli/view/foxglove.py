"""`cogmap view foxglove`: serves a running system to Foxglove."""

from __future__ import annotations

from typing import Any

import click

from cogmap.cli.topic.observing import observing
from cogmap.cli.view.following import VIEW, follow
from cogmap.errors import PortInUseError
from cogmap.recording.exporting.foxglove import SENSES, Channels, library
from cogmap.runtime.program import agent_option, connect_option

PORT = 8765
"""Where Foxglove looks for a server, if nobody says otherwise."""

BACKLOG = 256
"""Messages that wait for a viewer: five seconds of them, depth and all. The oldest give way."""

_EPILOG = """\b
Examples:
  cogmap view foxglove                    then, in Foxglove: Open connection, Foxglove WebSocket
  cogmap view foxglove --port 8766
  cogmap view foxglove --connect tcp/robot:7447
"""


@click.command(epilog=_EPILOG)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="The address to serve at. Whoever reaches it can watch.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=PORT,
    show_default=True,
    help="The port to serve at; 0 for one that is free.",
)
@connect_option
@agent_option
def foxglove(host: str, port: int, connect: str, agent: str) -> None:
    """Serve a running system to Foxglove, as `cogmap log export --foxglove` writes it.

    Any number of viewers may watch. Ctrl-C ends it. Needs `pip install 'cogmap[foxglove]'`.
    """
    sdk = library()
    context = sdk.Context()
    channels = Channels(sdk, context)
    with observing(connect, agent, VIEW) as bus:
        server = serve(sdk, context, agent, host, port)
        try:
            address = f"ws://{host}:{server.port}"
            click.echo(f"{agent} at {connect} for Foxglove: {address} (Ctrl-C ends it)")
            click.echo(f"in a browser: {server.app_url()}")
            follow(bus, connect, SENSES, channels.take)
        finally:
            server.stop()


def serve(foxglove: Any, context: Any, name: str, host: str, port: int) -> Any:
    """Start a server, called `name`, of what is sent to channels in `context`. Raises
    PortInUseError if that address is taken.
    """
    try:
        return foxglove.start_server(
            name=name, host=host, port=port, context=context, message_backlog_size=BACKLOG
        )
    except RuntimeError as error:
        raise PortInUseError(
            f"cannot serve at {host}:{port} ({error}): choose another with --port or --host"
        ) from None
