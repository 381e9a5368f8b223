"""What sensory memory makes of recorded stereo pairs: `python -m training.rendering.views IN OUT`.

IN is an .npz with `left`, `right` uint8 (n, h, w, 3) and `calibration` as JSON bytes. OUT has the
same, but the rectified `left`, and in place of `right` the depth `stereo_m` float32 (n, h, w), 0
where it is unknown.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import msgspec
import numpy as np

from schemas.sensing import Calibration
from services.sensory.disparity import DepthFromStereo
from services.sensory.module import Config
from services.sensory.rectify import rectification


def convert(source: Path, target: Path) -> None:
    """Write to `target` what is in `source`, seen by sensory memory."""
    cv2.setNumThreads(1)
    with np.load(source, allow_pickle=False) as stored:
        given = {key: stored[key] for key in stored.files}
    rectified = rectification(msgspec.json.decode(given["calibration"].tobytes(), type=Calibration))
    matcher = DepthFromStereo(rectified.calibration, Config().nearest_m)
    pairs = [
        rectified.apply(*pair) for pair in zip(given.pop("left"), given.pop("right"), strict=True)
    ]
    seen = {
        "left": np.asarray([left for left, _ in pairs]),
        "stereo_m": np.asarray([matcher.depth_m(*pair) for pair in pairs]),
        "calibration": np.frombuffer(msgspec.json.encode(rectified.calibration), np.uint8),
    }
    np.savez(target, allow_pickle=False, **(given | seen))


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m training.rendering.views", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("source", type=Path, metavar="IN")
    parser.add_argument("target", type=Path, metavar="OUT")
    arguments = parser.parse_args()
    convert(arguments.source, arguments.target)


if __name__ == "__main__":
    main()
