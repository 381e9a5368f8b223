"""`cogmap topic hz`, `bw` and `delay`: a line a second until Ctrl-C, which ends with the figures so far."""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, TypeVar

import click
import msgspec

from bus.runner import Stop
from cli.options import agent_option, connect_option, json_option
from cli.topic.argument import streamed_argument
from cli.topic.observing import TICK_S, Sight, Sights, observing
from cli.topic.statistics import Bandwidth, Delay, Rate
from schemas.topics import Topic

REPORT_S = 1.0
F = TypeVar("F", bound=Callable[..., Any])


def window_option(default: int) -> Callable[[F], F]:
    """How many messages the figures are about."""
    return click.option(
        "-w", "--window", type=click.IntRange(min=2), default=default, show_default=True, help="Over so many messages."
    )


class Figures(ABC):
    """What one of the commands makes of what it sees."""

    @abstractmethod
    def add(self, sight: Sight) -> None:
        """Take note of one message."""

    @abstractmethod
    def text(self) -> str:
        """The figures so far, as people read them; empty where there are none."""

    @abstractmethod
    def plain(self) -> dict[str, Any]:
        """The figures so far, as programs read them."""


class RateFigures(Figures):
    def __init__(self, window: int) -> None:
        self._rate = Rate(window)

    def add(self, sight: Sight) -> None:
        self._rate.add(sight.received_ns)

    def text(self) -> str:
        spread = self._rate.periods_s()
        if spread is None:
            return ""
        return (
            f"average rate: {1 / max(1e-9, spread.mean):.3f}\n\tmin: {spread.least:.3f}s max: {spread.greatest:.3f}s "
            f"std dev: {spread.deviation:.5f}s window: {spread.window + 1}"
        )

    def plain(self) -> dict[str, Any]:
        spread = self._rate.periods_s()
        return {"rate_hz": 1 / max(1e-9, spread.mean) if spread else None, "period_s": _plain(spread)}


class BandwidthFigures(Figures):
    def __init__(self, window: int) -> None:
        self._bandwidth = Bandwidth(window)

    def add(self, sight: Sight) -> None:
        self._bandwidth.add(sight.received_ns, sight.size_bytes)

    def text(self) -> str:
        sizes = self._bandwidth.sizes_bytes()
        if sizes is None:
            return ""
        mean, least, greatest = (in_bytes(value) for value in (sizes.mean, sizes.least, sizes.greatest))
        per_second = in_bytes(self._bandwidth.bytes_per_s(time.time_ns()))
        return f"{per_second}/s from {sizes.window} messages\n\tMessage size mean: {mean} min: {least} max: {greatest}"

    def plain(self) -> dict[str, Any]:
        sizes = self._bandwidth.sizes_bytes()
        return {"bytes_per_s": self._bandwidth.bytes_per_s(time.time_ns()), "size_bytes": _plain(sizes)}


class DelayFigures(Figures):
    def __init__(self, window: int) -> None:
        self._delay = Delay(window)

    def add(self, sight: Sight) -> None:
        if (envelope := sight.envelope) is not None:
            self._delay.add(envelope.born_ns, envelope.sent_ns, sight.received_ns, envelope.stages)

    def text(self) -> str:
        ages, last_leg = self._delay.ages_s(), self._delay.last_leg_s()
        if ages is None or last_leg is None:
            return ""
        stages = [
            f"\n\t{module}: {compute:.5f}s computing, {rest:.5f}s getting there"
            for module, (compute, rest) in self._delay.stages_s().items()
        ]
        return (
            f"average delay: {ages.mean:.5f}\n\tmin: {ages.least:.5f}s max: {ages.greatest:.5f}s "
            f"std dev: {ages.deviation:.5f}s window: {ages.window}{''.join(stages)}"
            f"\n\tfrom its sending to here: {last_leg.mean:.5f}s"
        )

    def plain(self) -> dict[str, Any]:
        stages = {module: {"compute_s": c, "rest_s": r} for module, (c, r) in self._delay.stages_s().items()}
        ages, last_leg = self._delay.ages_s(), self._delay.last_leg_s()
        return {"delay_s": _plain(ages), "last_leg_s": _plain(last_leg), "stages": stages}


def _plain(spread: msgspec.Struct | None) -> Any:
    return None if spread is None else msgspec.to_builtins(spread)


def in_bytes(size: float) -> str:
    """`size` bytes with a unit that leaves it three digits before the point at most."""
    for unit in ("B", "KB", "MB"):
        if abs(size) < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.2f} {unit}"
        size /= 1000
    return f"{size:.2f} GB"


def watch(connect: str, agent: str, what: str, topic: Topic, figures: Figures, as_json: bool) -> None:
    """Print the figures of `topic` every second until asked to stop, and once more then."""
    stop = Stop()
    with observing(connect, agent, f"topic {what}") as bus:
        sights = Sights(bus, topic)
        report_at_s = time.monotonic() + REPORT_S
        number = reported = 0
        while not stop.asked:
            if (sight := sights.take(TICK_S)) is not None:
                figures.add(sight)
                number += 1
            if time.monotonic() >= report_at_s:
                report_at_s = max(report_at_s + REPORT_S, time.monotonic())
                _print(figures, topic, number, as_json, number > reported)
                reported = number
        _print(figures, topic, number, as_json, True)


def _print(figures: Figures, topic: Topic, number: int, as_json: bool, fresh: bool) -> None:
    if as_json:
        click.echo(json.dumps({"topic": topic.name, "messages": number, **figures.plain()}))
    else:
        click.echo(figures.text() if fresh and figures.text() else f"no new messages of {topic.name}")


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def hz(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """How often messages come."""
    watch(connect, agent, "hz", topic, RateFigures(window), as_json)


@click.command()
@streamed_argument
@window_option(100)
@json_option
@connect_option
@agent_option
def bw(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """How many bytes come in a second."""
    watch(connect, agent, "bw", topic, BandwidthFigures(window), as_json)


@click.command()
@streamed_argument
@window_option(10_000)
@json_option
@connect_option
@agent_option
def delay(topic: Topic, window: int, as_json: bool, connect: str, agent: str) -> None:
    """How old messages are when they come, counted from the sensing, and where the time went."""
    watch(connect, agent, "delay", topic, DelayFigures(window), as_json)
