"""The shapes of the town."""

from __future__ import annotations

import pytest

from cogmap.services.sim.rendering.mesh import Mesh, Vertex

CORNER: Vertex = (0.0, 0.0, 0.0)
UVS = [(0.0, 0.0)] * 3


@pytest.mark.parametrize(
    ("others", "normal"),
    [
        pytest.param([(2.0, 0.0, 0.0), (0.0, 3.0, 0.0)], (0.0, 0.0, 1.0), id="seen-from-above"),
        pytest.param([(0.0, 3.0, 0.0), (2.0, 0.0, 0.0)], (0.0, 0.0, -1.0), id="from-below"),
        pytest.param([CORNER, (2.0, 0.0, 0.0)], CORNER, id="without-an-area"),
    ],
)
def test_a_polygon_faces_whoever_sees_its_corners_counter_clockwise(
    others: list[Vertex], normal: Vertex
) -> None:
    mesh = Mesh()
    mesh.polygon([CORNER, *others], UVS)

    assert mesh.normals == [normal] * 3
