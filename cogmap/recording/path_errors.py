"""How far an agent was from where it believed to be, over a log: a row a moment."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from cogmap.errors import LogError, MessageError
from cogmap.evaluation.paths import Errors, Paths
from cogmap.recording.table import TIME, arrow_library
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.schemas.graph import Delta

if TYPE_CHECKING:
    import pyarrow


def table(path: Path, rows: Iterable[tuple[float, Message]]) -> pyarrow.Table:
    """Return the errors that messages of `evaluation.paths.FOLLOWED`, of the log at `path`, show;
    each comes with the time in seconds at which it was received.

    Raises LogError if the log has no truth or was begun in the middle of a drive, and UsageError if
    there is no pyarrow.
    """
    arrow = arrow_library()
    paths = Paths()
    received_s: dict[int, float] = {}
    is_begun = False
    for time_s, message in rows:
        if isinstance(message, Delta):
            if not is_begun and message.version > 1:
                raise LogError(
                    f"{path} begins with delta {message.version}, in the middle of a drive: nobody "
                    "knows where the agent's frame is, record a whole drive"
                )
            is_begun = True

        try:
            paths.update(message)
        except MessageError as error:
            raise LogError(f"{path}: a message cannot be used: {error}") from None
        if paths.estimated_ns is not None:
            received_s.setdefault(paths.estimated_ns, time_s)

    if paths.start is None:
        raise LogError(
            f"{path} holds no {topics.TRUE_POSE.name}: errors need a drive whose truth is known, "
            "as that of a simulated one is"
        )
    return arrow.table(_columns(paths.errors(), received_s))


def _columns(errors: Errors, received_s: dict[int, float]) -> dict[str, object]:
    """Return the columns of the table; none of the wheels where these published nothing."""
    x_m, y_m, heading_rad = errors.poses.T
    columns: dict[str, object] = {
        TIME: [received_s[stamp_ns] for stamp_ns in errors.stamps_ns.tolist()],
        "stamp_ns": errors.stamps_ns,
        "x_m": x_m,
        "y_m": y_m,
        "heading_rad": heading_rad,
        "estimate_m": errors.estimate_m,
        "estimate_rad": errors.estimate_rad,
        "fused_m": errors.fused_m,
        "fused_rad": errors.fused_rad,
    }
    if errors.wheels_m.size:
        columns["wheels_m"] = errors.wheels_m
        columns["wheels_rad"] = errors.wheels_rad
    return columns
