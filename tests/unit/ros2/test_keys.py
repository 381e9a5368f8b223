"""Keys and tokens, as the design of rmw_zenoh gives them, and as zenoh-ros2-sdk makes them."""

from __future__ import annotations

import pytest
from zenoh_ros2_sdk import entity, keyexpr, qos

from cogmap.ros2.rmw.keys import (
    LATCHED,
    SENSOR,
    USUAL,
    End,
    Node,
    Quality,
    Stream,
    absolute,
    dds_name,
    ros_name,
    seen,
)

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
CHATTER = Stream("/chatter", "std_msgs/msg/String", STRING_HASH)
SESSION = "8b20917502ee955ac4476e0266340d5c"


def test_the_key_of_data_is_that_of_the_design_document() -> None:
    assert CHATTER.key(0) == f"0/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"


def test_tokens_are_those_of_the_design_document() -> None:
    node = Node(0, SESSION, 0, "/", "talker")

    assert node.token == f"@ros2_lv/0/{SESSION}/0/0/NN/%/%/talker"
    assert node.token_of(10, End.PUBLISHER, CHATTER, Quality(depth=7)) == (
        f"@ros2_lv/0/{SESSION}/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/"
        f"{STRING_HASH}/::,7:,:,:,,"
    )


@pytest.mark.parametrize("namespace", ["/", "/robot1", "/fleet/robot1"])
@pytest.mark.parametrize("end", list(End))
def test_tokens_are_those_that_another_library_makes(namespace: str, end: End) -> None:
    theirs = entity.NodeEntity(3, SESSION, 0, "cogmap", namespace)
    endpoint = entity.EndpointEntity(
        node=theirs,
        entity_id=5,
        kind=entity.EntityKind(end.value),
        name="/base/cmd_vel",
        dds_type_name="std_msgs::msg::dds_::String_",
        type_hash=STRING_HASH,
        qos=qos.DEFAULT_QOS_PROFILE.encode(),
    )

    ours = Node(3, SESSION, 0, namespace, "cogmap")
    stream = Stream("/base/cmd_vel", "std_msgs/msg/String", STRING_HASH)
    assert ours.token == keyexpr.node_liveliness_keyexpr(theirs)
    assert ours.token_of(5, end, stream, USUAL) == keyexpr.endpoint_liveliness_keyexpr(endpoint)


@pytest.mark.parametrize("quality", [USUAL, LATCHED, SENSOR, Quality(depth=100)])
def test_another_library_reads_our_quality_of_service(quality: Quality) -> None:
    read = qos.QosProfile.decode(quality.encoded)

    assert (read.reliability is qos.QosReliability.RELIABLE) == quality.is_reliable
    assert (read.durability is qos.QosDurability.TRANSIENT_LOCAL) == quality.is_latched
    assert read.history_depth == quality.depth


def test_a_token_is_read_back() -> None:
    token = Node(0, SESSION, 0, "/robot1", "talker").token_of(
        4, End.SUBSCRIPTION, Stream("/robot1/chatter", CHATTER.kind, STRING_HASH), USUAL
    )

    found = seen(token)

    assert found is not None
    assert (found.node, found.end) == ("talker", End.SUBSCRIPTION)
    assert found.stream == Stream("/robot1/chatter", CHATTER.kind, STRING_HASH)


@pytest.mark.parametrize(
    "token",
    [
        "@ros2_lv/0/a/0/0/NN/%/%/talker",
        "@ros2_lv/0/a/0/3/SS/%/%/talker/%add/x::srv::dds_::Add_/RIHS01_0/::,10:,:,:,,",
        "@ros2_lv/0",
    ],
)
def test_nodes_services_and_nonsense_are_no_ends_of_topics(token: str) -> None:
    assert seen(token) is None


def test_names_of_types_are_those_of_dds_and_back() -> None:
    assert dds_name("sensor_msgs/msg/Image") == "sensor_msgs::msg::dds_::Image_"
    assert ros_name("sensor_msgs::msg::dds_::Image_") == "sensor_msgs/msg/Image"


@pytest.mark.parametrize(
    ("topic", "namespace", "whole"),
    [
        ("map", "/", "/map"),
        ("map", "/robot1", "/robot1/map"),
        ("map", "/robot1/", "/robot1/map"),
        ("/map", "/robot1", "/map"),
    ],
)
def test_a_topic_is_in_the_namespace_unless_it_begins_with_a_slash(
    topic: str, namespace: str, whole: str
) -> None:
    assert absolute(topic, namespace) == whole
