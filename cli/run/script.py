"""`cogmap.run`: a drive from a script or a notebook."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import click
import msgspec
import numpy as np
import tomli_w

from cogmap.cli.run.child import USAGE_EXIT, DriveProcess, failure
from cogmap.cli.run.folder import SUMMARY_NAME, link_latest, timed_folder
from cogmap.errors import ConfigError
from cogmap.recording import Log, open_log
from cogmap.runtime import config as configuration
from cogmap.runtime.config import Sections
from cogmap.runtime.environment import CONFIG
from cogmap.services.codelets import rules

if TYPE_CHECKING:
    from cogmap.cli.launch.drive_metrics import RunMetrics

MAX_LINES = 20
"""Of what a drive shows, these are kept: the last one says why it failed."""


class DriveOptions(TypedDict, total=False):
    """The options of `cogmap run` that many drives can share, by their names; a path may be a
    string.
    """

    town: str
    tour: bool
    explore_s: float
    goals: Path | str
    laps: float
    energy: bool
    lockstep: bool
    codelets: int
    record: bool
    time_limit_s: float
    agent: str
    config: Path | str
    rules: str


class RunOptions(DriveOptions, total=False):
    """The options of one drive: those too that it shares with no other."""

    seed: int
    recording: str
    speed: float
    settings: Mapping[str, object]
    memory: Path | str
    connect: str
    out: Path | str


_FLAGS = {"explore_s": "--explore", "time_limit_s": "--time-limit"}
_ELSEWHERE = ("config", "rules", "settings", "out")


@dataclass(frozen=True)
class FinishedRun:
    """A drive that has ended: `summary` has the figures of the summary.json in its `folder`, such
    as `summary.completed`, `summary.reason` and `summary.estimate.mean_m`.
    """

    folder: Path
    summary: RunMetrics

    def log(self) -> Log:
        """Open its log. Raises LogError if it was not recorded."""
        return open_log(self.folder)


def run(*, quiet: bool = True, **options: Unpack[RunOptions]) -> FinishedRun:
    """Drive as `cogmap run` does, every module a process of its own, and return when it has ended.

    The options are those of `cogmap run`, by their names: `seed`, `town`, `tour`, `explore_s`,
    `goals` (a file), `laps`, `energy`, `recording`, `speed`, `lockstep`, `codelets`, `memory`,
    `record`, `time_limit_s`, `connect`, `agent`, `config`, `rules`, and `out`, a new folder.
    `rules`, such as "paper", override `config`, and `settings` override both. Unless `quiet`, the
    progress is printed.

        run = cogmap.run(town="blocks", seed=2, lockstep=True, settings={"sim.duration_s": 20})
        print(run.summary.estimate.mean_m, run.folder)
        run.log().errors().to_pandas().plot("time_s", "estimate_m")

    A drive that did not reach its goals ends too: its `summary.reason` says why. Ctrl-C, or a
    notebook's stop button, ends all its processes, then raises KeyboardInterrupt. Raises
    UsageError for options that do not fit, and CogmapError if the drive left no summary.
    """
    out = options.get("out")
    folder = timed_folder() if out is None else Path(out)
    shown: deque[str] = deque(maxlen=MAX_LINES)
    with (
        words(options, folder) as given,
        DriveProcess(given, subprocess.PIPE) as process,
    ):
        for line in process.shown:
            shown.append(line.decode(errors="replace").rstrip())
            if not quiet:
                click.echo(shown[-1])
        code = process.wait()

    finished = FinishedRun(folder, summary_after(folder, code, "\n".join(shown)))
    if out is None:
        link_latest(folder)
    return finished


@contextmanager
def words(options: RunOptions, folder: Path) -> Iterator[list[str]]:
    """Yield the command line's words for `options`, without the command itself, of a drive whose
    files are in `folder`. Raises ConfigError for settings that cannot be.
    """
    found = ["--out", str(folder), *option_words(options)]
    sections = settings_of(options)
    with tempfile.TemporaryDirectory() as temporary:
        if sections:
            path = Path(temporary) / "settings.toml"
            path.write_text(tomli_w.dumps(sections), encoding="utf-8")
            found += ["--config", str(path)]
        yield found


def option_words(options: RunOptions) -> list[str]:
    """Return the words for all of `options` but the settings and the folder, by their names."""
    found = []
    for name, value in sorted(options.items()):
        if name not in _ELSEWHERE:
            found += _words_of(name, value)
    return found


def _words_of(name: str, value: object) -> list[str]:
    """Return the words for one option; none where it is not given, or not chosen."""
    flag = _FLAGS.get(name, f"--{name}")
    match value:
        case None:
            return []
        case bool() if name == "record":
            return [] if value else ["--no-record"]
        case bool():
            return [flag] if value else []
    return [flag, str(value)]


def settings_of(options: RunOptions) -> Sections:
    """Return the settings of `options`: those of its file, or of $COGMAP_CONFIG's, overridden by
    those of its rules, and by its own.

    Raises ConfigError for a file that cannot be read and for settings that cannot be, UsageError
    for rules that there are not.
    """
    path = options.get("config") or os.environ.get(CONFIG)
    chosen = options.get("rules")
    of_rules = [] if chosen is None else rules.settings_of(chosen)
    sections = configuration.load(Path(path) if path else None, of_rules)
    for key, value in (options.get("settings") or {}).items():
        section, dot, name = key.partition(".")
        if not (section and dot and name):
            raise ConfigError(f"the setting {key!r}: name it as module.key")
        sections.setdefault(section, {})[name] = _plain(key, value)
    return sections


def _plain(key: str, value: object) -> Any:
    """Return a value as it can stand in a file of settings. Raises ConfigError."""
    plain = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    try:
        tomli_w.dumps({key: plain})
    except TypeError:
        raise ConfigError(f"the setting {key} cannot be {value!r}: give what TOML has") from None
    return plain


def summary_after(folder: Path, code: int, shown: str) -> RunMetrics:
    """Return the summary that a drive left in `folder`, which ended with `code` and had `shown` so
    much. Raises UsageError if it could not be driven so, CogmapError if it left no summary.
    """
    # One that could not be driven may be so as another drive is there, whose summary is not its.
    summary = None if code == USAGE_EXIT else summary_in(folder)
    if summary is None:
        raise failure(code, shown)
    return summary


def summary_in(folder: Path) -> RunMetrics | None:
    """Return the summary of the drive in `folder`; None if it has none that can be read."""
    from cogmap.cli.launch.drive_metrics import RunMetrics  # it takes a while to import

    try:
        return msgspec.json.decode((folder / SUMMARY_NAME).read_bytes(), type=RunMetrics)
    except (OSError, msgspec.DecodeError, RecursionError):
        return None
