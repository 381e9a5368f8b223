"""Small recordings, made in a test."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from cogmap.errors import UsageError
from cogmap.runtime.config import Sections
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Pose, TrueTown
from cogmap.testing import PERIOD_NS, odometry, percepts, stamp_ns

CAMERA = "55 0 31.5 {} 0 55 23.5 0 0 0 1 0"
SIZE_PX = (48, 64)


@dataclass
class Walk:
    """Views of percepts, the wheels before each, and true poses 1 m apart. Those views whose number
    is `broken` cannot be read; nobody knows the true poses at those `unknown`. The last one comes
    `gap_s` late.
    """

    views: int
    broken: Collection[int] = ()
    unknown: Collection[int] = ()
    settings: Sections = field(default_factory=dict)
    gap_s: float = 0.0
    notes: Sequence[str] = ()

    @property
    def stamps_ns(self) -> list[int]:
        *others, last_ns = [stamp_ns(number) for number in range(self.views)]
        return [*others, last_ns + round(self.gap_s * 1e9)]

    @property
    def true_poses(self) -> list[Pose | None]:
        poses = [Pose(x_m=number, y_m=0.0, heading_rad=0.0) for number in range(self.views)]
        return [None if number in self.unknown else pose for number, pose in enumerate(poses)]

    def before(self, number: int) -> list[Message]:
        return [odometry(stamp_ns=self.stamps_ns[number] - PERIOD_NS // 2)]

    def view(self, number: int) -> list[Message]:
        if number in self.broken:
            raise UsageError(f"view {number} is broken: copy it again")
        return [percepts(number, stamp_ns=self.stamps_ns[number])]

    def town(self) -> TrueTown | None:
        return TrueTown(seed=0, streets=[], buildings=[])


def kitti_folder(folder: Path, pairs: int = 3) -> Path:
    """Make a KITTI sequence of a camera that stands before a wall of noise, 5.5 m away."""
    wall = np.random.default_rng(0).integers(0, 256, SIZE_PX, np.uint8)
    for side, shift_px in (("image_0", 0), ("image_1", -5)):
        (folder / side).mkdir(parents=True)
        for number in range(pairs):
            image = np.roll(wall, shift_px, axis=1)
            cv2.imwrite(str(folder / side / f"{number:06}.png"), image)

    matrices = (CAMERA.format(0), CAMERA.format(-27.5))
    (folder / "calib.txt").write_text("".join(f"{matrix}\n" for matrix in matrices))
    return folder


def mrclam_folder(folder: Path, barcodes: Sequence[int] = (63, 25), times: int = 3) -> Path:
    """Make an MRCLAM set of one robot, which drives at 0.5 m/s, and sees `barcodes` 2 m ahead and
    0.2 rad to the left, so many times, every 0.46 s; it has 3 views, and 2 for each time.
    """
    folder.mkdir(exist_ok=True)
    ticks = range(round(4.6 * times + 6.2) + 1)
    odometry = "".join(f"{100 + tick / 10:.3f} 0.5 0.0\n" for tick in ticks)
    truth = "".join(f"{100 + tick / 10:.3f} {tick / 20} 0.0 0.0\n" for tick in ticks)
    stamps_s = [100 + 0.46 * (number + 1) for number in range(times)]
    seen = [f"{at_s:.3f} {code} 2.0 0.2\n" for at_s in stamps_s for code in barcodes]
    files = {
        "Barcodes": "1 5\n6 63\n7 25\n",
        "Landmark_Groundtruth": "6 2.0 0.4 0.0 0.0\n7 3.0 0.6 0.0 0.0\n",
        "Robot1_Odometry": odometry,
        "Robot1_Measurement": "".join(seen),
        "Robot1_Groundtruth": truth,
    }
    for name, text in files.items():
        (folder / f"{name}.dat").write_text(text)
    return folder
