"""The ablation: which rules its variants have, short drives with each, and what is told of them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from cogmap.errors import CogmapError
from cogmap.experiments.ablation import recorded
from cogmap.experiments.ablation.errands import GOALS, Errands, drawn
from cogmap.experiments.ablation.measure import Domain, measure
from cogmap.experiments.ablation.metrics import ablation_metrics
from cogmap.experiments.ablation.outcome import Outcome, carried
from cogmap.experiments.ablation.town import TownDrive
from cogmap.experiments.ablation.variants import (
    LABELS,
    OURS,
    PAPER,
    VARIANTS,
    Rules,
    with_variant,
)
from cogmap.runtime.config import Sections
from cogmap.services.codelets import rules as presets
from cogmap.services.codelets.rules import PRESETS, RULES, rules_of
from tests.support.recordings import mrclam_folder

A_FEW_METRES = 0.02


@dataclass(frozen=True)
class Reckoned:
    """A case whose outcome is reckoned: its error grows with each rule that is not ours."""

    ours: float

    def drive(self, rules: Rules) -> Outcome:
        return Outcome(self.ours + len(rules), fused=2.0, wheels=4.0, is_lost=False)


@dataclass(frozen=True)
class Unfinished:
    """A case that only our rules drive to its end."""

    def drive(self, rules: Rules) -> Outcome:
        if rules:
            raise CogmapError("no loop was closed on the path")
        return Outcome(1.0, fused=2.0, wheels=4.0, is_lost=False)


def _quiet(share: float) -> None:
    """Show no progress."""


def test_each_variant_takes_one_addition_away() -> None:
    single = {item for rules in VARIANTS.values() if len(rules) == 1 for item in rules.items()}

    others = {("correct", "positions"), ("localization", "spiking")}
    assert single == {*PRESETS["paper"].items(), *others}
    assert VARIANTS[OURS] == {}
    assert rules_of(with_variant({}, VARIANTS[PAPER])) == PRESETS["paper"]
    assert [*LABELS] == [*VARIANTS]


def test_a_variant_changes_no_other_rule_or_setting() -> None:
    sections: Sections = {
        "codelets": {"correct": "heading", "samples": 500},
        "sim": {"seed": 3},
    }

    changed = with_variant(sections, {"correct": "eq9"})

    assert changed == {"codelets": {"correct": "eq9", "samples": 500}, "sim": {"seed": 3}}
    assert sections["codelets"]["correct"] == "heading"
    assert rules_of(changed) == PRESETS[presets.OURS] | {"correct": "eq9"}
    assert {*VARIANTS[PAPER]} == {*RULES}


def test_a_town_is_driven_by_our_rules_and_by_the_papers() -> None:
    domains = [Domain("town", "town", "m", [TownDrive(1, laps=A_FEW_METRES)], plans=True)]
    variants = {name: VARIANTS[name] for name in (OURS, PAPER)}

    measured = measure(domains, 1, _quiet, variants)

    assert measured["town", PAPER] != measured["town", OURS]
    for (outcome,) in measured.values():
        assert not outcome.failure
        assert not outcome.is_lost
        assert 0 < outcome.error < 1
        assert outcome.fused < outcome.wheels


def test_a_drive_that_its_time_ends_is_lost() -> None:
    outcome = TownDrive(1, laps=A_FEW_METRES, limit_s=2.0).drive({})

    assert outcome.is_lost
    assert outcome.error < 1


def test_errands_that_its_time_ends_have_no_way() -> None:
    outcome = Errands(2, limit_s=2.0).drive({})

    assert outcome.is_lost
    assert np.isnan(outcome.error)


def test_the_shortest_way_past_all_goals_is_no_shorter_than_to_the_farthest() -> None:
    town = Errands(2).town
    goals_m, shortest_m = drawn(town)
    away_m = np.hypot(*(goals_m - (town.start.x_m, town.start.y_m)).T)

    assert len(np.unique(goals_m, axis=0)) == GOALS
    assert away_m.max() < shortest_m < 2 * away_m.sum()
    assert drawn(Errands(2).town)[1] == shortest_m


def test_a_way_is_named_so_among_the_metrics() -> None:
    cases = [Reckoned(1.0), Reckoned(1.5)]
    domain = Domain("errands", "errands", "over_shortest", cases, plans=True, quantity="way")

    metrics = ablation_metrics([domain], measure([domain], 1, _quiet))

    assert metrics["errands_ours_way_over_shortest_mean"] == 1.25
    assert metrics["planning_gradient_over_ours_errands_mean"] == pytest.approx((2 + 2.5 / 1.5) / 2)


def test_a_recorded_robot_is_measured_beside_its_wheels(tmp_path: Path) -> None:
    (drive,) = recorded.of_set(mrclam_folder(tmp_path / "set", times=8))

    outcome = drive.drive(VARIANTS[OURS])

    assert 0 < outcome.error < 1
    assert outcome.error != outcome.fused
    assert 0 < outcome.fused == outcome.wheels


def test_a_set_without_truth_says_so(tmp_path: Path) -> None:
    folder = mrclam_folder(tmp_path / "set", times=8)
    (folder / "Robot1_Groundtruth.dat").write_text("0 0.0 0.0 0.0\n1 0.0 0.0 0.0\n")
    (drive,) = recorded.of_set(folder)

    with pytest.raises(CogmapError, match="too few places"):
        drive.drive(VARIANTS[OURS])


def test_an_aligned_path_has_no_error_for_a_frame_of_its_own() -> None:
    true_m = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 1.0)])
    turned_m = np.array([(5.0, 1.0), (5.0, 4.0), (4.0, 4.0)])

    assert recorded.aligned_error_m(turned_m, true_m) == pytest.approx(0.0, abs=1e-9)


def test_a_case_that_ends_early_is_lost_and_its_cell_filled() -> None:
    domains = [Domain("loop", "loop", "m", [Unfinished(), Reckoned(1.0)])]

    metrics = ablation_metrics(domains, measure(domains, 1, _quiet))

    assert metrics["cells"] == metrics["cells_filled"]
    assert metrics["loop_ours_lost"] == 0
    assert metrics["loop_paper_lost"] == metrics["loop_paper_without_number"] == 1
    assert metrics["loop_paper_failure"] == "no loop was closed on the path"
    assert metrics["loop_paper_runs"] == 2
    assert metrics["loop_paper_error_m_mean"] == 4
    assert metrics["loop_paper_error_m_sd"] is None


def test_a_cell_without_any_number_has_none_in_json() -> None:
    domains = [Domain("loop", "loop", "m", [Unfinished()])]

    metrics = ablation_metrics(domains, measure(domains, 1, _quiet))

    assert metrics["loop_paper_error_m_mean"] is None
    assert metrics["paper_over_ours_loop_mean"] is None
    assert "NaN" not in json.dumps(metrics)


def test_path_integration_has_no_cell_where_no_errors_are_measured() -> None:
    errands = Domain("errands", "errands", "over", [Reckoned(1.0)], plans=True, quantity="way")

    metrics = ablation_metrics([errands], measure([errands], 1, _quiet))

    assert metrics["errands_ours_way_over_mean"] == 1
    assert not any("fused" in name or "wheels" in name for name in metrics)


def test_errors_are_compared_case_by_case() -> None:
    cases = [Reckoned(1.0), Reckoned(4.0)]
    domains = [Domain("town", "town", "m", cases, plans=True)]

    metrics = ablation_metrics(domains, measure(domains, 1, _quiet))

    assert metrics["town_ours_error_m_mean"] == 2.5
    assert metrics["town_ours_over_fused_mean"] == 1.25
    assert metrics["town_ours_wheels_error_m_mean"] == 4
    assert metrics["paper_over_ours_town_mean"] == pytest.approx((5 / 1 + 8 / 4) / 2)
    assert metrics["paper_over_ours_town_sd"] == pytest.approx(1.5 * 2**0.5)


def test_one_case_far_out_does_not_move_the_median() -> None:
    cases = [Reckoned(1.0), Reckoned(2.0), Reckoned(900.0)]
    domains = [Domain("town", "town", "m", cases, plans=True)]

    metrics = ablation_metrics(domains, measure(domains, 1, _quiet))

    assert metrics["town_ours_error_m_median"] == 2
    assert metrics["town_ours_error_m_mean"] == 301


def test_planning_counts_only_where_the_agent_plans_its_way() -> None:
    carried_along = Domain("loop", "loop", "m", [Reckoned(1.0)])
    planned = Domain("town", "town", "m", [Reckoned(1.0)], plans=True)

    measured = measure([carried_along, planned], 1, _quiet)

    assert measured["loop", "planning_gradient"] == measured["loop", OURS]
    assert measured["town", "planning_gradient"] != measured["town", OURS]


def test_a_robot_that_errs_twice_as_much_as_self_motion_is_lost() -> None:
    assert not carried(1.9, 1.0, 3.0).is_lost
    assert carried(2.1, 1.0, 3.0).is_lost
    assert carried(float("nan"), 1.0, 3.0).is_lost
