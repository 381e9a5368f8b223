"""A moment in words: what nodes, commands and commits are called, and why things came out so."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec import structs

from cogmap.cli.explain import choice, names, reasons, text
from cogmap.cli.explain.moment import Moment, moment
from cogmap.recording.log import open_log
from cogmap.schemas.cognition import Behaviour, Rejection
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.graph import Phase
from cogmap.schemas.nodes import (
    PLAN_ID,
    ROOT_MAP,
    CostLayer,
    Episode,
    Goal,
    GraphNode,
    Map,
    Node,
    Plan,
    PlanState,
    Remembered,
    episode_id,
    goal_id,
    map_id,
)
from cogmap.schemas.sensing import MotorCommand, SpeedLimit
from cogmap.services.global_workspace.config import Config
from cogmap.testing import landmark
from tests.support.cycles import AGENT, Cycles, action, coalition, delta, percept
from tests.support.logs import write_log

NODES: list[tuple[GraphNode, str]] = [
    (AGENT, "the agent at (3.0, -1.0) m, heading 0°"),
    (landmark("41a", names={"town_hall": 2.0}), "town hall"),
    (landmark("41a", names={"town_hall": 2.0}, given_name="the_moot"), "the moot"),
    (landmark("41a", names={}), "object 41a"),
    (Goal(id=goal_id("bakery"), object="bakery"), "the goal bakery"),
    (Goal(id=goal_id("12.5,-3"), x_m=12.5, y_m=-3.0), "the goal at (12.5, -3.0) m"),
    (Goal(id=goal_id("home"), x_m=0.0, y_m=-0.01), "the goal home at (0.0, 0.0) m"),
    (
        Plan(id=PLAN_ID, state=PlanState.READY, goals=[goal_id("bakery")], length_m=80.2),
        "the plan to go to bakery, 80 m",
    ),
    (
        Plan(id=PLAN_ID, state=PlanState.READY, explores=True, doubtful=True, length_m=9.0),
        "the plan to explore, 9 m, over road that was blocked",
    ),
    (
        Plan(
            id=PLAN_ID,
            state=PlanState.READY,
            goals=[goal_id("bakery")],
            length_m=210.0,
            detour_for={CostLayer.BESIDE: 12.0, CostLayer.OBSTACLE: 998.0},
        ),
        "the plan to go to bakery, 210 m; the route before is dearer now: something stands on it",
    ),
    (Plan(id=PLAN_ID, state=PlanState.NO_ROUTE), "the plan: no route leads to the goal"),
    (Map(id=ROOT_MAP, cell_m=1.0), "the root map"),
    (Map(id=map_id(3), cell_m=1.0), "map 3"),
    (
        Episode(
            id=episode_id(3),
            number=3,
            run=2,
            x_m=3.0,
            y_m=-1.0,
            from_ns=0,
            until_ns=10**9,
            content=[
                Remembered(kind="object", label="town_hall"),
                Remembered(kind="need", label="energy"),
            ],
        ),
        "the episode at (3.0, -1.0) m in run 2: town hall, energy",
    ),
    (Node(id="event:7", kind="remembered_event"), "remembered event event:7"),
]


def cycle(path: Path, cycles: Cycles, number: int) -> Moment:
    log = open_log(write_log(path / "drive.mcap", cycles.rows))
    meant = choice.numbered(log, number)
    return moment(log, meant.number, meant.stamp_ns)


@pytest.mark.parametrize(("node", "words"), NODES, ids=[words for _, words in NODES])
def test_a_node_is_named_in_words(node: GraphNode, words: str) -> None:
    assert names.of_node(node) == words


@pytest.mark.parametrize(
    ("left_rad_s", "right_rad_s", "words"),
    [
        (0.0, 0.0, "stand still"),
        (10.0, 10.1, "drive straight ahead"),
        (8.0, 10.0, "drive ahead, bending left"),
        (10.0, 8.0, "drive ahead, bending right"),
        (-2.0, -2.0, "drive straight back"),
        (-2.0, 2.0, "turn left on the spot"),
    ],
)
def test_a_command_is_told_by_how_the_robot_moves(
    left_rad_s: float, right_rad_s: float, words: str
) -> None:
    command = MotorCommand(left_wheel_rad_s=left_rad_s, right_wheel_rad_s=right_rad_s)
    slowed = structs.replace(command, slowed_by=SpeedLimit.BEND)

    assert names.of_command(command) == words
    assert names.of_command(slowed) == f"{words}, slowed by bend"


def test_a_percept_is_placed_as_far_as_it_is_known() -> None:
    known = percept("library")
    without_bearing = structs.replace(known, bearing_sd_rad=4.0)

    assert names.of_percept(known) == "12.0 m, 29° left"
    assert names.of_percept(without_bearing) == "12.0 m"
    assert names.bearing(0.001) == "ahead"
    assert names.bearing(-0.5) == "29° right"


def test_what_is_felt_about_an_object_is_named_with_its_strength() -> None:
    felt = structs.replace(percept("library"), feelings={Feeling.DANGER: 0.5, Feeling.NEED: 0.25})

    assert names.of_feelings(felt) == "danger 0.50, need 0.25"
    assert names.of_feelings(percept("library")) == ""


def test_a_commit_names_each_codelet_with_the_number_of_its_answers() -> None:
    committed = delta(4, Phase.OBJECTS, "4/landmark/a", "4/landmark/b", "4/road_place")

    assert text.committed(committed) == "landmark (2), road place: 1 operation"
    assert text.committed(delta(4, Phase.PERCEPTS)) == "1 operation"


def test_a_bar_is_as_long_as_its_share() -> None:
    assert text.bar(0.0) == " " * text.BAR_CELLS
    assert text.bar(1.0) == "█" * text.BAR_CELLS
    assert text.bar(0.55) == "█████▌    "


def test_what_won_is_compared_with_the_next(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.7, whereabouts=0.45)

    assert reasons.of_competition(cycle(tmp_path, cycles, 1)) == [
        "Novelty won as the most active, 0.25 ahead of whereabouts.",
        "The broadcast was triggered by: one coalition over threshold, 0.70 over 0.45.",
    ]


def test_of_equals_the_first_by_name_wins(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, whereabouts=0.45, novelty=0.45)

    assert reasons.of_competition(cycle(tmp_path, cycles, 1)) == [
        "Novelty won, as active as whereabouts: of equals the first by name wins.",
        "The broadcast was triggered by: aggregate activation over threshold, 0.90 over 0.80.",
    ]


def test_long_silence_triggers_with_its_length(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(6, whereabouts=0.4)

    assert reasons.of_competition(cycle(tmp_path, cycles, 6)) == [
        "Whereabouts won, as nothing else competed.",
        "The broadcast was triggered by: no broadcast for long, 0.50 s where 0.50 s suffice.",
    ]


def test_after_a_broadcast_the_competition_is_refractory(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(2, novelty=0.9)
    found = cycle(tmp_path, cycles, 2)

    assert reasons.of_competition(found) == [
        "It triggered no broadcast, being refractory: the last was 0.10 s before, and 0.20 s must "
        "pass."
    ]
    assert reasons.of_action(found) == [
        "Without a broadcast nothing is chosen: follow route, chosen in cycle 1, continues."
    ]
    assert text.conscious_before(found) == (
        "last, in cycle 1, 0.10 s before: novelty: the agent at (3.0, -1.0) m, heading 0°, library"
    )


def test_what_is_below_every_threshold_is_told_what_it_needed(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(4, whereabouts=0.4)
    (sentence,) = reasons.of_competition(cycle(tmp_path, cycles, 4))

    assert "the strongest coalition had 0.40 and needed more than 0.45" in sentence
    assert "all together had 0.40 and needed more than 0.80" in sentence
    assert "the last broadcast was 0.30 s before, short of 0.50 s" in sentence


def test_thresholds_are_those_that_the_log_was_recorded_with(tmp_path: Path) -> None:
    cycles = Cycles(Config(coalition_above=0.3, aggregate_above=2.0))
    cycles.add(1, novelty=0.4)
    recorded = '{"global_workspace": {"coalition_above": 0.3, "aggregate_above": 2.0}}'
    log = open_log(write_log(tmp_path / "drive.mcap", cycles.rows, config=recorded))

    assert reasons.of_competition(moment(log, 1, cycles.rows[0][1].stamp_ns))[1].endswith(
        "one coalition over threshold, 0.40 over 0.30."
    )


def test_a_cycle_without_coalitions_or_competition_says_so(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(5)
    cycles.add_without_attention(6)

    assert reasons.of_competition(cycle(tmp_path, cycles, 5)) == [
        "It triggered no broadcast: no coalition was left to compete."
    ]
    (tmp_path / "drive.mcap").unlink()
    (sentence,) = reasons.of_competition(cycle(tmp_path, cycles, 6))
    assert "its attention codelets had not answered by its end" in sentence


def test_the_next_best_behaviour_is_the_most_active_of_the_rejected() -> None:
    idle = Behaviour(scheme="rest", activation=0.1, rejection=Rejection.NOT_INSTANTIATED)
    chosen = structs.replace(action(1), behaviours=[idle, *action(1).behaviours])
    following = reasons.next_best(chosen)

    assert following is not None
    assert following.scheme == "halt"
    assert [each.scheme for each in reasons.ranked_behaviours(chosen)] == [
        "follow_route",
        "halt",
        "rest",
    ]


def test_a_broadcast_that_led_to_no_action_says_what_goes_on(tmp_path: Path) -> None:
    cycles = Cycles()
    cycles.add(1, novelty=0.9)
    cycles.add(4, acts=False, novelty=0.9)
    (sentence,) = reasons.of_action(cycle(tmp_path, cycles, 4))

    assert sentence.startswith("The broadcast led to no action")
    assert sentence.endswith("follow route, chosen in cycle 1, continues.")


def test_a_coalition_is_summed_up_by_its_first_nodes() -> None:
    long = coalition("novelty", 0.9, "")
    buildings = [landmark(f"{number}a", names={f"house_{number}": 1.0}) for number in range(9)]
    many = structs.replace(long, nodes=[AGENT, *buildings])

    assert names.brief(long) == "the agent, library"
    assert names.brief(many) == "the agent, house 0, house 1, house 2, house 3, house 4, and 4 more"
