"""Where episodes are after their map was corrected, or joined to one that was recalled."""

from __future__ import annotations

import numpy as np
import pytest

from cogmap.schemas.array import Matrix
from cogmap.schemas.graph import DropNode, Phase
from cogmap.schemas.nodes import (
    CORRECTION_ID,
    RECOLLECTION_ID,
    ROOT_MAP,
    Correction,
    Map,
    PathColumn,
    PathSegment,
    Recollection,
    segment_id,
)
from tests.support.world.mind import (
    LOOKS,
    Mind,
    seen,
)


def test_the_episodes_of_a_run_move_into_the_frame_of_the_map_that_it_recalls() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    mind.live((20.0, 4.0), *seen("hall"), cycles=3)
    mind.commit(_recollection("remembered:7", 100.0, 50.0, np.pi))
    mind.commit(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:7"))
    mind.live((80.0, 46.0), *seen("hall"), cycles=3)

    moved, second = mind.episodes()
    assert {moved.map, second.map} == {"remembered:7"}
    assert (moved.x_m, moved.y_m) == pytest.approx((97.0, 46.0))
    assert (second.x_m, second.y_m) == pytest.approx((80.0, 46.0))
    assert second.path[0] == pytest.approx((97.0, 46.0))

    mind.live((97.0, 46.0), *seen(*LOOKS), cycles=3)
    assert [(each.x_m, each.y_m) for each in mind.recalled()] == [(moved.x_m, moved.y_m)]


def test_a_correction_of_the_map_moves_episodes_with_the_path_nearest_to_them() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    mind.live((43.0, 4.0), *seen("hall"), cycles=3)
    rows = [[0.2, 3.0, 3.0, 0.0, 5.0, 9.0, np.pi / 2], [0.8, 40.0, 4.0, 0.0, 40.0, 4.0, 0.0]]
    mind.commit(Correction(id=CORRECTION_ID, rows=Matrix.of(rows)))
    path = PathSegment(id=segment_id(0), number=0, rows=Matrix.of(np.zeros((1, len(PathColumn)))))
    mind.commit(DropNode(id=CORRECTION_ID), path, phase=Phase.CORRECTION)
    mind.live((43.0, 4.0), *seen("hall"), cycles=3)

    first, second = mind.episodes()
    assert (first.x_m, first.y_m) == pytest.approx((4.0, 9.0))
    assert (second.x_m, second.y_m) == pytest.approx((43.0, 4.0))
    assert second.path[0] == pytest.approx((4.0, 9.0))

    mind.live((4.0, 9.0), *seen(*LOOKS), cycles=3)
    assert [each.number for each in mind.recalled()] == [first.number]


def test_a_correction_that_is_outdated_moves_no_episode() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    rows = [[0.2, 3.0, 3.0, 0.0, 5.0, 9.0, 0.0]]
    mind.commit(Correction(id=CORRECTION_ID, rows=Matrix.of(rows)))
    mind.commit(DropNode(id=CORRECTION_ID), phase=Phase.CORRECTION)
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)

    (episode,) = mind.episodes()
    assert (episode.x_m, episode.y_m) == (3.0, 4.0)


def test_episodes_of_a_frame_that_nobody_knows_any_more_are_forgotten() -> None:
    mind = Mind()
    mind.live((3.0, 4.0), *seen(*LOOKS), cycles=3)
    mind.commit(Map(id=ROOT_MAP, cell_m=1.0, remembered="remembered:7"))
    mind.live((80.0, 46.0), *seen("hall"), cycles=3)

    assert [episode.number for episode in mind.episodes()] == [2]


def _recollection(name: str, x_m: float, y_m: float, heading_rad: float) -> Recollection:
    return Recollection(
        id=RECOLLECTION_ID,
        map=name,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        labels=["12a"],
        names=["mill"],
        given_names=[""],
        functions=[""],
        matched=["mill"],
        objects=Matrix.of(np.ones((1, 7))),
    )
