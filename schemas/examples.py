"""One message of every type, always the same: what the golden bytes are made of."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from schemas import codelets, cognition, graph, nodes, process, sensing
from schemas.array import Array, Matrix, MatrixType
from schemas.base import Message
from schemas.nodes import LinkKind, PlaceColumn

_STAMP_NS = 1_200_000_000


def _ramp(*shape: int, dtype: str) -> Array:
    """The numbers 0, 1, 2 … in that shape, scaled into [0, 1) where they are floats."""
    count = int(np.prod(shape))
    scale = count if dtype[1] == "f" else 1
    ramp = np.arange(count, dtype=np.float64) / scale
    values = ramp.astype(dtype)
    return Array.of(values.reshape(shape))


def _calibration() -> sensing.Calibration:
    return sensing.Calibration(
        width_px=320,
        height_px=240,
        fx_px=240.0,
        fy_px=241.0,
        cx_px=160.5,
        cy_px=120.5,
        baseline_m=0.4,
        mount_height_m=1.6,
        mount_forward_m=0.25,
        right_rotation_rad=(0.001, -0.002, 0.003),
        left_distortion=(0.1, -0.2, 0.001, 0.002, 0.05),
        right_distortion=(0.11, -0.21, 0.0, 0.0, 0.06),
    )


def _percept() -> sensing.Percept:
    return sensing.Percept(
        label="building-07",
        activation=0.875,
        bearing_rad=-0.25,
        range_m=18.5,
        bearing_sd_rad=0.01,
        range_sd_m=0.55,
        width_m=9.0,
        height_m=6.5,
        whole=True,
        box_px=(12, 34, 56, 78),
        outline_px=[(12, 34), (68, 34), (68, 112)],
    )


def _matrix(rows: int, columns: int, dtype: MatrixType = "<f8") -> Matrix:
    numbers = np.arange(rows * columns, dtype=dtype)
    values = numbers.reshape(rows, columns) / 8
    return Matrix.of(values, dtype)


def _node() -> nodes.Node:
    return nodes.Node(
        id="post:3",
        kind="post",
        activation=0.5,
        base_level=0.125,
        cycle=5,
        attributes={"x_m": 1.5, "count": 3, "name": "Häuserzeile", "moving": True},
        samples=_matrix(4, 3),
    )


def _self() -> nodes.Self:
    return nodes.Self(
        id=nodes.SELF_ID,
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
        misfit_count=2,
        first_misfit="building-03",
        is_lost=True,
        last_misfit_ns=1_000_000_000,
        last_fit_ns=900_000_000,
        stationary_since_ns=800_000_000,
        speed_gain=0.03125,
        turn_gain=-0.03125,
        range_gain=0.015625,
        odometry_x_m=3.25,
        odometry_y_m=-1.5,
        odometry_heading_rad=0.625,
        odometry_variance_m2=0.5,
        odometry_variance_rad2=0.25,
        samples=_matrix(2, 7),
    )


def _object() -> nodes.Object:
    return nodes.Object(
        id=nodes.object_id("building-07"),
        activation=0.75,
        base_level=0.25,
        cycle=6,
        label="building-07",
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
        offsets_m=_matrix(3, 2, "<f2"),
    )


def _closure() -> nodes.LoopClosure:
    return nodes.LoopClosure(
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


def _nodes() -> list[graph.Operation]:
    """A node of every kind, every field of it other than its default."""
    usual: dict[str, Any] = {"activation": 0.5, "base_level": 0.25, "cycle": 6}
    observations = nodes.observations_id(1, "building-07")
    return [
        _node(),
        _self(),
        nodes.Percept(
            id=nodes.percept_id("building-07"),
            label="building-07",
            bearing_rad=0.25,
            range_m=9.5,
            **usual,
        ),
        _object(),
        nodes.PathSegment(id=nodes.segment_id(1), number=1, rows=_matrix(2, 9), **usual),
        nodes.Observations(
            id=observations, number=1, landmark="building-07", rows=_matrix(2, 6), **usual
        ),
        _closure(),
        nodes.Correction(id=nodes.CORRECTION_ID, rows=_matrix(2, 7), **usual),
        nodes.Map(
            id="map:1",
            cell_m=0.5,
            parent=nodes.ROOT_MAP,
            x_m=3.0,
            y_m=-2.0,
            heading_rad=0.25,
            **usual,
        ),
    ]


def _operations() -> list[graph.Operation]:
    return [
        *_nodes(),
        graph.Link(source="self", target="place:map:1:3:-4", kind=LinkKind.INSTANCE, weight=0.75),
        _tile(),
        graph.Links(
            kind=LinkKind.INSTANCE,
            weights={"percept:07": {"building-07": 1.0, "building-08": 0.25}},
        ),
        graph.DropNode(id="building-03"),
        graph.DropLink(source="self", target="place:map:1:2:-4", kind=LinkKind.INSTANCE),
        graph.Cells(
            map="map:1",
            column=PlaceColumn.ROAD,
            cells=_ramp(3, 2, dtype="<i4"),
            values=_ramp(3, dtype="<f4"),
            cycle=6,
        ),
        _decay(),
    ]


def _decay() -> graph.Decay:
    return graph.Decay(activation=0.5, base_level=0.0625, place_activation=0.125, forget_below=0.25)


def _tile() -> graph.PlaceTile:
    side = graph.TILE_SIDE
    columns = {name: _ramp(side, side, dtype="<f4") for name in (PlaceColumn.ROAD,)}
    cycles = _ramp(side, side, dtype="<i4")
    return graph.PlaceTile(map="map:1", x=-1, y=2, columns=columns, activation_cycle=cycles)


def _sensing() -> list[Message]:
    image = _ramp(2, 3, 3, dtype="|u1")
    depth = _ramp(2, 3, dtype="<f4")
    pose = sensing.Pose(x_m=3.5, y_m=-1.25, heading_rad=0.5)
    street = sensing.Street(name="ring", line_m=[(0.0, 0.0), (60.0, 0.5)], width_m=8.0)
    house = sensing.Building(name="building-07", pose=pose, width_m=9.0, depth_m=8.0, height_m=6.5)
    return [
        sensing.StereoFrame(frame=6, left=image, right=image, calibration=_calibration()),
        sensing.Odometry(speed_m_s=2.5, turn_rate_rad_s=-0.125, dt_s=0.05),
        sensing.SelfMotion(frame=6, since_ns=1_000_000_000, motions=_ramp(4, 3, dtype="<f8")),
        sensing.View(frame=6, image=image, depth_m=depth, calibration=_calibration()),
        sensing.RangeScan(
            frame=6, bearing_rad=_ramp(5, dtype="<f4"), range_m=_ramp(5, dtype="<f4")
        ),
        sensing.Percepts(
            frame=6,
            objects=[_percept()],
            road_m=_ramp(3, 2, dtype="<f4"),
            road_boundary_m=_ramp(2, 2, dtype="<f4"),
            matches=[sensing.PlaceMatch(frame=2, view_ns=400_000_000, score=0.75)],
        ),
        sensing.MotorCommand(
            left_wheel_rad_s=10.5,
            right_wheel_rad_s=-9.5,
            halted_by=sensing.SpeedLimit.OBSTACLE,
            slowed_by=sensing.SpeedLimit.POSE_AGE,
            pose_age_ns=400_000_000,
        ),
        sensing.TruePose(pose=pose, travelled_m=12.5, progress=0.25),
        sensing.TrueTown(seed=7, streets=[street], buildings=[house]),
    ]


def _mind() -> list[Message]:
    coalition = cognition.Coalition(
        id="6/whereabouts/0",
        codelet="whereabouts",
        activation=0.375,
        nodes=[_self(), _object()],
        links=[graph.Link(source="self", target="place:map:1:3:-4", kind=LinkKind.INSTANCE)],
        maps=["map:1"],
    )
    return [
        codelets.Proposal(
            task_id="6/localization",
            codelet="localization",
            base_version=41,
            operations=_operations(),
            coalitions=[coalition],
            events=[_replay()],
            failure="too few samples",
        ),
        graph.Delta(
            version=42,
            cycle=6,
            phase=graph.Phase.OBJECTS,
            tasks=["6/localization"],
            operations=_operations(),
            rejected=1,
            reasons=["proposal 6/landmark failed: too few samples"],
        ),
        graph.Snapshot(
            version=42,
            cycle=6,
            phase=graph.Phase.ATTENTION,
            decay=_decay(),
            nodes=[_self(), _object()],
            links=[graph.Links(weights={"self": {"place:map:1:3:-4": 1.0}})],
            tiles=[_tile()],
        ),
        graph.SnapshotRequest(at_least=41),
        codelets.Task(
            task_id="6/localization",
            codelet="localization",
            cycle=6,
            version=41,
            about=["self"],
            percepts=[_percept()],
            matches=[sensing.PlaceMatch(frame=2, view_ns=400_000_000, score=0.75)],
            motions=_ramp(4, 3, dtype="<f8"),
            road_m=_ramp(3, 2, dtype="<f4"),
        ),
        codelets.Leases(
            assignments=[
                codelets.Assignment(
                    task_id="6/localization", worker="codelets-2", attempt=1, version=41
                )
            ]
        ),
        codelets.Offer(cycle=5, operations=[_node()]),
        cognition.Coalitions(cycle=6, coalitions=[coalition]),
        cognition.Competition(
            cycle=6,
            contenders=[
                cognition.Contender(
                    id="attention/6",
                    codelet="attention",
                    activation=0.375,
                    fate=cognition.Fate.WON,
                ),
                cognition.Contender(
                    id="road/5", codelet="road", activation=0.25, fate=cognition.Fate.WAITING
                ),
            ],
            trigger=cognition.Trigger.AGGREGATE,
        ),
        cognition.Broadcast(cycle=6, trigger="aggregate", coalition=coalition),
        cognition.Action(
            cycle=6,
            scheme="follow-route",
            activation=0.5,
            parameters={"speed_m_s": 3.0, "turn": "left"},
            behaviours=[
                cognition.Behaviour(scheme="follow-route", activation=0.5),
                cognition.Behaviour(
                    scheme="halt",
                    activation=0.0,
                    rejection=cognition.Rejection.CONTEXT_MISSING,
                ),
            ],
        ),
    ]


def _process() -> list[Message]:
    return [
        process.Clock(rate=0.5),
        process.Presence(
            module="codelets", instance="codelets-2", alive=True, observer="workspace"
        ),
        process.Health(
            module="workspace",
            instance="workspace",
            ready=True,
            uptime_s=61.5,
            received={"epam/percepts": 300},
            emitted={"workspace/delta": 900},
            rejected={"epam/percepts": 1},
            superseded={"camera/stereo": 2},
            gaps={"odometry": 3},
            queued=4,
            busy=0.25,
            compute_p50_ms=1.5,
            compute_p99_ms=7.25,
            memory_mb=96.5,
            notes=["1 faults: run with --verbose to see them"],
        ),
    ]


def _learned() -> sensing.Learned:
    return sensing.Learned(
        frame=6,
        objects=[sensing.LearnedObject(label="building-08", embedding=_ramp(4, dtype="<f4"))],
        views=[sensing.RememberedView(frame=2, view_ns=400_000_000, code=_ramp(4, dtype="|u1"))],
    )


def _replay() -> cognition.Replay:
    return cognition.Replay(
        cycle=6,
        replays=4,
        closed=["closure:0"],
        undone=["closure:1"],
        stamps_ns=_ramp(3, dtype="<i8"),
        positions_m=_ramp(3, 2, dtype="<f8"),
        shifts_m=_ramp(3, 2, dtype="<f8"),
        pairs=_ramp(1, 2, dtype="<i4"),
        strength_changes=_ramp(1, dtype="<f8"),
        decay_per_m=0.2,
    )


def samples() -> list[Message]:
    """A message of every type in the table of topics, every field of it other than its default."""
    messages = [*_sensing(), *_mind(), *_process(), _learned(), _replay()]
    stamped: list[Message] = []
    for seq, message in enumerate(messages):
        stamped.append(
            msgspec.structs.replace(message, stamp_ns=_STAMP_NS, seq=seq, source="sample")
        )
    return stamped
