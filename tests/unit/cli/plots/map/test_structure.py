"""The map's layers of structure."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cogmap.cli.launch.observer import Observer
from cogmap.cli.plots.map.structure import draw_structure
from cogmap.schemas.array import Array
from cogmap.schemas.graph import Cells, Links
from cogmap.schemas.nodes import ROOT_MAP, LinkKind, Map, PlaceColumn, map_id
from cogmap.testing import graph_of, landmark


def test_the_road_on_the_grid_of_a_sub_map_is_drawn_where_it_is_on_the_root_map() -> None:
    corners = [landmark(name, [where]) for name, where in zip("abc", np.eye(3, 2) * 9, strict=True)]
    within = Links(kind=LinkKind.WITHIN, weights={node.id: {map_id(1): 1.0} for node in corners})
    sub_map = Map(
        id=map_id(1), parent=ROOT_MAP, cell_m=2.0, x_m=10.0, y_m=5.0, heading_rad=np.pi / 2
    )
    road = Cells(
        map=sub_map.id,
        column=PlaceColumn.ROAD,
        cells=Array.of([[3, 1], [0, 0]], "<i4"),
        values=Array.of(np.array([1.0, 0.1], np.float32)),
    )
    axes = Figure().add_subplot()
    legend = draw_structure(axes, Observer(), graph_of(*corners, within, sub_map, road))

    drawn_m = np.vstack([line.get_xydata() for line in axes.lines])
    np.testing.assert_allclose(drawn_m, [[8.0, 11.0]])
    assert [line.get_label() for line in legend] == ["sub-map, and the road on its own grid"]
