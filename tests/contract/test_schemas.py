"""What the table of topics and its messages promise to yesterday's logs and to other languages."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgpack
import msgspec
import pytest
from msgspec.inspect import FloatType

from cogmap.bus.codec import Envelope, decode, encode
from cogmap.schemas import sensing, topics
from cogmap.schemas.base import Message
from cogmap.schemas.examples import GOLDEN, example, example_messages
from cogmap.schemas.export import export_golden, export_schemas, json_schema
from cogmap.schemas.topics import Delivery, Scope, Topic
from tests.support.damage import golden

BY_TOPIC = {topics.of(message): message for message in example_messages()}
# All but those of records whose fields must fit each other.
DERIVABLE = [topic for topic in topics.ALL if topic not in (topics.STORED, topics.RESTORED)]
each_topic = pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)


@each_topic
def test_golden_bytes_decode_and_encode_to_the_same_bytes(topic: Topic) -> None:
    message = decode(topic, golden(topic))

    assert encode(message) == golden(topic)
    assert message == BY_TOPIC[topic]


@each_topic
def test_golden_bytes_are_plain_msgpack_without_extensions(topic: Topic) -> None:
    def refuse(code: int, data: memoryview) -> None:
        raise AssertionError(f"extension {code}")

    plain = msgspec.msgpack.decode(golden(topic), ext_hook=refuse)

    assert plain["source"] == "sample"
    assert msgspec.msgpack.encode(plain) == golden(topic)


@each_topic
def test_the_reference_library_of_msgpack_decodes_the_golden_bytes(topic: Topic) -> None:
    decoded = msgpack.unpackb(golden(topic))

    assert decoded == msgspec.msgpack.decode(golden(topic))
    assert decode(topic, msgpack.packb(decoded)) == BY_TOPIC[topic]


@each_topic
def test_the_reference_library_of_msgpack_decodes_an_envelope(topic: Topic) -> None:
    stage = ("sensory", 4, 5)
    cause = (topic.name, "sim", 6)
    envelope = Envelope("sim", 7, 1, 2, 3, [stage], [cause], 8)

    decoded = msgpack.unpackb(encode(envelope))

    assert decoded == ["sim", 7, 1, 2, 3, [list(stage)], [list(cause)], 8]


@each_topic
def test_a_field_of_tomorrow_does_not_trouble_todays_reader(topic: Topic) -> None:
    plain = msgspec.msgpack.decode(golden(topic))
    plain["field_of_tomorrow"] = [1, {"two": 3.0}]

    payload = msgspec.msgpack.encode(plain)

    assert decode(topic, payload) == BY_TOPIC[topic]


@each_topic
def test_the_json_schema_names_every_field_and_what_it_means(topic: Topic) -> None:
    schema = json_schema(topic)
    definition = schema["$defs"][topic.type.__name__]

    tag = topic.type.__struct_config__.tag_field
    fields = [name for name in definition["properties"] if name != tag]
    assert fields == list(topic.type.__struct_fields__)
    assert definition["description"]


def test_every_golden_file_belongs_to_a_topic() -> None:
    assert {path.name for path in GOLDEN.iterdir()} == {
        f"{topic.file_stem}.msgpack" for topic in topics.ALL
    }


def test_golden_bytes_are_written_the_same_every_time(tmp_path: Path) -> None:
    paths = export_golden(tmp_path)

    assert len(paths) == len(topics.ALL)
    for path in paths:
        committed = GOLDEN / path.name
        differs = f"{path.name} differs: export it on purpose"
        assert path.read_bytes() == committed.read_bytes(), differs


def test_every_export_is_one_command(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "cogmap.schemas.export", str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )

    assert run.stdout.startswith(f"{len(topics.ALL)} files")
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert written == {path.name: path.read_bytes() for path in export_schemas(tmp_path)}


def test_names_and_types_are_unique() -> None:
    assert len(topics.ALL) == len(topics.BY_NAME) == len(topics.BY_TYPE)


@each_topic
def test_a_row_of_the_table_makes_sense(topic: Topic) -> None:
    assert re.fullmatch(r"[a-z][a-z_]*(/[a-z][a-z_]*)*", topic.name)
    assert topic.key("robot-1") == f"cogmap/robot-1/{topic.name}"
    assert issubclass(topic.type, Message)
    assert topic.rate_hz >= 0
    assert topic.max_bytes >= len(golden(topic))
    assert topic.delivery is not Delivery.ON_REQUEST or topic.rate_hz == 0
    assert (topic.scope is Scope.TRUTH) == topic.name.startswith("truth/")


def _floats(kind: object) -> Iterator[FloatType]:
    """Every float type within a type."""
    if isinstance(kind, FloatType):
        yield kind
    if isinstance(kind, msgspec.Struct):
        for name in kind.__struct_fields__:
            value = getattr(kind, name)
            for part in value if isinstance(value, tuple) else [value]:
                yield from _floats(part)


@each_topic
def test_every_float_is_bounded_which_keeps_nan_and_infinity_out(topic: Topic) -> None:
    definition = msgspec.inspect.type_info(topic.type)

    for kind in _floats(definition):
        assert kind.ge is not None or kind.gt is not None
        assert kind.le is not None or kind.lt is not None


def test_the_floats_of_a_type_are_found_at_any_depth() -> None:
    wheels = msgspec.inspect.type_info(sensing.Odometry)
    view = msgspec.inspect.type_info(sensing.Percepts)

    assert len(list(_floats(wheels))) == 3
    assert len(list(_floats(view))) > 3


def _defaults_in(message: Message) -> list[str]:
    """The fields of a message that have their default."""
    defaults = message.__struct_defaults__
    optional = message.__struct_fields__[-len(defaults) :]
    return [
        name
        for name, default in zip(optional, defaults, strict=True)
        if getattr(message, name) == default
    ]


@each_topic
def test_every_field_of_an_example_differs_from_its_default(topic: Topic) -> None:
    assert _defaults_in(BY_TOPIC[topic]) in ([], ["seq"])


@pytest.mark.parametrize("topic", DERIVABLE, ids=lambda topic: topic.name)
def test_a_new_message_needs_no_example_of_its_own(topic: Topic, tmp_path: Path) -> None:
    message = example(topic, tmp_path)

    assert decode(topic, encode(message)) == message
    assert _defaults_in(message) == ["seq"]


def test_where_fields_must_fit_each_other_an_example_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no example of Stored .* add one .* to BY_HAND"):
        example(topics.STORED, tmp_path)


def test_a_new_field_and_a_new_kind_of_node_get_an_example(tmp_path: Path) -> None:
    plain = msgspec.msgpack.decode(golden(topics.DELTA))
    kinds = {operation["type"] for operation in plain["operations"]}
    del plain["reasons"]
    plain["operations"] = [each for each in plain["operations"] if each["type"] != "goal"]
    older = tmp_path / f"{topics.DELTA.file_stem}.msgpack"
    older.write_bytes(msgspec.msgpack.encode(plain))

    delta = example(topics.DELTA, tmp_path)

    completed = msgspec.to_builtins(delta)
    assert completed["reasons"]
    assert {operation["type"] for operation in completed["operations"]} == kinds
