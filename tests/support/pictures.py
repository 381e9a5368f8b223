"""Draws the picture of the dashboard in the README: `python -m tests.support.pictures LOG`.

LOG is that of a `make demo`, or its folder.
"""

from __future__ import annotations

import argparse
import asyncio
import threading
from pathlib import Path

from aiohttp import web

from cogmap.cli.dashboard.playback import Playback
from cogmap.cli.dashboard.server import Dashboard
from cogmap.cli.dashboard.source import Wish
from tests.support.system.browser import await_script, browser
from tests.support.system.processes import wait_until

DOCS = Path(__file__).parents[2] / "docs"
SHARE = 0.8
"""How much of the drive is over in the picture."""


def main() -> None:
    """Draw docs/dashboard.png."""
    parser = argparse.ArgumentParser(description="Draw the dashboard for the README.")
    parser.add_argument("log", type=Path, help="the log of a drive with cameras, or its folder")
    log: Path = parser.parse_args().log

    playback = Playback(log)
    wait_until(lambda: playback.playing.indexed_s >= playback.playing.duration_s, "all is read")
    at_s = round(SHARE * playback.playing.duration_s, 1)
    playback.act(Wish(seek_s=at_s))
    wait_until(lambda: abs(playback.playing.at_s - at_s) < 1e-6, "the moment is shown")
    loop = asyncio.new_event_loop()
    runner = web.AppRunner(Dashboard(playback, "localhost").application())
    loop.run_until_complete(runner.setup())
    loop.run_until_complete(web.TCPSite(runner, "127.0.0.1", 0).start())
    threading.Thread(target=loop.run_forever, daemon=True).start()

    with browser(1400, 1250) as page:
        page.get(f"http://127.0.0.1:{runner.addresses[0][1]}")
        await_script(
            page,
            "return document.getElementById('view').naturalWidth > 0 && "
            "document.querySelectorAll('#why h3').length === 6 && "
            "/[1-9]/.test(document.getElementById('map-text').textContent)",
            "the page shows the moment",
        )
        page.execute_script("document.getElementById('label').textContent = 'runs/latest'")
        page.save_screenshot(str(DOCS / "dashboard.png"))
    playback.close()


if __name__ == "__main__":
    main()
