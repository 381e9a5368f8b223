"""Where viewers of other projects are served, and what is refused."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from cogmap.cli.view.foxglove import serve
from cogmap.cli.view.rerun import save
from cogmap.errors import PortInUseError, UsageError
from cogmap.recording.exporting import foxglove


def test_a_port_in_use_is_named_with_the_remedy() -> None:
    library = foxglove.library()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]

        with pytest.raises(PortInUseError, match=rf"127.0.0.1:{port} .*--port"):
            serve(library, library.Context(), "agent", "127.0.0.1", port)


def test_a_file_for_rerun_that_exists_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "drive.rrd"
    path.write_text("mine")
    rerun = pytest.importorskip("rerun")

    with pytest.raises(UsageError, match="exists already"):
        save(rerun.RecordingStream("test"), path)
    assert path.read_text() == "mine"
