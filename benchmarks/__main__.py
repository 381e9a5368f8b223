"""`python -m benchmarks`: measures, prints a table of figures and bars, and writes flat JSON."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import click

from benchmarks import cycle, deltas, losses
from benchmarks.report import Bar, publish
from bus.errors import CogmapError, UsageError
from bus.session import free_endpoint

BUS_BARS = {"delta_rate_ratio": Bar(0.5, at_least=True), "never_drop_lost": Bar(0)}


def _writable(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Better now than after minutes."""
    if path is not None and not path.parent.is_dir():
        raise click.BadParameter(f"there is no folder {path.parent}: make it first")
    return path


json_option = click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    callback=_writable,
    metavar="FILE",
    help="Write the figures there too, as one flat object.",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def benchmarks() -> None:
    """Measure Cogmap on this machine.

    Each prints a table of what was measured, the bar it is held against, and whether it is met; a bar that is
    missed is a result, so the exit code is 0. Ratios are measured in one run. Leave the machine alone meanwhile.

    \b
    python -m benchmarks cycle --json cycle.json
    python -m benchmarks bus --json bus.json
    """


@benchmarks.command(name="cycle")
@json_option
def cycle_command(json_path: Path | None) -> None:
    """The cycle's latency, the bus's share of it, the speed of a replay, the error of the estimate.

    Drives a lap of the demo's town in real time, every module a process, records it, and replays the log through
    sensory, epam, workspace and codelets. Takes about a minute and a half.
    """
    with tempfile.TemporaryDirectory() as folder:
        publish("cycle", cycle.measure(Path(folder), _tell), cycle.BARS, json_path)


@benchmarks.command(name="bus")
@click.option(
    "--pairs",
    type=click.IntRange(1, 99),
    default=7,
    show_default=True,
    help="How often to measure both rates, one right after the other; the ratio is the median.",
)
@click.option("--deltas", "number", type=click.IntRange(100, 100_000), default=3000, show_default=True, help="Of each.")
@json_option
def bus_command(pairs: int, number: int, json_path: Path | None) -> None:
    """The rate of committed deltas against raw Zenoh puts, and what is lost in a minute.

    A workspace commits deltas of 31 KB that three replicas receive, validate and apply; the peer puts the same bytes
    through the same router to three subscribers. Then the whole system drives for 60 s, recorded. Takes about two
    minutes.
    """
    figures = deltas.measure(free_endpoint(), number, pairs, _tell)
    with tempfile.TemporaryDirectory() as folder:
        _tell(f"driving for {losses.RUN_S:g} s, counting what is lost")
        figures |= losses.measure(Path(folder))
    publish("bus", figures, BUS_BARS, json_path)


def _tell(sentence: str) -> None:
    click.echo(sentence, err=True)


def main() -> None:
    """Run a benchmark; what the user can mend is one sentence and exit code 2."""
    try:
        benchmarks(standalone_mode=False, prog_name="python -m benchmarks")
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except CogmapError as error:
        _tell(f"benchmarks: {error}")
        sys.exit(2 if isinstance(error, UsageError) else 1)


if __name__ == "__main__":
    main()
