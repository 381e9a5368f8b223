"""Any process of a real drive is killed: the short form of `python -m benchmarks faults`."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from benchmarks.faults.attack import attack
from benchmarks.faults.judge import judged
from benchmarks.faults.parts import FORK_SERVER, ROUTER

SEED = 5


@pytest.mark.parametrize(
    "parts",
    [(FORK_SERVER, "motor", "workspace"), (ROUTER, "global_workspace", "sim")],
    ids=" ".join,
)
def test_a_lockstep_drive_goes_on_and_loses_nothing_whoever_is_killed(
    parts: tuple[str, ...], tmp_path: Path
) -> None:
    attacked = attack(
        tmp_path / "attacked",
        iter(parts),
        SEED,
        is_lockstep=True,
        goes_on=lambda attacked: len(attacked.kills) < len(parts),
    )

    lost = judged(attacked)
    assert [kill.part for kill in attacked.kills] == list(parts)
    assert all(math.isfinite(kill.back_s) for kill in attacked.kills)
    assert attacked.orphans == 0
    assert lost.deltas > 0
    assert lost.lost_deltas_graph == 0
    assert lost.lost_records == 0
    assert lost.wrong_graphs == 0
    restarted = set(parts) - {FORK_SERVER}
    assert attacked.summary["restarts"] == dict.fromkeys(restarted, 1)
