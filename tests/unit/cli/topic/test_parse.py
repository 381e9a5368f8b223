"""Messages as a user writes them on the command line."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from cogmap.cli.messages.style import Form, Style
from cogmap.cli.topic.argument import streamed_topic
from cogmap.cli.topic.documents import documents
from cogmap.cli.topic.parse import parse, pattern
from cogmap.cli.topic.pub import pub
from cogmap.errors import UsageError
from cogmap.recording.selection import one
from cogmap.schemas import topics
from cogmap.schemas.examples import example_messages
from cogmap.schemas.sensing import MotorCommand
from cogmap.schemas.topics import Topic

BY_TOPIC = {topics.of(message): message for message in example_messages()}


def test_a_message_is_read_from_json() -> None:
    said = parse(topics.MOTOR_COMMAND, '{"left_wheel_rad_s": 1, "right_wheel_rad_s": -2.5}')

    assert said == MotorCommand(left_wheel_rad_s=1.0, right_wheel_rad_s=-2.5)


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)
def test_what_echo_prints_in_full_can_be_published_again(topic: Topic) -> None:
    example = BY_TOPIC[topic]
    printed = Style(form=Form.JSON, full=True).text(example, b"")

    assert parse(topic, printed) == example


@pytest.mark.parametrize(
    ("written", "sentence"),
    [
        (
            '{"left_wheel_rad_s": "fast", "right_wheel_rad_s": 1}',
            r"Expected `float`, got `str` - at `left_wheel_rad_s`",
        ),
        (
            '{"left_wheel_rad_s": 1e4, "right_wheel_rad_s": 1}',
            r"Expected `float` <= 1000.0 - at `left_wheel_rad_s`",
        ),
        ('{"right_wheel_rad_s": 1}', r"missing required field `left_wheel_rad_s`"),
        (
            '{"left_wheel_rad_s": 1, "right_wheel_rad_s": 1, "halted": "x"}',
            r"no field 'halted' .*mean 'halted_by'\?",
        ),
        ("[1]", r"Expected `object`, got `array`"),
    ],
)
def test_a_wrong_field_is_named_with_what_was_expected(written: str, sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        parse(topics.MOTOR_COMMAND, written)


def test_a_wrong_field_deep_inside_is_named_with_its_place() -> None:
    plain = json.loads(Style(form=Form.JSON, full=True).text(BY_TOPIC[topics.PERCEPTS], b""))
    plain["objects"][0]["labell"] = "x"

    with pytest.raises(
        UsageError, match=r"no field 'labell' at objects\[0\]: did you mean 'label'\?"
    ):
        parse(topics.PERCEPTS, json.dumps(plain))


def test_an_array_whose_data_do_not_fit_its_shape_is_refused() -> None:
    array = '{"dtype": "<f8", "shape": [2, 3], "data": [[1, 2, 3]]}'

    with pytest.raises(UsageError, match=r"needs 48 bytes, got 24 - at `motions`"):
        parse(topics.SELF_MOTION, f'{{"frame": 0, "since_ns": 0, "motions": {array}}}')


def test_a_topic_may_begin_with_a_slash_and_a_wrong_one_names_the_nearest() -> None:
    assert one("/odometry") is topics.ODOMETRY
    assert one("odometry") is topics.ODOMETRY

    with pytest.raises(UsageError, match=r"no topic 'odometri': did you mean 'odometry'\?"):
        one("odometri")


def test_what_is_answered_on_request_cannot_be_watched() -> None:
    with pytest.raises(UsageError, match="answered on request"):
        streamed_topic("workspace/snapshot")


def test_a_message_may_be_written_as_yaml_as_for_ros2_topic_pub() -> None:
    message = parse(topics.MOTOR_COMMAND, "{left_wheel_rad_s: 1.5, right_wheel_rad_s: -2}")

    assert message == MotorCommand(left_wheel_rad_s=1.5, right_wheel_rad_s=-2.0)


def test_what_is_neither_json_nor_yaml_is_named() -> None:
    with pytest.raises(UsageError, match="neither JSON nor YAML"):
        parse(topics.MOTOR_COMMAND, "{left_wheel_rad_s: [")


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.name)
def test_the_pattern_of_a_message_can_be_published(topic: Topic) -> None:
    message = parse(topic, pattern(topic))

    assert (message.stamp_ns, message.source) == (0, "")


def test_documents_are_lines_of_json_or_yaml_between_dashes() -> None:
    text = '{"a": 1}\n{"a": 2}\na: 3\nb: 4\n---\n\n---\n{a: 5}\n'

    found = list(documents(text.splitlines(keepends=True)))

    assert found == ['{"a": 1}', '{"a": 2}', "a: 3\nb: 4", "{a: 5}"]


def test_pub_without_a_message_prints_a_pattern_and_publishes_nothing() -> None:
    result = CliRunner().invoke(pub, ["motor/command"])

    assert result.exit_code == 0
    assert "left_wheel_rad_s: " in result.stdout
    assert "nothing is published" in result.stderr


def test_a_wrong_message_on_standard_input_is_named_by_its_number() -> None:
    written = "left_wheel_rad_s: 1\nright_wheel_rad_s: 2\n---\nleft_wheel_rad_s: x\n"

    result = CliRunner().invoke(pub, ["motor/command", "--stdin"], input=written)

    assert isinstance(result.exception, UsageError)
    assert str(result.exception).startswith("message 2 on standard input: motor/command: ")
