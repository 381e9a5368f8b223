"""`cogmap view rerun`: shows a running system in Rerun's viewer, or writes it into a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from cogmap.cli.topic.observing import observing
from cogmap.cli.view.following import VIEW, follow
from cogmap.errors import UsageError
from cogmap.recording.exporting.rerun import APPLICATION, SENSES, Entities, library
from cogmap.runtime.program import agent_option, connect_option

URL = "rerun+http://127.0.0.1:9876/proxy"
"""Where Rerun's viewer listens, if nobody says otherwise."""

VIEWER = "rerun --bind 127.0.0.1"
"""Opens a viewer that no other machine reaches: without the option it listens to all."""

ANSWER_S = 5.0
"""Time for a viewer to answer."""

_EPILOG = f"""\b
Examples:
  {VIEWER} &                opens a viewer for this machine alone
  cogmap view rerun
  cogmap view rerun --url rerun+http://desk:9876/proxy
  cogmap view rerun --save drive.rrd      a file, until Ctrl-C
"""


@click.command(epilog=_EPILOG)
@click.option(
    "--save",
    "path",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write into the new file FILE; no viewer is needed.",
)
@click.option("--url", help=f"Where the viewer listens.  [default: {URL}]")
@connect_option
@agent_option
def rerun(path: Path | None, url: str | None, connect: str, agent: str) -> None:
    """Show a running system in Rerun's viewer, as `cogmap log export --rerun` writes it.

    Ctrl-C ends it; the viewer stays. Needs `pip install 'cogmap[rerun]'`. The viewer tells its
    makers how it is used, unless `rerun analytics disable` was called.
    """
    if path is not None and url is not None:
        raise UsageError("--save and --url exclude each other: choose one")

    sdk = library()
    with observing(connect, agent, VIEW) as bus:
        stream = sdk.RecordingStream(APPLICATION)
        if path is None:
            send(stream, url or URL)
        else:
            save(stream, path)
        click.echo(f"{agent} at {connect} for Rerun: {path or url or URL} (Ctrl-C ends it)")
        try:
            follow(bus, connect, SENSES, Entities(sdk, stream).take)
        finally:
            stream.disconnect()


def save(stream: Any, path: Path) -> None:
    """Lead a stream to a new file. Raises UsageError if it exists or cannot be written."""
    if path.exists():
        raise UsageError(f"{path} exists already: name a new file")
    try:
        stream.save(path)
    except RuntimeError as error:
        raise UsageError(f"{error}: name another file with --save") from None


def send(stream: Any, url: str) -> None:
    """Lead a stream to the viewer at `url`. Raises UsageError, with the remedy, if none answers."""
    try:
        stream.connect_grpc(url)
        stream.flush(timeout_sec=ANSWER_S)
    except RuntimeError as error:
        raise UsageError(
            f"no viewer of Rerun is at {url} ({error}): open one with `{VIEWER}`, name another "
            "with --url, or a file with --save"
        ) from None
