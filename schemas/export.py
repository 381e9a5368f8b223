"""The messages for other languages.

`python -m cogmap.schemas.export DIR` writes a JSON Schema for every topic.

With `--golden` it writes the golden bytes instead, completed by what they lack of a new topic,
field or kind of node, which is how they are changed on purpose:
`python -m cogmap.schemas.export --golden schemas/golden`. JSON Schema has no bytes: `data` of an
array, a base64 string there, is msgpack's bin.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import msgspec

from cogmap.schemas import topics
from cogmap.schemas.examples import example_messages
from cogmap.schemas.topics import Topic


def json_schema(topic: Topic) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of what `topic` carries."""
    about = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"cogmap/{topic.name}",
    }
    return about | msgspec.json.schema(topic.type)


def export_schemas(folder: Path) -> list[Path]:
    """Write a JSON Schema for every topic into `folder`, and return the files written."""
    files = {}
    for topic in topics.ALL:
        text = msgspec.json.format(msgspec.json.encode(json_schema(topic)))
        files[f"{topic.file_stem}.json"] = text + b"\n"
    return _write(folder, files)


def export_golden(folder: Path) -> list[Path]:
    """Write the bytes of one message of every type into `folder`, and return the files written."""
    files = {}
    for message in example_messages():
        name = f"{topics.of(message).file_stem}.msgpack"
        files[name] = msgspec.msgpack.encode(message)
    return _write(folder, files)


def _write(folder: Path, files: dict[str, bytes]) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in files]


def main() -> None:
    """Write what the command line asks for, and print how many files that is."""
    parser = argparse.ArgumentParser(prog="python -m cogmap.schemas.export", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--golden", action="store_true", help="write the golden bytes instead")
    arguments = parser.parse_args()

    export = export_golden if arguments.golden else export_schemas
    written = export(arguments.folder)
    print(f"{len(written)} files in {arguments.folder}")  # noqa: T201


if __name__ == "__main__":
    main()
