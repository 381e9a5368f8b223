"""A place to drive in: streets, buildings and props, and where the robot begins. Pure."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

from cogmap.geometry.arrays import Floats
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Building, Obstacle, Pose, Street, TrueTown
from cogmap.services.sim.layout.boundaries import kerbs, outlines
from cogmap.services.sim.layout.catalogue import FLAT_M
from cogmap.services.sim.layout.furniture import CHARGING_PLACE, Prop
from cogmap.services.sim.layout.plan import Plot, Point, Road


@dataclass(frozen=True)
class Place:
    """Streets, buildings, and props such as trees, and where the robot begins."""

    seed: int
    roads: tuple[Road, ...]
    plots: tuple[Plot, ...]
    props: tuple[Prop, ...]
    start: Pose

    @cached_property
    def kerbs_m(self) -> Floats:
        """Return the (n, 4) segments that bound the streets' surface, x and y of both ends."""
        return kerbs(self.roads)

    @cached_property
    def walls_m(self) -> Floats:
        """Return the (n, 4) outer walls of the buildings, in the order of `plots`."""
        return outlines([plot.corners for plot in self.plots])

    @property
    def charging_places(self) -> list[Prop]:
        """Return the props at which the robot's battery is charged."""
        return [prop for prop in self.props if prop.kind == CHARGING_PLACE]

    @property
    def charging_places_m(self) -> list[Point]:
        """Return where the charging places stand."""
        return [(prop.x_m, prop.y_m) for prop in self.charging_places]

    def message(self, closed: Collection[str] = (), gone: Collection[int] = ()) -> TrueTown:
        """Return the place as a message, with the streets named in `closed` closed, and without the
        buildings numbered in `gone`.
        """
        streets = []
        for road in self.roads:
            line_m = [road.start, road.end]
            is_closed = road.name in closed
            streets.append(
                Street(name=road.name, line_m=line_m, width_m=road.width_m, closed=is_closed)
            )

        standing = [plot for number, plot in enumerate(self.plots) if number not in gone]
        buildings = []
        for plot in standing:
            building = Building(
                name=plot.kind.name,
                pose=Pose(x_m=plot.x_m, y_m=plot.y_m, heading_rad=plot.heading_rad),
                width_m=plot.kind.width_m,
                depth_m=plot.kind.depth_m,
                height_m=plot.kind.height_m,
                roof_rise_m=FLAT_M if plot.outline else plot.kind.roof_rise_m,
                district=plot.district,
                function=plot.function,
                outline_m=list(plot.outline),
            )
            buildings.append(building)

        obstacles = []
        for prop in self.props:
            length_m, width_m, height_m = prop.size_m
            obstacle = Obstacle(
                kind=prop.kind,
                pose=Pose(x_m=prop.x_m, y_m=prop.y_m, heading_rad=prop.heading_rad),
                length_m=length_m,
                width_m=width_m,
                height_m=height_m,
            )
            obstacles.append(obstacle)

        return TrueTown(
            seed=self.seed,
            streets=streets,
            buildings=buildings,
            obstacles=obstacles,
            kerbs_m=Array.of(self.kerbs_m, "<f4"),
            walls_m=Array.of(outlines([plot.corners for plot in standing]), "<f4"),
        )
