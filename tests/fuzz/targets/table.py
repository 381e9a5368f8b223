"""The targets: what each does with bytes, and the corpus that it begins with."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from benchmarks.fuzz.readers import Format, formats
from benchmarks.fuzz.samples import golden
from cogmap.bus.codec import Envelope, decode, decode_envelope, encode
from cogmap.errors import CogmapError
from cogmap.schemas import topics
from cogmap.schemas.topics import Topic


class Target(NamedTuple):
    """`run` takes any bytes, and raises nothing but what is a defect."""

    run: Callable[[bytes], None]
    corpus: Callable[[], list[bytes]]


def targets() -> dict[str, Target]:
    """Every target by its name, which can be that of a folder."""
    return dict(_targets())


def _targets() -> Iterator[tuple[str, Target]]:
    yield "envelope", Target(_envelope, _envelopes)
    for topic in topics.ALL:
        yield (
            f"message-{topic.file_stem}",
            Target(partial(_decoded, topic), partial(_golden, topic)),
        )
    for form in formats().values():
        for name in form.sample():
            called = f"{form.name}-{name}".replace("/", "-").replace(" ", "-").replace(",", "")
            yield called, Target(partial(_read, form, name), partial(_content, form, name))


def _envelope(data: bytes) -> None:
    with suppress(CogmapError):
        decode_envelope(data)


def _envelopes() -> list[bytes]:
    return [
        encode(Envelope("sim", 7, 1, 2**60, 2**60, [("sensory", 1, 2)], [("odometry", "sim", 3)]))
    ]


def _decoded(topic: Topic, data: bytes) -> None:
    with suppress(CogmapError):
        decode(topic, data)


def _golden(topic: Topic) -> list[bytes]:
    return [golden(topic)]


def _content(form: Format, name: str) -> list[bytes]:
    return [form.sample()[name]]


def _read(form: Format, name: str, data: bytes) -> None:
    """Read a sample of which one file is another."""
    with tempfile.TemporaryDirectory() as folder:
        for each, content in {**form.sample(), name: data}.items():
            path = Path(folder) / each
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        with suppress(CogmapError):
            form.read(Path(folder) / form.file)
