"""Builds the parts of a place in pybullet: its ground, streets, buildings and props."""

from __future__ import annotations

from collections.abc import Sequence

from cogmap.services.sim.layout.furniture import Prop
from cogmap.services.sim.layout.plan import Plot, Road
from cogmap.services.sim.rendering import mesh, prop_shapes, scenery
from cogmap.services.sim.scene.bodies import NOT_SOLID, Bodies


class Builder:
    """Adds parts of a place to `bodies`, and returns which bodies these are."""

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        grass, *layers = scenery.pictures()
        self._grass = bodies.texture(grass)
        self._layers = [bodies.texture(picture) for picture in layers]

    def soil(self) -> int:
        """Add the ground around and between the streets, which carries the robot."""
        half_m = (scenery.GROUND_M, scenery.GROUND_M, 1.0)
        floor = self._bodies.box(half_m, middle_m=-1.0)
        model = self._bodies.painted(scenery.grass(), self._grass)

        return self._bodies.add(model, floor)

    def sky(self) -> int:
        """Add the ring of hills and clouds."""
        return self._bodies.add(self._bodies.model(*scenery.sky()))

    def streets(self, roads: Sequence[Road]) -> list[int]:
        """Add pavements, asphalt, and the lines on it, if there are any."""
        added = []
        for surface, texture in zip(scenery.streets(roads), self._layers, strict=True):
            if surface.triangles:
                added.append(self._bodies.add(self._bodies.painted(surface, texture)))

        return added

    def building(self, plot: Plot) -> int:
        """Add a building that nothing passes."""
        kind = plot.kind
        at_m = (plot.x_m, plot.y_m)
        if not plot.outline:
            size_m = (kind.width_m, kind.depth_m, kind.height_m)
            model = self._bodies.model(*mesh.building(kind))
            return self._bodies.add(model, self._box(size_m), at_m, plot.heading_rad)

        outline = [(x_m - plot.x_m, y_m - plot.y_m) for x_m, y_m in plot.outline]
        model = self._bodies.model(*mesh.prism(kind, outline))
        solid = self._bodies.walls(outline, kind.height_m)
        return self._bodies.add(model, solid, at_m)

    def prop(self, prop: Prop, is_solid: bool) -> int:
        """Add a prop, which nothing passes if it is solid."""
        model = self._bodies.model(*prop_shapes.shape(prop))
        at_m = (prop.x_m, prop.y_m)
        solid = self._box(prop.solid_size_m) if is_solid else NOT_SOLID

        return self._bodies.add(model, solid, at_m, prop.heading_rad)

    def _box(self, size_m: tuple[float, float, float]) -> int:
        length_m, width_m, height_m = size_m
        half_m = (length_m / 2, width_m / 2, height_m / 2)
        return self._bodies.box(half_m, middle_m=height_m / 2)
