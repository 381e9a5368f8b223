"""Constants that were tuned, halved and doubled."""

from __future__ import annotations

import sys

import pytest

from benchmarks import constants, suite
from benchmarks.constants import CITIES, CONSTANTS, STEREO, TOWN, Job
from cogmap.services.sensory.public import StereoMatcher


def test_each_constant_is_halved_and_doubled_beside_ours() -> None:
    every = constants.planned([TOWN], seeds=2)

    assert len(every) == 2 * (1 + 2 * len(CONSTANTS[TOWN]))
    assert {job.seed for job in every} == {9901, 9902}
    assert Job(TOWN, 9901) in every
    assert Job(TOWN, 9902, "revisit_s", 0.5) in every


def test_errors_are_compared_with_those_by_our_constants() -> None:
    every = [Job(CITIES, 9901), Job(CITIES, 9902)]
    every += [Job(CITIES, seed, "revisit_s", 2.0) for seed in (9901, 9902)]

    metrics = constants.summary(every, [1.0, 3.0, 1.0, 4.0])

    assert metrics == {"cities_error": 2.0, "cities_revisit_s_doubled_over_ours": 1.25}


def test_a_constant_of_stereo_is_changed_for_its_case_alone() -> None:
    module = sys.modules[StereoMatcher.__module__]
    ours = {name: getattr(module, name) for name in CONSTANTS[STEREO]}

    for name in CONSTANTS[STEREO]:
        with constants._constant(Job(STEREO, 9901, name, 2.0)):
            assert getattr(module, name) == 2 * ours[name]

    assert {name: getattr(module, name) for name in CONSTANTS[STEREO]} == ours


@pytest.mark.parametrize("constant", CONSTANTS[TOWN])
def test_each_setting_of_the_codelets_can_be_changed(constant: str) -> None:
    ours = constants._settings(Job(TOWN, 9901, constant, 1.0))
    doubled = constants._settings(Job(TOWN, 9901, constant, 2.0))

    assert doubled[constant] == 2 * ours[constant]
    assert constants._settings(Job(TOWN, 9901)) == {}


def test_what_has_no_threshold_runs_in_all_only_if_it_is_named() -> None:
    usual = {benchmark.name for benchmark in suite.selected([], [])}

    assert {"ablation", "city-maps-people"} <= usual
    assert not {"constants", "city_peer"} & usual
    assert [benchmark.name for benchmark in suite.selected(["constants"], [])] == ["constants"]
