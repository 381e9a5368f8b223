"""Files that were made to fill the memory, or to be read for ever."""

from __future__ import annotations

import gzip
import lzma
from collections.abc import Iterator
from functools import partial
from io import BytesIO

import cv2
import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.writer import Writer

from benchmarks.fuzz import samples
from benchmarks.fuzz.readers import Format, formats
from benchmarks.fuzz.samples import Files
from cogmap.recording.storage.format import SOFTWARE

UNPACKED_BYTES = 200 << 20
TEXT_BYTES = 20 << 20
NODE = b'<node id="1" lat="48.4" lon="15.6"/>'


def bombs() -> Iterator[tuple[Format, Files]]:
    """Yield each format that has any with its files, made one after the other."""
    table = formats()
    for name, pack in (("osm.xz", lzma.compress), ("osm.gz", gzip.compress)):
        yield (
            table[name],
            {table[name].file: pack(b"<osm>" + NODE * (TEXT_BYTES // len(NODE)))},
        )
    for name, line in (("streets", b"["), ("g2o", b"0 "), ("goals", b"x\n")):
        yield table[name], {table[name].file: gzip.compress(line * (TEXT_BYTES))}

    zeros = bytes(UNPACKED_BYTES)
    compressed = {"zstd": zstandard.compress(zeros), "lz4": lz4.frame.compress(zeros)}
    del zeros
    for compression, content in compressed.items():
        for claimed in (UNPACKED_BYTES, 64):
            for name in ("log", "log, recovered"):
                yield table[name], {"a.mcap": chunked(compression, content, claimed)}
    small = messages_of_nothing(600_000)
    for name in ("log", "log, recovered"):
        yield table[name], {"a.mcap": chunked("zstd", zstandard.compress(small), len(small))}

    large = np.zeros((8_000, 8_000), np.uint8)
    yield table["picture.png"], {"a.png": cv2.imencode(".png", large)[1].tobytes()}
    del large
    for text in (
        "[" * 100_000,
        "x = " + "9" * 5000,
        "x" + ".x" * 50_000 + " = 1",
        "[[a]]\n" * 50_000,
    ):
        yield table["settings"], {"a.toml": text.encode()}
        yield table["images"], samples.images() | {"camera.toml": text.encode()}
    yield table["euroc"], samples.euroc() | {"mav0/cam0/sensor.yaml": laughs()}
    yield table["euroc"], samples.euroc() | {"mav0/cam0/sensor.yaml": b"[" * 50_000}
    yield table["streets"], {"a.jsonl": b"[" * 100_000}
    yield table["streets"], {"a.jsonl": samples.STREETS.encode().replace(b"[0, 1,", b"[" * 50_000)}
    grid = "type octile\nheight 16384\nwidth 16384\nmap\n" + "." * 16384 + "\n"
    yield table["moving ai"], samples.encoded({"a.map": grid, "a.scen": samples.ROUTES})
    nodes = "".join(f"{number} {number} 0\n" for number in range(1, 30_001))
    problem = samples.TSP.replace("3 3 4\n", "").replace("1 0 0\n2 3 0\n", nodes)
    problem = problem.replace("DIMENSION : 3", "DIMENSION : 30000")
    yield table["tsplib"], samples.encoded({"a.tsp": problem})
    slots = samples.made("counts", samples.counts)["counts"]
    yield table["counts"], {"counts": slots * 3}
    yield table["osm"], {"a.osm": ring(5_000)}
    arrays = partial(np.savez_compressed, a=np.zeros(UNPACKED_BYTES, np.uint8))
    yield table["arrays"], samples.made("a.npz", arrays)


def chunked(compression: str, content: bytes, claimed: int) -> bytes:
    """Return a log of one chunk, which says to have `claimed` bytes when it is unpacked."""
    file = BytesIO()
    writer = Writer(file)
    writer.start("", SOFTWARE)
    record = RecordBuilder()
    Chunk(compression, content, 2, 1, 0, claimed).write(record)
    file.write(record.end())  # type: ignore[no-untyped-call]
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


def messages_of_nothing(number: int) -> bytes:
    """Return so many records of messages without content."""
    return (b"\x05" + (22).to_bytes(8, "little") + bytes(22)) * number


def laughs() -> bytes:
    """Return YAML in which each of nine lists has the one before nine times."""
    lines = ["a0: &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0]"]
    for number in range(1, 9):
        inner = ", ".join([f"*a{number - 1}"] * 9)
        lines.append(f"a{number}: &a{number} [{inner}]")
    lines.append("intrinsics: *a8")
    return "\n".join(lines).encode()


def ring(ways: int) -> bytes:
    """Return an extract with a building of so many ways."""
    nodes = "".join(f'<node id="{n}" lat="48.4" lon="15.6"/>' for n in range(1, ways + 2))
    parts = "".join(
        f'<way id="{n}"><nd ref="{n}"/><nd ref="{n % ways + 1}"/></way>' for n in range(1, ways + 1)
    )
    members = "".join(f'<member type="way" ref="{n}" role="outer"/>' for n in range(ways, 0, -1))
    tags = '<tag k="type" v="multipolygon"/><tag k="building" v="yes"/>'
    text = f'<osm version="0.6">{nodes}{parts}<relation id="5">{members}{tags}</relation></osm>'
    return text.encode()
