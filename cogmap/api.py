"""What a module of one's own and a notebook need; `import cogmap` gives these names.

A module:       Module, topics, run_program; its messages are in `cogmap.schemas`
The map:        Graph, near, as_networkx; Replica, snapshot_over (Module.following is shorter)
Running:        InProcessRunner in one process; Client beside a running system; run_module
A codelet:      Codelet, CycleContext, Answer; its tasks and nodes are in `cogmap.schemas`
Drives:         run, FinishedRun; sweep, Sweep with many seeds and settings
Recorded logs:  open_log, Log, Entry
Errors:         CogmapError and its kinds
"""

from __future__ import annotations

from cogmap.cli.run.script import FinishedRun, run
from cogmap.cli.sweep.result import Sweep
from cogmap.cli.sweep.script import sweep
from cogmap.errors import (
    CogmapError,
    ConfigError,
    LogError,
    MessageError,
    NoAnswerError,
    NoRouterError,
    PortInUseError,
    StorageError,
    UsageError,
)
from cogmap.graph.graph import Graph
from cogmap.graph.individuals import near
from cogmap.graph.network import as_networkx
from cogmap.graph.replica import Replica, snapshot_over
from cogmap.recording import Entry, Log, open_log
from cogmap.runtime.client import Client
from cogmap.runtime.codelet import Answer, Codelet, CycleContext
from cogmap.runtime.in_process import InProcessRunner
from cogmap.runtime.module import Module
from cogmap.runtime.process import run_module
from cogmap.runtime.program import run_program
from cogmap.schemas import topics

__all__ = [
    "Answer",
    "Client",
    "Codelet",
    "CogmapError",
    "ConfigError",
    "CycleContext",
    "Entry",
    "FinishedRun",
    "Graph",
    "InProcessRunner",
    "Log",
    "LogError",
    "MessageError",
    "Module",
    "NoAnswerError",
    "NoRouterError",
    "PortInUseError",
    "Replica",
    "StorageError",
    "Sweep",
    "UsageError",
    "as_networkx",
    "near",
    "open_log",
    "run",
    "run_module",
    "run_program",
    "snapshot_over",
    "sweep",
    "topics",
]
