"""Drives by the paper's own rules and by spikes: the modules of the town on the in-memory bus."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.experiments.loop_closing import run as loop_closing
from cogmap.experiments.loop_closing.observer import Loop
from cogmap.experiments.loop_closing.run import MODULES, driven, sections
from cogmap.runtime.config import Sections
from cogmap.services import registry
from cogmap.services.codelets.rules import PRESETS, rules_of

BLOCK_M = [(0.0, 0.0), (60.0, 0.0), (60.0, 40.0), (0.0, 40.0), (0.0, 0.0), (30.0, 0.0)]
BUILDINGS_M = [(45.0, 12.0), (72.0, 52.0), (-12.0, 48.0), (-8.0, -12.0)]


def _small(rules: str) -> Sections:
    """Once round a block with four buildings, and a bit of it again."""
    configured = sections(1, "positions", rules)
    landmarks = [
        {"name": f"building-{number:02d}", "x_m": x_m, "y_m": y_m}
        for number, (x_m, y_m) in enumerate(BUILDINGS_M)
    ]
    configured["sim"]["trajectory"] |= {"line_m": BLOCK_M, "landmarks": landmarks}
    configured["codelets"]["samples"] = 200
    return configured


def _driven(configured: Sections) -> Loop:
    return driven(configured, [registry.build(name, configured) for name in MODULES])


def test_the_preset_reaches_every_rule_of_a_drive() -> None:
    assert rules_of(_small("paper")) == PRESETS["paper"]
    assert rules_of(_small("cogmap")) == PRESETS["cogmap"] | {"correct": "positions"}
    assert rules_of(_small("spiking"))["localization"] == "spiking"
    assert rules_of(sections(1, "heading", "paper"))["correct"] == "heading"


def test_a_drive_by_the_papers_rules_closes_its_loop_by_one_sighting() -> None:
    loop = _driven(_small("paper"))

    assert [replay.passes for replay in loop.replays] == [10]
    assert loop.after.path_error_m < 0.7 * loop.before.path_error_m
    assert loop.end.true_path_m[-1] == pytest.approx(BLOCK_M[-1], abs=loop_closing.SPEED_M_S)


def test_a_drive_by_spikes_stays_near_the_truth_and_repeats_to_the_bit() -> None:
    first, again = (_driven(_small("spiking")) for _ in range(2))

    assert first.end.end_error_m < 0.5 * _alone_m(first)
    assert np.array_equal(first.end.path_m, again.end.path_m)


def _alone_m(loop: Loop) -> float:
    """How far self-motion alone is from the truth in the end."""
    away_m = loop.fused_path_m[-1] - loop.end.true_path_m[-1]
    return float(np.hypot(*away_m))
