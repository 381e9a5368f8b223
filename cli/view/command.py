"""`cogmap view`: a running system in the viewers of other projects."""

from __future__ import annotations

import click

from cogmap.cli.verbs import add_verbs

VERBS = {
    "foxglove": ("cogmap.cli.view.foxglove:foxglove", "Serve a running system to Foxglove."),
    "rerun": ("cogmap.cli.view.rerun:rerun", "Show a running system in Rerun's viewer."),
}


@click.group()
def view() -> None:
    """Show a running system in Foxglove or Rerun, as it runs.

    What is shown is what `cogmap log export` writes of a log: images, depth, poses, path, map,
    range scans, needs, and what becomes conscious. No module waits for a viewer: one that is too
    slow gets fewer images.
    """


add_verbs(view, VERBS)
