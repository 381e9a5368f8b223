"""Renders the towns that perception is trained on.

The simulator draws towns from seeds, each view in a light of its own and from another place, and
labels what it knows; sensory memory adds the depth from stereo. Towns for training are in the
folder train, and in unlabelled more of them, whose buildings have no taught label; in blocks are
larger ones, with long streets of invented buildings, of which far ones stand close together in a
view. Towns to choose and calibrate by are in val and blocks-val, and towns for tests in test. No
town and no invented kind of building is in two of them. Files that exist are kept, so that an
interrupted command continues; the same command gives the same files.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np

from cogmap.errors import CogmapError
from cogmap.parallel import Progress, parallel_map
from cogmap.robot import NEAREST_DEPTH_M
from cogmap.schemas.sensing import Calibration
from cogmap.services.sensory.disparity import DepthFromStereo
from cogmap.services.sensory.rectify import rectification
from cogmap.training.rendering.towns import Views, render_blocks, render_town


@dataclass(frozen=True)
class Split:
    """`towns` towns with seeds from `first_seed` on, of which one after the other has each number
    of invented kinds of building; those of blocks have no others.
    """

    name: str
    first_seed: int
    towns: int
    views: int
    invented: tuple[int, ...] = (0, 14, 28)
    is_blocks: bool = False


SPLITS = (
    Split("train", 1001, 84, 110),
    Split("unlabelled", 5001, 280, 45, (30,)),
    Split("blocks", 6001, 36, 110, is_blocks=True),
    Split("blocks-val", 6501, 3, 90, is_blocks=True),
    Split("val", 2001, 6, 90),
    Split("test", 3001, 6, 90),
)


@dataclass(frozen=True)
class Job:
    """One town to be rendered to `target`."""

    seed: int
    views: int
    invented: int
    target: Path
    is_blocks: bool = False


def jobs(out: Path, scale: float) -> Iterator[Job]:
    """Yield the jobs of rendering: the towns of each split times `scale`, at least one."""
    for split in SPLITS:
        for number in range(max(1, round(scale * split.towns))):
            seed = split.first_seed + number
            yield Job(
                seed=seed,
                views=split.views,
                invented=split.invented[number % len(split.invented)],
                is_blocks=split.is_blocks,
                target=out / split.name / f"town-{seed}.npz",
            )


def render(job: Job) -> None:
    """Render the town of `job`, unless its file exists. Raises CogmapError if that fails."""
    if job.target.exists():
        return

    job.target.parent.mkdir(parents=True, exist_ok=True)
    try:
        if job.is_blocks:
            views = render_blocks(job.seed, job.views)
        else:
            views = render_town(job.seed, job.views, job.invented)
        views = with_stereo_depth(views)
    except Exception as error:
        raise CogmapError(f"cannot render the town of seed {job.seed}: {error}") from error

    # Renamed when it is complete, so that an interrupted command leaves no half file.
    with tempfile.TemporaryDirectory(prefix=".part-", dir=job.target.parent) as folder:
        part = Path(folder) / job.target.name
        np.savez(part, allow_pickle=False, **views)
        part.replace(job.target)


def with_stereo_depth(views: Views) -> Views:
    """Return `views` with the rectified `left` image and its calibration, and, instead of the
    `right` image, the depth `stereo_m` float32 (n, h, w), 0 if it is unknown.
    """
    cv2.setNumThreads(1)
    encoded = views["calibration"].tobytes()
    calibration = msgspec.json.decode(encoded, type=Calibration)
    rectified = rectification(calibration)
    matcher = DepthFromStereo(rectified.calibration, NEAREST_DEPTH_M)

    lefts = []
    depths_m = []
    for raw_left, raw_right in zip(views["left"], views["right"], strict=True):
        left, right = rectified.apply(raw_left, raw_right)
        lefts.append(left)
        depths_m.append(matcher.depth_m(left, right))

    rectified_encoded = msgspec.json.encode(rectified.calibration)
    unchanged = {key: value for key, value in views.items() if key not in ("left", "right")}
    return unchanged | {
        "left": np.asarray(lefts),
        "stereo_m": np.asarray(depths_m),
        "calibration": np.frombuffer(rectified_encoded, np.uint8),
    }


def render_all(
    wanted: Sequence[Job], processes: int, progress: Progress = lambda share: None
) -> None:
    """Render the towns of all jobs, in this number of processes; `progress` is called with the
    share done. Raises CogmapError if one fails.
    """
    # Every process has a core: neither numerics nor Mesa should start threads in it.
    os.environ.update(OMP_NUM_THREADS="1", LP_NUM_THREADS="1")
    parallel_map(render, wanted, processes, progress)
