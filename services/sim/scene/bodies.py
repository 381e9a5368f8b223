"""Bodies in pybullet: shapes with pictures on them, and boxes that nothing passes."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from cogmap.services.sim.layout.plan import Point
from cogmap.services.sim.rendering.mesh import Mesh
from cogmap.services.sim.rendering.wall import Image
from cogmap.services.sim.robot import upright_quaternion
from cogmap.services.sim.stdio import pybullet

NOT_SOLID = -1
# Deep below the ground: the camera's images reach 400 m.
HIDDEN_M = -1000.0
_ORIGIN = (0.0, 0.0)
_UPRIGHT = (0, 0, 0, 1)


class Model(NamedTuple):
    """A shape as the text of an OBJ file, its number, and the texture on it."""

    number: int
    obj: str
    texture: int


class Bodies:
    """Adds bodies to a pybullet client.

    Shapes and pictures go through files, as all renderers of pybullet load nothing else; none is
    left. pybullet remembers both by the names of their files: each has a name of its own.
    """

    def __init__(self, client: int) -> None:
        self._client = client
        self._models = 0
        self._textures = 0
        # No other client has files of this name: pybullet remembers those of all clients.
        self._prefix = Path(tempfile.mkdtemp(prefix="cogmap-"))
        self._prefix.rmdir()

    def model(self, surface: Mesh, picture: Image) -> Model:
        """Make a shape with a picture on it, to be added."""
        return self.painted(surface, self.texture(picture))

    def painted(self, surface: Mesh, texture: int) -> Model:
        """Make a shape with a texture on it."""
        self._models += 1
        return Model(self._models, surface.obj(), texture)

    def texture(self, picture: Image) -> int:
        """Load a picture, and return its number."""
        bgr = np.ascontiguousarray(picture[..., ::-1])
        _, bmp = cv2.imencode(".bmp", bgr)
        self._textures += 1
        with self._file(f"{self._textures}.bmp", bmp.tobytes()) as path:
            return int(pybullet.loadTexture(path, physicsClientId=self._client))

    def box(self, half_m: tuple[float, float, float], middle_m: float) -> int:
        """Make a box that nothing passes, its middle at height `middle_m`, for `add`."""
        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_BOX,
                halfExtents=list(half_m),
                collisionFramePosition=[0, 0, middle_m],
                physicsClientId=self._client,
            )
        )

    def walls(self, outline: Sequence[Point], height_m: float) -> int:
        """Make walls that nothing passes, over a polygon, for `add`."""
        count = len(outline)
        vertices = [(x, y, 0.0) for x, y in outline]
        vertices += [(x, y, height_m) for x, y in outline]

        indices = []
        for number in range(count):
            following = (number + 1) % count
            indices += [number, following, following + count]
            indices += [number, following + count, number + count]

        return int(
            pybullet.createCollisionShape(
                pybullet.GEOM_MESH,
                vertices=vertices,
                indices=indices,
                flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
                physicsClientId=self._client,
            )
        )

    def add(
        self,
        model: Model,
        solid: int = NOT_SOLID,
        at_m: Point = _ORIGIN,
        heading_rad: float = 0.0,
    ) -> int:
        """Add a body; `solid` is what nothing passes."""
        with self._file(f"{model.number}.obj", model.obj.encode()) as path:
            shape = pybullet.createVisualShape(
                pybullet.GEOM_MESH,
                fileName=path,
                specularColor=[0, 0, 0],
                physicsClientId=self._client,
            )
        body = pybullet.createMultiBody(
            0,
            solid,
            shape,
            (*at_m, 0.0),
            upright_quaternion(heading_rad),
            physicsClientId=self._client,
        )
        pybullet.changeVisualShape(
            body, -1, textureUniqueId=model.texture, physicsClientId=self._client
        )
        return int(body)

    @contextmanager
    def _file(self, name: str, content: bytes) -> Iterator[str]:
        """Write `content` to a file, give its path, and remove the file afterwards."""
        path = self._prefix.with_name(f"{self._prefix.name}-{name}")
        try:
            with path.open("xb") as file:
                file.write(content)
            yield str(path)
        finally:
            path.unlink()

    def move(self, body: int, x_m: float, y_m: float) -> None:
        """Put a body there, upright."""
        pybullet.resetBasePositionAndOrientation(
            body,
            (x_m, y_m, 0),
            _UPRIGHT,
            physicsClientId=self._client,
        )

    def hide(self, body: int) -> None:
        """Put a body where nothing meets it and no camera sees it.

        None is ever removed: pybullet's EGL plugin would confuse the textures of those that come
        later.
        """
        self._lift(body, HIDDEN_M)

    def show(self, body: int) -> None:
        """Put a body that was hidden back to its place."""
        self._lift(body, 0.0)

    def _lift(self, body: int, z_m: float) -> None:
        (x_m, y_m, _), turned = pybullet.getBasePositionAndOrientation(
            body, physicsClientId=self._client
        )
        pybullet.resetBasePositionAndOrientation(
            body, (x_m, y_m, z_m), turned, physicsClientId=self._client
        )
