"""A harness for tests of modules and codelets, ours and those of other packages.

    Town            a simulated town and its agent in lockstep, in this process
    Observer        a module that keeps what is published and follows the graph
    run_codelet     one task of a codelet, on a graph
    of_type         the messages, nodes or operations of one type

and builders of what they are fed with: graphs and nodes (`graph_of`, `agent`, `landmark`, `cells`),
what is sensed (`percept`, `percept_at`, `unidentified`, `percepts`, `range_scan`, `odometry`,
`self_motion`), and what is asked and broadcast (`context`, `task`, `broadcast`). Each has usual
values for all that a test is not about. All of it runs on the in-memory bus, without pybullet,
files or clocks; docs/testing.md has examples.
"""

from __future__ import annotations

from cogmap.testing.builders import (
    PERIOD_NS,
    Rows,
    agent,
    broadcast,
    cells,
    context,
    graph_of,
    landmark,
    odometry,
    percept,
    percept_at,
    percepts,
    range_scan,
    run_codelet,
    self_motion,
    stamp_ns,
    task,
    unidentified,
)
from cogmap.testing.observer import Observer, of_type
from cogmap.testing.town import COGNITION, Town

__all__ = [
    "COGNITION",
    "PERIOD_NS",
    "Observer",
    "Rows",
    "Town",
    "agent",
    "broadcast",
    "cells",
    "context",
    "graph_of",
    "landmark",
    "odometry",
    "of_type",
    "percept",
    "percept_at",
    "percepts",
    "range_scan",
    "run_codelet",
    "self_motion",
    "stamp_ns",
    "task",
    "unidentified",
]
