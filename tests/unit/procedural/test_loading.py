"""Schemes are read from TOML, and wrong ones are named by file and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from cogmap.errors import ConfigError
from cogmap.schemas.cognition import ActionName
from cogmap.schemas.feelings import Feeling
from cogmap.schemas.nodes import PlanState
from cogmap.services.procedural.loading import BUILT_IN, load
from tests.support.world.schemes import FOLLOW, HEADER, written

SECOND = """
[[scheme]]
name = "dock"
# a dock is where "turn_rad" means nothing
action = "dock"
context = [
    { kind = "goal", as = "target" },
    { kind = "self" },
]
adding = [{ kind = "goal", as = "target", salience = 0.5 }]
parameters = { x_m = "$target.x_m", y_m = "$target.y_m" }
"""


def _line_of(text: str, part: str) -> int:
    """The number of the first line with a text in it, from 1."""
    lines = text.splitlines()
    return next(number for number, line in enumerate(lines, 1) if part in line)


def test_the_built_in_schemes_drive_the_plan_halt_and_satisfy_needs() -> None:
    follow, halt, satisfy = load(BUILT_IN)

    assert (follow.name, follow.action) == ("follow_route", ActionName.FOLLOW_PLAN)
    assert (halt.name, halt.action) == ("halt", ActionName.HALT)
    assert [pattern.kind for pattern in follow.context] == ["self", "plan"]
    assert follow.context[1].conditions[0].values == (PlanState.READY,)
    assert (satisfy.name, satisfy.action) == ("satisfy_need", ActionName.SEEK)
    assert [pattern.kind for pattern in satisfy.context] == ["need", "object"]


def test_a_plan_is_driven_in_one_state_and_calls_for_a_halt_in_all_others() -> None:
    follow, halt, *_ = load(BUILT_IN)
    driven = follow.context[1].conditions[0].values
    halted = halt.context[0].conditions[0].values

    assert {*driven, *halted} == {*PlanState}
    assert len(driven) + len(halted) == len(PlanState)


@pytest.mark.parametrize(
    ("good", "bad", "complaint"),
    [
        ('"goal", as = "target" },', '"gaol", as = "target" },', "node kind 'gaol': did you mean"),
        ('action = "dock"', 'action = "fly"', "action 'fly': there are follow_plan, turn, dock"),
        ('action = "dock"', 'action = "dok"', r"action 'dok': did you mean 'dock'\?"),
        ('kind = "self" }', 'kind = "self", moood = 1 }', "field of self 'moood'"),
        ('kind = "self" }', 'kind = "self", map = 1 }', r"wrong value of self\.map: 1: Expected"),
        ('kind = "self" }', 'kind = "plan", state = "redy" }', "'redy' is none of ready, at_goal"),
        ('kind = "self" }', 'kind = "self", x_m = { above = 1 } }', "bound 'above'"),
        ('kind = "self" }', 'kind = "self", x_m = { at_least = "a" } }', "bound 'a', which is no"),
        ('kind = "self" }', 'label = "house" }', "pattern without a kind"),
        ('"$target.y_m"', '"$target.z_m"', "field of goal 'z_m'"),
        ('"$target.y_m"', '"$aim.y_m"', "variable 'aim': there are target"),
        ('as = "target", salience', 'as = "goal", salience', "variable 'goal': there are target"),
        ("y_m = ", "ym = ", r"unknown parameter of dock 'ym': did you mean 'y_m'\?"),
        ('"$target.y_m"', '"left"', "parameter y_m 'left', which is no number"),
        ('"$target.y_m"', "true", "parameter y_m True, which is no number"),
        ('"$target.y_m"', '"$target.object"', r"y_m '\$target.object', which is no number"),
        (', y_m = "$target.y_m"', "", "lacks the parameter 'y_m' of dock"),
        ('kind = "self" }', 'kind = "need", label = "enregy" }', r"need 'enregy': did .* 'energy'"),
        ('kind = "self" }', 'kind = "goal", need = "enegry" }', r"need 'enegry': did .* 'energy'"),
        ('kind = "self" }', 'kind = "object", function = "chrage" }', r"did you mean 'charge'\?"),
        ('kind = "self" }', 'kind = "self", feeling = "dagner" }', r"did you mean 'danger'\?"),
        ("salience = 0.5", 'feeling = "need", salience = 0.5', "a feeling among its results"),
        ("salience = 0.5", "salience = 1.5", r"salience 1\.5: write one from -1 to 1"),
        ("parameters =", "params =", "unknown field `params`"),
        ("parameters =", "within_s = 0.0\nparameters =", "> 0.0"),
        ('name = "dock"', 'name = "follow"', "two schemes are named 'follow'"),
    ],
)
def test_what_is_wrong_is_named_by_file_and_line(
    good: str, bad: str, complaint: str, tmp_path: Path
) -> None:
    assert good in SECOND
    text = HEADER + FOLLOW + SECOND.replace(good, bad)
    path = written(tmp_path, text)
    number = _line_of(HEADER + FOLLOW + SECOND.replace(good, f"@{bad}"), "@")

    with pytest.raises(ConfigError, match=complaint) as caught:
        load(path)

    assert str(caught.value).startswith(f"{path}:{number}: ")


def test_a_scheme_without_a_context_is_refused(tmp_path: Path) -> None:
    text = '[[scheme]]\nname = "a"\naction = "halt"\ncontext = []\n'

    with pytest.raises(ConfigError, match=r":4: scheme 'a' has no context"):
        load(written(tmp_path, text))


SEEK = """
[[scheme]]
name = "seek"
action = "seek"
context = [
    { kind = "need", label = "water", as = "thirst" },
    { kind = "object", function = "well", as = "well" },
]
parameters = { need = "water", object = "$well.label" }
"""


def test_a_need_and_a_function_of_ones_own_are_known_once_they_are_declared(
    tmp_path: Path,
) -> None:
    needs = 'own_needs = ["water"]\n'
    functions = 'own_functions = ["well"]\n'

    (scheme,) = load(written(tmp_path, needs + functions + SEEK))

    assert scheme.parameters["need"] == "water"
    with pytest.raises(ConfigError, match="unknown need 'water'"):
        load(written(tmp_path, functions + SEEK))
    with pytest.raises(ConfigError, match="unknown function 'well'"):
        load(written(tmp_path, needs + SEEK))


def test_the_need_that_is_sought_for_is_one_that_there_is(tmp_path: Path) -> None:
    text = SEEK.replace('"water", as', '"energy", as').replace('"well", as', '"charge", as')

    with pytest.raises(ConfigError, match="unknown need 'water'"):
        load(written(tmp_path, text))


def test_a_goal_that_serves_no_need_may_be_named(tmp_path: Path) -> None:
    (scheme,) = load(
        written(tmp_path, HEADER + FOLLOW.replace("ready", 'ready" }, {kind="goal", need="'))
    )

    assert str(scheme.context[1].conditions[0]) == "need="


def test_the_places_of_a_path_are_numbered_on(tmp_path: Path) -> None:
    names = [f"{name}_{number}_m = 1.0" for number in (1, 2, 3) for name in ("ahead", "left")]
    places = ", ".join(names)
    text = HEADER + FOLLOW.replace("follow_plan", "guide")

    (scheme,) = load(written(tmp_path, f"{text}parameters = {{ seen_ns = 5, {places} }}\n"))

    assert len(scheme.parameters) == 7
    with pytest.raises(ConfigError, match=r"seen_ns 5\.5, which is no whole number"):
        load(written(tmp_path, f"{text}parameters = {{ seen_ns = 5.5, {places} }}\n"))


def test_feelings_are_conditions_of_the_context(tmp_path: Path) -> None:
    text = FOLLOW.replace('state = "ready"', 'state = "ready", feeling = ["lost", "danger"]')
    (scheme,) = load(written(tmp_path, HEADER + text))

    assert scheme.context[0].feelings == (Feeling.LOST, Feeling.DANGER)
    assert scheme.context[0].spelled({}) == "plan state=ready feeling=lost|danger"


def test_a_generic_kind_has_any_field_once_it_is_declared(tmp_path: Path) -> None:
    declared = load(written(tmp_path, HEADER + FOLLOW))

    assert declared[0].adding[0].pattern.conditions[0].values == ("green",)
    with pytest.raises(ConfigError, match="node kind 'sign'"):
        load(written(tmp_path, FOLLOW))


def test_an_action_of_ones_own_is_known_once_it_is_declared(tmp_path: Path) -> None:
    text = HEADER + FOLLOW.replace("follow_plan", "open_door")

    (scheme,) = load(written(tmp_path, 'own_actions = ["open_door"]\n' + text))

    assert scheme.action == "open_door"
    with pytest.raises(ConfigError, match="action 'open_door'"):
        load(written(tmp_path, text))


@pytest.mark.parametrize(
    ("content", "complaint"),
    [(b"[[scheme", "as TOML"), (b"\xff\xfe", "as TOML"), (b"name = 1", "unknown field `name`")],
)
def test_what_is_no_file_of_schemes_is_refused(
    content: bytes, complaint: str, tmp_path: Path
) -> None:
    path = tmp_path / "schemes.toml"
    path.write_bytes(content)

    with pytest.raises(ConfigError, match=complaint):
        load(path)


def test_a_file_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no file of schemes .*none\.toml"):
        load(tmp_path / "none.toml")
