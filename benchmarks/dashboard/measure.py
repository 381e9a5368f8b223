"""The metrics of dashboard: how soon the page shows what was sensed, and what that costs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.benchmark import Setting, path_option
from benchmarks.dashboard.browser import browser
from benchmarks.dashboard.drives import Driven, long_log
from benchmarks.dashboard.page import frames_shown_ms, slider_ms
from benchmarks.report import Metrics
from benchmarks.threshold import at_most

THRESHOLDS = {
    "shown_ms_p50": at_most(250.0),
    "cycle_ratio": at_most(1.15),
    "slider_ms_p99": at_most(500.0),
    "foreign_requests": at_most(0.0),
}
OPTIONS = [
    path_option(
        "--log",
        "source",
        metavar="LOG",
        text="The log that the slider moves in; without it one of ten minutes is driven first.",
    )
]
BROWSERS = 3


def measure(setting: Setting, source: Path | None = None) -> Metrics:
    """Measure how soon a browser shows what was sensed, what that costs the system, and how soon
    any moment of a log is shown.

    Drives a lap with cameras in real time, once alone and once with the dashboard in three headless
    browsers, which are open before, and one of which notes when it shows each frame. Then a slider
    is moved to a hundred moments of a log of ten minutes, which is driven in lockstep, at the level
    of percepts. Takes about ten minutes, and Debian's chromium and chromium-driver.
    """
    announce = setting.announce
    with browser():  # says at once where there is none
        announce("driving a lap alone")
    alone = Driven(setting.folder / "alone")
    alone.end()

    announce(f"driving a lap, watched in {BROWSERS} browsers")
    shown_ms, foreign, watched = frames_shown_ms(setting.folder / "watched", BROWSERS)

    if source is None:
        announce("driving ten minutes in lockstep")
        source = long_log(setting.folder / "long")
    announce("moving the slider")
    moved_ms, also_foreign = slider_ms(source)

    return {
        "shown_ms_p50": float(np.median(shown_ms)),
        "cycle_ratio": watched.cycle_p50_ms() / alone.cycle_p50_ms(),
        "slider_ms_p99": float(np.percentile(moved_ms, 99)),
        "foreign_requests": float(foreign + also_foreign),
        "shown_ms_p99": float(np.percentile(shown_ms, 99)),
        "frames_shown": float(len(shown_ms)),
        "slider_ms_p50": float(np.median(moved_ms)),
        "cycle_p50_ms": watched.cycle_p50_ms(),
        "cycle_p50_alone_ms": alone.cycle_p50_ms(),
    }
