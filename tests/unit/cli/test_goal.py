"""Goals as a person writes them."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from click.testing import CliRunner

from cogmap.cli.goal import goal, misspellings, parsed, plan_json, plan_text, read_goals
from cogmap.errors import UsageError
from cogmap.schemas.nodes import PLAN_ID, Plan, PlanState, goal_id
from cogmap.testing import graph_of, landmark


def test_two_numbers_are_a_position_and_other_words_names() -> None:
    bakery, place, school = parsed(["bakery", "12.5", "-3", "school"])

    assert (bakery.id, bakery.object) == (goal_id("bakery"), "bakery")
    assert (place.object, place.x_m, place.y_m) == ("", 12.5, -3.0)
    assert school.object == "school"


@pytest.mark.parametrize("words", [["12.5"], ["1", "bakery"], ["bakery", "3"]])
def test_a_number_alone_is_refused(words: list[str]) -> None:
    with pytest.raises(UsageError, match="a position is X and Y"):
        parsed(words)


@pytest.mark.parametrize("word", ["inf", "nan", "1e9"])
def test_an_absurd_position_is_refused(word: str) -> None:
    with pytest.raises(UsageError, match="is no position"):
        parsed([word, "0"])


def test_a_word_like_an_option_is_no_name() -> None:
    with pytest.raises(UsageError, match="there is no option --clera"):
        parsed(["--clera", "bakery"])


def test_a_position_may_be_negative_on_the_command_line() -> None:
    result = CliRunner().invoke(goal, ["-25"])

    assert str(result.exception) == "-25 is a number alone: a position is X and Y, in metres"


def test_a_goal_reached_before_it_was_planned_is_said() -> None:
    plan = Plan(id=PLAN_ID, state=PlanState.AT_GOAL)
    reached = [goal_id("12,0")]

    text = plan_text(plan, graph_of(plan), reached)
    summary = msgspec.json.decode(plan_json(plan, graph_of(plan), reached))

    assert text == "12,0: reached"
    assert summary["reached"] == ["12,0"]


def test_a_file_has_a_goal_a_line(tmp_path: Path) -> None:
    path = tmp_path / "goals.txt"
    path.write_text("bakery\n\n3 4\n", "utf-8")

    assert [goal.id for goal in read_goals(path)] == [goal_id("bakery"), goal_id("3,4")]


def test_a_name_of_several_words_is_one_goal_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "goals.txt"
    path.write_text("our school\n3 4\n", "utf-8")

    assert [goal.id for goal in read_goals(path)] == [goal_id("our school"), goal_id("3,4")]


def test_a_file_without_goals_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "goals.txt"
    path.write_text("\n \n", "utf-8")

    with pytest.raises(UsageError, match=r"goals\.txt has no goals: write one a line"):
        read_goals(path)


def test_the_line_that_is_wrong_is_named(tmp_path: Path) -> None:
    path = tmp_path / "goals.txt"
    path.write_text("bakery\n3\n", "utf-8")

    with pytest.raises(UsageError, match="line 2"):
        read_goals(path)


def test_for_a_goal_that_is_not_on_the_map_the_nearest_object_is_suggested() -> None:
    unknown = PlanState.UNKNOWN_GOAL
    plan = Plan(id=PLAN_ID, state=unknown, unreachable={goal_id("bakry"): unknown})
    bakery = landmark("bakery", [(1.0, 2.0)])
    graph = graph_of(plan, bakery)

    text = plan_text(plan, graph)
    summary = msgspec.json.decode(plan_json(plan, graph))

    assert text == "bakry: the map has no object of that name: did you mean 'bakery'?"
    assert summary["unreachable"] == {"bakry": unknown.value}
    assert summary["nearest"] == {"bakry": "bakery"}


def test_a_misspelt_goal_is_found_with_the_name_that_is_meant() -> None:
    plan = Plan(
        id=PLAN_ID,
        state=PlanState.UNKNOWN_GOAL,
        unreachable={
            goal_id("bakry"): PlanState.UNKNOWN_GOAL,
            goal_id("harbour"): PlanState.UNKNOWN_GOAL,
            goal_id("bakery"): PlanState.BLOCKED,
        },
    )
    graph = graph_of(landmark("41a", [(3.0, 4.0)], names={"bakery": 5.0}), plan)

    assert misspellings(plan, graph) == {goal_id("bakry"): "bakery"}
