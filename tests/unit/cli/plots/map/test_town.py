"""The true town on the map."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from cogmap.cli.plots.map.town import draw_town
from cogmap.cli.plots.palette import CLOSED
from cogmap.schemas.sensing import Building, Obstacle, Pose, Street, TrueTown
from cogmap.services.sim.layout.furniture import CHARGING_PLACE

LINE_M = [(0.0, 0.0), (40.0, 0.0)]


def _building(number: int, **changes) -> Building:
    pose = Pose(x_m=10.0 * number, y_m=8.0, heading_rad=0.0)
    return Building(
        name=f"home_{number}", pose=pose, width_m=8.0, depth_m=6.0, height_m=5.0, **changes
    )


def _drawn(buildings: list[Building], closed: bool = False) -> Axes:
    street = Street(name="Elm Street 1", line_m=LINE_M, width_m=8.0, closed=closed)
    axes = Figure().add_subplot()
    draw_town(axes, TrueTown(seed=1, streets=[street], buildings=buildings))
    return axes


def _colours(axes: Axes) -> list[tuple[float, float, float]]:
    return [patch.get_facecolor()[:3] for patch in axes.patches]


def test_the_buildings_of_a_district_share_a_tint() -> None:
    hill = [_building(number, district="Garden Hill") for number in range(2)]
    market = [_building(number, district="Old Market") for number in range(2, 4)]
    colours = _colours(_drawn([*hill, *market]))[-4:]

    assert colours[0] == colours[1]
    assert colours[2] == colours[3]
    assert colours[0] != colours[2]


def test_a_closed_street_has_a_barrier() -> None:
    assert to_rgb(CLOSED) not in _colours(_drawn([]))
    assert to_rgb(CLOSED) in _colours(_drawn([], closed=True))


def test_a_charging_place_has_a_marker_where_it_stands() -> None:
    pose = Pose(x_m=12.0, y_m=4.5, heading_rad=0.0)
    post = Obstacle(kind=CHARGING_PLACE, pose=pose, length_m=0.6, width_m=0.6, height_m=2.6)
    axes = Figure().add_subplot()
    draw_town(axes, TrueTown(seed=1, streets=[], buildings=[], obstacles=[post]))

    (marker,) = axes.lines
    assert marker.get_xydata().tolist() == [[12.0, 4.5]]


def test_a_building_that_is_no_rectangle_has_its_outline() -> None:
    outline_m = [(0.0, 0.0), (9.0, 0.0), (9.0, 8.0)]
    axes = _drawn([_building(0, outline_m=outline_m)])
    (polygon,) = [patch for patch in axes.patches if isinstance(patch, Polygon)]

    assert polygon.get_xy()[:3].tolist() == [list(corner) for corner in outline_m]


def test_the_legend_has_what_there_is_and_no_more() -> None:
    axes = Figure().add_subplot()
    street = Street(name="Elm Street 1", line_m=LINE_M, width_m=8.0)
    closed = Street(name="Elm Street 2", line_m=LINE_M, width_m=8.0, closed=True)
    homes = [_building(0), _building(1, district="Garden Hill")]

    def legend_of(*streets: Street) -> list[str]:
        town = TrueTown(seed=1, streets=list(streets), buildings=homes)
        return [handle.get_label() for handle in draw_town(axes, town)]

    homes_are = ["building", "building of Garden Hill"]
    assert legend_of(street) == ["street", *homes_are]
    assert legend_of(street, closed) == ["street", "barrier: the street is closed", *homes_are]
