"""Mutated messages of every topic, put on the in-memory bus before every module."""

from __future__ import annotations

import gc
import logging
import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec

from benchmarks.fuzz.mutations import changed, rewritten
from benchmarks.fuzz.watch import Findings, described, rss_mb
from benchmarks.harness import agent_modules, build, town_sections
from cogmap.bus.codec import Envelope, decode_envelope, encode
from cogmap.bus.interface import Arrival, Incarnation
from cogmap.bus.memory import MemoryBus
from cogmap.errors import CogmapError
from cogmap.runtime.in_process import InProcessRunner
from cogmap.schemas import topics
from cogmap.schemas.examples import GOLDEN
from cogmap.schemas.topics import Delivery, Topic

ANEW_AFTER = 2_000
"""The modules are made anew after so many messages: what they rightly keep of those is no leak."""

WARM_UP = 4_000
MOST_STEPS = 2_000
"""So many messages of the modules may follow a single one."""

INCARNATION = 1
"""Of a source that is no module here."""

SHARE_OF_BYTES = 0.4
"""Of the mutations, so many know nothing of MessagePack."""


class Hail:
    """Puts mutated messages before the modules, one after the other."""

    def __init__(self, seed: str) -> None:
        self._rng = random.Random(f"messages {seed}")
        self._topics = [each for each in topics.ALL if each.delivery is not Delivery.ON_REQUEST]
        self._whole = {each: _golden(each) for each in topics.ALL}
        self._plain = {each: msgspec.msgpack.decode(self._whole[each]) for each in topics.ALL}
        self._number = 0
        self._incarnations: dict[str, int] = {}

    def begin(self, runner: InProcessRunner) -> None:
        """Speak for every source from now on: as the module of that name, or as one that joins."""
        self._incarnations = {
            shell.module.instance: shell.publisher.incarnation for shell in runner.shells
        }
        bus = MemoryBus(runner.network)
        for plain in self._plain.values():
            source = str(plain["source"])
            if source not in self._incarnations:
                self._incarnations[source] = INCARNATION
                bus.claim(Incarnation("fuzz", source, INCARNATION))

    def throw(self, runner: InProcessRunner, findings: Findings) -> None:
        """Publish one mutated message, and let the modules handle it and what follows."""
        topic = self._rng.choice(self._topics)
        payload, envelope = self._message(topic)
        findings.watch(topic.name, lambda: _handled(runner, topic, payload, envelope))

    def _message(self, topic: Topic) -> tuple[bytes, Envelope]:
        """Return a mutated message, and the envelope that it may have been sent in."""
        rng = self._rng
        self._number += 1
        plain = {**self._plain[topic], "seq": self._number}
        if rng.random() < 0.5:
            plain["stamp_ns"] = self._number * 1_000_000
        source = str(plain["source"])
        now_ns = time.time_ns()
        incarnation = self._incarnations.get(source, INCARNATION)
        envelope = Envelope(source, self._number, incarnation, now_ns, now_ns)

        if rng.random() < SHARE_OF_BYTES:
            other = self._whole[rng.choice(self._topics)]
            return changed(msgspec.msgpack.encode(plain), rng, other), envelope

        payload = msgspec.msgpack.encode(rewritten(plain, rng, rng.choice((1, 1, 2))))
        if rng.random() < 0.05:
            with_wild = changed(encode(envelope), rng)
            try:
                envelope = decode_envelope(with_wild)
            except CogmapError:
                return with_wild, envelope
        return payload, envelope


def campaign(seed: str, count: int, until_s: float, tell: Callable[[int], None]) -> Findings:
    """Throw `count` messages, or as many as there is time for up to the monotonic `until_s`, and
    `tell` now and then how many more were thrown.
    """
    findings = Findings()
    with _faults(findings):
        return _thrown(findings, seed, count, until_s, tell)


def _thrown(
    findings: Findings, seed: str, count: int, until_s: float, tell: Callable[[int], None]
) -> Findings:
    hail = Hail(seed)
    baseline_mb = rss_mb()
    while findings.tried < count and time.monotonic() < until_s:
        tried_before = findings.tried
        with modules() as runner:
            hail.begin(runner)
            for _ in range(min(ANEW_AFTER, count - findings.tried)):
                hail.throw(runner, findings)
                if time.monotonic() > until_s:
                    break
            for shell in runner.shells:
                findings.refused += sum(shell.intake.rejected.values())
                findings.handled += sum(shell.intake.received.values())
        gc.collect()
        tell(findings.tried - tried_before)
        if findings.tried <= WARM_UP:
            baseline_mb = rss_mb()

    findings.growth_mb = max(0.0, rss_mb() - baseline_mb)
    return findings


class _Faults(logging.Handler):
    """Counts what the shells around the modules caught."""

    def __init__(self, findings: Findings) -> None:
        super().__init__(logging.DEBUG)
        self._findings = findings

    def emit(self, record: logging.LogRecord) -> None:
        """Count what was caught, if the record is of that."""
        error = record.exc_info[1] if record.exc_info else None
        if error is not None:
            self._findings.faults[described(error)] += 1


@contextmanager
def _faults(findings: Findings) -> Iterator[None]:
    """Count the faults of modules in the block, and print nothing."""
    log = logging.getLogger("cogmap")
    handler = _Faults(findings)
    level, propagates = log.level, log.propagate
    log.addHandler(handler)
    log.setLevel(logging.DEBUG)
    log.propagate = False
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
        log.propagate = propagates


@contextmanager
def modules() -> Iterator[InProcessRunner]:
    """Give a runner of all modules of a drive at the level of percepts, but for the town."""
    sections = town_sections(1)
    with InProcessRunner(build(agent_modules(), sections)) as runner:
        yield runner


def _handled(runner: InProcessRunner, topic: Topic, payload: bytes, envelope: Envelope) -> None:
    """Deliver a message, and run the modules until none has anything to do."""
    runner.network.deliver(Arrival(topic, payload, envelope, envelope.sent_ns))
    steps = 0

    def is_enough() -> bool:
        nonlocal steps
        steps += 1
        return steps > MOST_STEPS

    runner.run(until=is_enough)


def _golden(topic: Topic) -> bytes:
    return (GOLDEN / f"{topic.file_stem}.msgpack").read_bytes()
