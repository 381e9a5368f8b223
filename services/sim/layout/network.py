"""A network of streets without houses, as street maps without buildings have it. Pure."""

from __future__ import annotations

from typing import Annotated

import msgspec

from cogmap.schemas.base import Coordinate, Finite, PositiveMetres
from cogmap.schemas.sensing import Pose
from cogmap.services.sim.layout.place import Place
from cogmap.services.sim.layout.plan import STREET_WIDTH_M, Road
from cogmap.services.sim.trajectory import Landmark


class StreetNetwork(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Straight pieces of streets, the landmarks along them, and where the robot begins.

    Nothing stands in the robot's way: it keeps to the streets if its commands do.
    """

    pieces_m: Annotated[
        list[tuple[Coordinate, Coordinate, Coordinate, Coordinate]],
        msgspec.Meta(min_length=1, description="Both ends of each piece, x, y, x and y in m."),
    ]
    landmarks: Annotated[list[Landmark], msgspec.Meta(description="Buildings along the streets.")]
    start: Annotated[
        tuple[Coordinate, Coordinate, Finite],
        msgspec.Meta(description="Where the robot begins, x and y in m, and its heading in rad."),
    ]
    width_m: Annotated[
        PositiveMetres, msgspec.Meta(description="Width between the kerbs of each, in m.")
    ] = STREET_WIDTH_M

    def place(self) -> Place:
        """Make a place of the streets, without buildings."""
        roads = []
        for number, (x_m, y_m, to_x_m, to_y_m) in enumerate(self.pieces_m, start=1):
            roads.append(Road(f"street {number}", (x_m, y_m), (to_x_m, to_y_m), self.width_m))

        x_m, y_m, heading_rad = self.start
        return Place(
            seed=0,
            roads=tuple(roads),
            plots=(),
            props=(),
            start=Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad),
        )
