"""Recordings of place cells in NWB files (Neurodata Without Borders), by the library pynwb."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from cogmap.errors import UsageError
from cogmap.files.bounds import MIB, Budget, most_unpacked
from cogmap.geometry.arrays import Floats

GIVE = "an NWB file (.nwb, HDF5) with positions and the spike times of units"
ARRAY_BYTES = 256 * MIB
BEHAVIOR = "behavior"
EVENTS = "events"
RESTS = "rests"
METRES = {"m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "centimeter": 0.01, "centimetre": 0.01}
_BEGAN = datetime(2000, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Recording:
    """An animal's positions and the spikes of its cells.

    `stamps_s` (n,) increase, `positions_m` (n, 2) are where it was; of a track given by one number,
    the second column is 0. `spikes_s` has the times (k,) of each unit's spikes. `events_s` (k, 2)
    are beginnings and ends of candidate replay events and `rests_s` of rest, None if the file's are
    not asked for.
    """

    name: str
    description: str
    stamps_s: Floats
    positions_m: Floats
    spikes_s: list[Floats]
    events_s: Floats | None = None
    rests_s: Floats | None = None


def read(
    path: Path, position: str | None = None, events: str | None = None, rests: str | None = None
) -> Recording:
    """Read a recording. `position` names the SpatialSeries in the module `behavior`, if there are
    several; `events` and `rests` name tables of intervals. Raises UsageError with the remedy.
    """
    pynwb = _library()
    if not path.is_file():
        raise UsageError(f"there is no file {path}: give {GIVE}")

    with _whole(path), pynwb.NWBHDF5IO(str(path), mode="r", load_namespaces=True) as file:
        nwb = file.read()
        budget = Budget(path, "has arrays of", most_unpacked(path.stat().st_size, ARRAY_BYTES))
        stamps_s, positions_m = _positions(nwb, path, position, budget)
        return Recording(
            name=path.name,
            description=str(nwb.session_description),
            stamps_s=stamps_s,
            positions_m=positions_m,
            spikes_s=_spikes(nwb, path, budget),
            events_s=None if events is None else _intervals(nwb, path, events, "--events", budget),
            rests_s=None if rests is None else _intervals(nwb, path, rests, "--rests", budget),
        )


def write(recording: Recording, path: Path) -> None:
    """Write a recording as an NWB file, in place of one that is there; its intervals, if it has
    any, as the tables `events` and `rests`. Raises UsageError if it cannot be written.
    """
    pynwb = _library()
    from pynwb.behavior import Position, SpatialSeries
    from pynwb.epoch import TimeIntervals

    nwb = pynwb.NWBFile(
        session_description=recording.description,
        identifier=recording.name,
        session_start_time=_BEGAN,
        file_create_date=[_BEGAN],
    )
    series = SpatialSeries(
        name="position",
        data=pynwb.H5DataIO(recording.positions_m.astype(np.float32), compression="gzip"),
        timestamps=pynwb.H5DataIO(recording.stamps_s, compression="gzip"),
        reference_frame="a corner of the track",
        unit="meters",
    )
    behavior = nwb.create_processing_module(BEHAVIOR, "the position of the animal")
    behavior.add(Position(spatial_series=series))
    for spikes_s in recording.spikes_s:
        nwb.add_unit(spike_times=spikes_s)

    for name, spans_s in ((EVENTS, recording.events_s), (RESTS, recording.rests_s)):
        if spans_s is not None:
            table = TimeIntervals(name=name, description=f"intervals: {name}")
            for start_s, stop_s in spans_s.tolist():
                table.add_row(start_time=start_s, stop_time=stop_s)
            nwb.add_time_intervals(table)

    try:
        with pynwb.NWBHDF5IO(str(path), mode="w") as file:
            file.write(nwb, cache_spec=False)
    except OSError as error:
        raise UsageError(
            f"cannot write {path} ({error.strerror or 'no such folder'}): name another file"
        ) from None


def _positions(nwb: Any, path: Path, name: str | None, budget: Budget) -> tuple[Floats, Floats]:
    """Return the stamps (n,) and positions (n, 2) of one SpatialSeries, those that are known."""
    series = _spatial_series(nwb)
    given = ", ".join(series) or "none"
    if name is None and len(series) == 1:
        (name,) = series
    if name is None or name not in series:
        raise UsageError(
            f"{path}: it is not clear which SpatialSeries of its module {BEHAVIOR} is the position "
            f"of the animal; it has {given}: name one with --position"
        )

    chosen = series[name]
    unit = str(chosen.unit).lower().rstrip("s")
    if unit not in METRES:
        raise UsageError(
            f"{path}: the unit of {name} is {chosen.unit}, which is no length: convert it to meters"
        )

    data = _array(chosen.data, budget)
    if data.ndim == 1:
        data = data[:, None]
    scale = METRES[unit]
    known_m = np.zeros((len(data), 2))
    columns = min(2, data.shape[1])
    known_m[:, :columns] = (data[:, :columns] * chosen.conversion + chosen.offset) * scale
    if chosen.timestamps is not None:
        stamps_s = _array(chosen.timestamps, budget)
    else:
        stamps_s = float(chosen.starting_time or 0.0) + np.arange(len(data)) / float(chosen.rate)

    is_known = np.isfinite(known_m).all(axis=1) & np.isfinite(stamps_s)
    stamps_s, rows = np.unique(stamps_s[is_known], return_index=True)
    return stamps_s, known_m[is_known][rows]


def _spatial_series(nwb: Any) -> dict[str, Any]:
    """Return every SpatialSeries of the module `behavior`, those in a Position among them."""
    found: dict[str, Any] = {}
    if BEHAVIOR not in nwb.processing:
        return found

    for interface in nwb.processing[BEHAVIOR].data_interfaces.values():
        if hasattr(interface, "spatial_series"):
            found |= dict(interface.spatial_series)
        elif hasattr(interface, "reference_frame"):
            found[interface.name] = interface
    return found


def _array(written: Any, budget: Budget) -> Floats:
    """Return the numbers of a data set, of which a few bytes may promise any number."""
    budget.take(8 * int(np.prod(np.shape(written), dtype=object)))
    return np.asarray(written[:], float)


def _spikes(nwb: Any, path: Path, budget: Budget) -> list[Floats]:
    if nwb.units is None or "spike_times" not in nwb.units.colnames:
        raise UsageError(f"{path} has no units with spike times: give {GIVE}")
    times = nwb.units["spike_times"]
    spikes_s = []
    for row in range(len(nwb.units)):
        spikes_s.append(np.sort(np.asarray(times[row], float)))
        budget.take(spikes_s[-1].nbytes)
    return spikes_s


def _intervals(nwb: Any, path: Path, name: str, option: str, budget: Budget) -> Floats:
    """Return the beginnings and ends (k, 2) of a table of intervals."""
    tables = dict(nwb.intervals or {})
    for module in nwb.processing.values():
        for interface in module.data_interfaces.values():
            if hasattr(interface, "colnames") and "stop_time" in interface.colnames:
                tables[interface.name] = interface
    if name not in tables:
        given = ", ".join(tables) or "none"
        raise UsageError(f"{option} {name}: {path} has no such table of intervals; it has {given}")

    table = tables[name]
    ends_s = [_array(table[column].data, budget) for column in ("start_time", "stop_time")]
    spans_s = np.column_stack(ends_s)
    return spans_s[np.argsort(spans_s[:, 0])]


@contextmanager
def _whole(path: Path) -> Iterator[None]:
    """Raise UsageError for whatever the library raises where a file is none of NWB: it has no
    exception of its own for that.
    """
    try:
        yield
    except UsageError:
        raise
    except Exception as error:
        words = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise UsageError(f"{path} is no whole NWB file ({words}): give {GIVE}") from None


def _library() -> Any:
    """Return pynwb. Raises UsageError if it is not installed."""
    try:
        import pynwb
    except ImportError:
        raise UsageError(
            "recordings need the library pynwb: install it by `pip install 'cogmap[recordings]'`"
        ) from None
    return pynwb
