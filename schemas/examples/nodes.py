"""A node of every kind, every field of it other than its default."""

from __future__ import annotations

from typing import Any

import numpy as np

from cogmap.schemas.array import Matrix
from cogmap.schemas.examples.arrays import matrix
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    PLAN_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    SELF_ID,
    TILE_CELLS,
    AnyNode,
    Attention,
    Correction,
    CostLayer,
    Episode,
    Goal,
    LoopClosure,
    Map,
    Misfits,
    Need,
    Node,
    Object,
    Observations,
    PathIntegration,
    PathSegment,
    Percept,
    PlaceColumn,
    Plan,
    PlanState,
    Recollection,
    Remembered,
    Self,
    SubMap,
    attention_id,
    episode_id,
    goal_id,
    need_id,
    object_id,
    observations_id,
    percept_id,
    segment_id,
)

_USUAL: dict[str, Any] = {"activation": 0.5, "base_level": 0.25, "cycle": 6}


def every_kind() -> list[AnyNode]:
    """A node of every kind."""
    return [
        unknown_kind(),
        self_node(),
        _percept(),
        object_node(),
        PathSegment(
            id=segment_id(1),
            number=1,
            rows=matrix(2, 11),
            is_sparse=True,
            joins=matrix(1, 7),
            **_USUAL,
        ),
        _observations(),
        _closure(),
        Correction(id=CORRECTION_ID, rows=matrix(2, 7), **_USUAL),
        _map(),
        _goal(),
        _plan(),
        _recollection(),
        _episode(),
        _need(),
        _attention(),
    ]


def unknown_kind() -> Node:
    """A node of a kind that is not in the table of kinds."""
    return Node(
        id="post:3",
        kind="post",
        activation=0.5,
        base_level=0.125,
        cycle=5,
        attributes={"x_m": 1.5, "count": 3, "name": "Häuserzeile", "moving": True},
        samples=matrix(4, 3),
    )


def self_node() -> Self:
    """The agent."""
    return Self(
        id=SELF_ID,
        activation=1.0,
        base_level=1.0,
        cycle=6,
        map="map:1",
        stamp_ns=1_100_000_000,
        x_m=3.5,
        y_m=-1.25,
        heading_rad=0.5,
        x_sd_m=0.25,
        y_sd_m=0.125,
        heading_sd_rad=0.0625,
        kept_share=0.375,
        stationary_since_ns=800_000_000,
        speed_gain=0.03125,
        turn_gain=-0.03125,
        range_gain=0.015625,
        odometry=PathIntegration(
            x_m=3.25, y_m=-1.5, heading_rad=0.625, variance_m2=0.5, variance_rad2=0.25
        ),
        misfits=Misfits(
            count=2,
            label="building-03",
            is_lost=True,
            last_ns=1_000_000_000,
            last_fit_ns=900_000_000,
        ),
        samples=matrix(2, 7),
    )


def object_node() -> Object:
    """An object of the cognitive map."""
    return Object(
        id=object_id("building-07"),
        activation=0.75,
        base_level=0.25,
        cycle=6,
        label="building-07",
        function="shop",
        map="map:1",
        x_m=12.5,
        y_m=4.25,
        x_sd_m=0.5,
        y_sd_m=0.25,
        width_m=9.0,
        height_m=6.5,
        sightings=4,
        misses=1,
        last_seen_ns=1_100_000_000,
        created_ns=700_000_000,
        surveyed=True,
        salience=0.5,
        offsets_m=matrix(3, 2, "<f2"),
    )


def _percept() -> Percept:
    return Percept(
        id=percept_id("building-07"),
        label="building-07",
        bearing_rad=0.25,
        range_m=9.5,
        **_USUAL,
    )


def _observations() -> Observations:
    return Observations(
        id=observations_id(1, "building-07"),
        number=1,
        landmark="building-07",
        rows=matrix(2, 6),
        **_USUAL,
    )


def _closure() -> LoopClosure:
    return LoopClosure(
        id="closure:6:building-07",
        activation=0.5,
        base_level=1.0,
        cycle=6,
        from_ns=200_000_000,
        to_ns=1_100_000_000,
        cue="building-07",
        ahead_m=8.5,
        left_m=-2.25,
        range_m=9.5,
        bearing_rad=0.25,
        sd_m=0.5,
        sd_rad=0.125,
        before_ns=400_000_000,
        view=2,
        consistent=True,
        accepted=False,
    )


def _map() -> Map:
    return Map(
        id="map:1",
        cell_m=0.5,
        parent=ROOT_MAP,
        x_m=3.0,
        y_m=-2.0,
        heading_rad=0.25,
        width_m=120.0,
        height_m=80.0,
        remembered="remembered:1",
        **_USUAL,
    )


def _goal() -> Goal:
    return Goal(
        id=goal_id("bakery"),
        object="bakery",
        map="map:1",
        x_m=12.5,
        y_m=-3.25,
        after=goal_id("school"),
        reached_ns=1_000_000_000,
        need="energy",
        **_USUAL,
    )


def _plan() -> Plan:
    return Plan(
        id=PLAN_ID,
        map="map:1",
        state=PlanState.NO_ROUTE,
        explores=True,
        doubtful=True,
        goals=[goal_id("bakery"), goal_id("school")],
        unreachable={goal_id("harbour"): PlanState.OUTSIDE},
        planned_ns=1_000_000_000,
        length_m=42.5,
        route=matrix(3, 2),
        detour_for={CostLayer.OBSTACLE: 180.0},
        **_USUAL,
    )


def _recollection() -> Recollection:
    return Recollection(
        id=RECOLLECTION_ID,
        map="remembered:1",
        x_m=1.5,
        y_m=-2.5,
        heading_rad=0.75,
        labels=["bakery", "tower"],
        functions=["shop", "home"],
        matched=["bakery", ""],
        objects=matrix(2, 7),
        tiles=[(-1, 2)],
        columns={PlaceColumn.ROAD: Matrix.of(np.full((1, TILE_CELLS), 0.5), "<f2")},
        sub_maps=[_sub_map()],
        **_USUAL,
    )


def _sub_map() -> SubMap:
    return SubMap(
        number=2,
        cell_m=0.75,
        x_m=10.5,
        y_m=-4.25,
        width_m=40.0,
        height_m=25.5,
        members=["bakery", "tower"],
    )


def _episode() -> Episode:
    return Episode(
        id=episode_id(3),
        number=3,
        run=1,
        map="map:1",
        x_m=2.5,
        y_m=-3.25,
        from_ns=400_000_000,
        until_ns=800_000_000,
        content=[Remembered(kind="object", label="bakery", salience=0.25)],
        salience=0.25,
        **_USUAL,
    )


def _need() -> Need:
    return Need(
        id=need_id("energy"),
        label="energy",
        level=0.75,
        is_eased=True,
        salience=-0.5,
        **_USUAL,
    )


def _attention() -> Attention:
    return Attention(
        id=attention_id("expectation"),
        codelet="expectation",
        brought_cycle=5,
        conscious_cycle=4,
        pending={object_id("building-07"): 5},
        noted={object_id("building-07"): 3},
        **_USUAL,
    )
