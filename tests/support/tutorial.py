"""The tutorial, a notebook that is committed with what it shows.

`python -m tests.support.tutorial` runs it anew, and keeps what it shows then.
"""

from __future__ import annotations

import base64
import os
import tempfile
from io import BytesIO
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from PIL import Image

from cogmap.bus.session import free_endpoint
from cogmap.runtime.environment import CONNECT
from tests.support.includes import ROOT

TUTORIAL = ROOT / "examples" / "tutorial.ipynb"
TIMEOUT_S = 100
COLOURS = 256
PNG = "image/png"


def executed(folder: Path, endpoint: str) -> NotebookNode:
    """The tutorial with what its cells show when it is run in `folder`, with the router of its
    drive at `endpoint`. Raises CellExecutionError for a cell that fails.
    """
    notebook = nbformat.read(TUTORIAL, nbformat.NO_CONVERT)
    resources = {"metadata": {"path": str(folder)}}
    client = NotebookClient(
        notebook,
        timeout=TIMEOUT_S,
        resources=resources,
        record_timing=False,
        coalesce_streams=True,
    )
    return client.execute(env=os.environ | {CONNECT: endpoint})


def shown(notebook: NotebookNode) -> list[NotebookNode]:
    """All that the cells of a notebook show, in order."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return [output for cell in cells for output in cell.outputs]


def main() -> None:
    """Run the tutorial, and keep what it shows, with pictures of few colours: they are small."""
    with tempfile.TemporaryDirectory() as folder:
        notebook = executed(Path(folder), free_endpoint())

    for output in shown(notebook):
        picture = output.get("data", {})
        if PNG in picture:
            picture[PNG] = _small(picture[PNG])
    notebook.metadata.language_info = {"name": "python"}
    nbformat.write(notebook, TUTORIAL)


def _small(encoded: str) -> str:
    """The same PNG, in base64, with fewer colours: rare ones, as of thin lines, are kept."""
    picture = Image.open(BytesIO(base64.b64decode(encoded))).convert("RGB")
    file = BytesIO()
    picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE).save(file, "png", optimize=True)
    return base64.b64encode(file.getvalue()).decode()


if __name__ == "__main__":
    main()
