"""Recordings of place cells in NWB files."""

from __future__ import annotations

import os
import sys
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cogmap.data import nwb
from cogmap.data.nwb import Recording
from cogmap.errors import UsageError

pytestmark = pytest.mark.skipif(
    find_spec("pynwb") is None and "CI" not in os.environ, reason="pynwb is not installed"
)
STAMPS_S = np.arange(5) / 4


def recording(**more: Any) -> Recording:
    """A mouse that walks for a second, and two of its cells."""
    return Recording(
        name="mouse",
        description="a mouse on a track",
        stamps_s=STAMPS_S,
        positions_m=np.column_stack([STAMPS_S, -STAMPS_S]),
        spikes_s=[np.array([0.1, 0.5]), np.array([0.25])],
        **more,
    )


def foreign(path: Path, units: bool = True, **series: dict[str, Any]) -> Path:
    """An NWB file of somebody else's, with these SpatialSeries by name."""
    from pynwb import NWBHDF5IO, NWBFile
    from pynwb.behavior import SpatialSeries

    file = NWBFile("a session", "1", datetime(2020, 1, 1, tzinfo=UTC))
    behavior = file.create_processing_module("behavior", "what it did")
    for name, fields in series.items():
        behavior.add(SpatialSeries(name=name, reference_frame="the door", **fields))
    if units:
        file.add_unit(spike_times=[0.2, 0.1])
    with NWBHDF5IO(str(path), mode="w") as out:
        out.write(file)
    return path


def test_a_recording_is_read_as_it_was_written(tmp_path: Path) -> None:
    events_s = np.array([[0.5, 0.6], [0.8, 0.9]])
    rests_s = np.array([[0.25, 1.0]])
    path = tmp_path / "mouse.nwb"
    nwb.write(recording(events_s=events_s, rests_s=rests_s), path)

    read = nwb.read(path, events="events", rests="rests")
    plain = nwb.read(path)

    assert read.name == "mouse.nwb"
    assert read.description == "a mouse on a track"
    assert np.array_equal(read.stamps_s, STAMPS_S)
    assert read.positions_m == pytest.approx(recording().positions_m)
    assert [times_s.tolist() for times_s in read.spikes_s] == [[0.1, 0.5], [0.25]]
    assert read.events_s is not None
    assert np.array_equal(read.events_s, events_s)
    assert read.rests_s is not None
    assert np.array_equal(read.rests_s, rests_s)
    assert plain.events_s is None
    assert plain.rests_s is None


def test_centimetres_at_a_rate_become_metres_at_stamps(tmp_path: Path) -> None:
    data = np.array([[100.0, 0.0, 7.0], [np.nan, 0.0, 7.0], [200.0, 50.0, 7.0]])
    given = {"data": data, "unit": "cm", "rate": 10.0, "starting_time": 3.0}
    read = nwb.read(foreign(tmp_path / "rat.nwb", xy=given))

    assert read.stamps_s == pytest.approx([3.0, 3.2])
    assert read.positions_m == pytest.approx(np.array([[1.0, 0.0], [2.0, 0.5]]))
    assert read.spikes_s[0].tolist() == [0.1, 0.2]


def test_a_track_of_one_number_is_a_line(tmp_path: Path) -> None:
    given = {"data": np.array([0.5, 1.0]), "unit": "meters", "conversion": 2.0, "rate": 1.0}
    read = nwb.read(foreign(tmp_path / "rat.nwb", track=given))

    assert read.positions_m.tolist() == [[1.0, 0.0], [2.0, 0.0]]


def test_of_several_series_one_is_to_be_named(tmp_path: Path) -> None:
    given = {"data": np.zeros((2, 2)), "unit": "m", "rate": 1.0}
    path = foreign(tmp_path / "rat.nwb", head=given, tail=given)

    with pytest.raises(UsageError, match=r"it has head, tail: name one with --position"):
        nwb.read(path)
    with pytest.raises(UsageError, match=r"it has head, tail: name one with --position"):
        nwb.read(path, position="ear")
    assert len(nwb.read(path, position="tail").stamps_s) == 2


def test_what_a_file_lacks_is_named_with_the_remedy(tmp_path: Path) -> None:
    degrees = {"data": np.zeros(2), "unit": "degrees", "rate": 1.0}
    metres = {"data": np.zeros((2, 2)), "unit": "meters", "rate": 1.0}
    without_position = foreign(tmp_path / "a.nwb")
    turning = foreign(tmp_path / "b.nwb", turn=degrees)
    without_units = foreign(tmp_path / "c.nwb", units=False, xy=metres)
    whole = foreign(tmp_path / "d.nwb", xy=metres)
    other = tmp_path / "e.nwb"
    other.write_text("no HDF5")

    with pytest.raises(UsageError, match=r"it has none: name one with --position"):
        nwb.read(without_position)
    with pytest.raises(UsageError, match=r"degrees, which is no length: convert it to meters"):
        nwb.read(turning)
    with pytest.raises(UsageError, match=r"has no units with spike times: give an NWB file"):
        nwb.read(without_units)
    with pytest.raises(UsageError, match=r"--rests sleep: .* no such table of intervals; it has"):
        nwb.read(whole, rests="sleep")
    with pytest.raises(UsageError, match=r"e\.nwb is no whole NWB file .*: give an NWB file"):
        nwb.read(other)
    with pytest.raises(UsageError, match=r"there is no file .*none\.nwb: give an NWB file"):
        nwb.read(tmp_path / "none.nwb")
    with pytest.raises(UsageError, match=r"cannot write .*: name another file"):
        nwb.write(recording(), tmp_path / "nowhere" / "mouse.nwb")


def test_without_the_library_the_remedy_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pynwb", None)

    with pytest.raises(UsageError, match=r"install it by `pip install 'cogmap\[recordings\]'`"):
        nwb.read(tmp_path / "rat.nwb")
