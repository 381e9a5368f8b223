"""Self-motion by views alone on a recorded stereo drive, and a plain visual odometry of OpenCV's in
the same run.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.perception.stereo import plain_disparity_px
from benchmarks.report import Metrics
from benchmarks.threshold import at_most
from benchmarks.timing import timed
from cogmap.cli.progress import bar
from cogmap.data.kitti import read_kitti
from cogmap.data.stereo_recording import StereoRecording
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes, Floats, Singles
from cogmap.geometry.se2 import moved_by
from cogmap.runtime.module import Module
from cogmap.schemas.array import Array
from cogmap.schemas.sensing import Calibration, SelfMotion, StereoFrame
from cogmap.services import registry

THRESHOLDS = {"drift_share": at_most(0.008), "frame_ms_p50": at_most(60.0)}
# The plain one: OpenCV's defaults, but for what its documentation leaves to the user.
FEATURES = 500
QUALITY = 0.01
SPACING_PX = 7
NEAREST_SHARE = 0.15
MIN_DISPARITY_PX = 2.0
REPROJECTION_PX = 1.0
MIN_POINTS = 8


class Drive(NamedTuple):
    """A recording's poses, (n, 3) each, from the true first one on: measured, and true. `errors`
    are (n - 1, 2) of distance and turn between two views over their standard deviations, `frames_s`
    the time that each view took, `skipped` how many broken pairs were left out.
    """

    measured: Floats
    true: Floats
    errors: Floats
    frames_s: Floats
    skipped: int


def measure(folder: Path) -> Metrics:
    """Measure the end error over the distance that was driven, by the sensory module with
    `self_motion = views` and by OpenCV's StereoSGBM, optical flow and PnP.

    `distance_chi2` and `turn_chi2` are the means of the squared errors between two views over their
    variance: 1 for an honest one. Their medians are in proportion to that of a normal number's
    square. Raises UsageError as `read_kitti` does, and if there are no true poses.
    """
    recording = read_kitti(folder)
    if recording.true_poses is None:
        raise UsageError(f"{folder} has no poses.txt: give a drive whose true poses are known")

    ours = _drive(recording)
    plain_share = _drift_share(_plain_poses(recording), ours.true)
    drift_share = _drift_share(ours.measured, ours.true)
    squared = ours.errors**2
    normal_median = 0.455
    return {
        "drift_share": drift_share,
        "plain_drift_share": plain_share,
        "drift_over_pnp": drift_share / max(plain_share, 1e-9),
        "frame_ms_p50": 1e3 * float(np.median(ours.frames_s)),
        "frame_ms_p90": 1e3 * float(np.quantile(ours.frames_s, 0.9)),
        "distance_m": _length_m(ours.true),
        "distance_chi2": float(squared[:, 0].mean()),
        "turn_chi2": float(squared[:, 1].mean()),
        "distance_chi2_median": float(np.median(squared[:, 0])) / normal_median,
        "turn_chi2_median": float(np.median(squared[:, 1])) / normal_median,
        "frames": float(len(ours.true)),
        "skipped_pairs": float(ours.skipped),
    }


def _drive(recording: StereoRecording) -> Drive:
    assert recording.true_poses is not None
    sensory = registry.build("sensory", {"sensory": {"self_motion": "views"}})
    pose = recording.true_poses[0]
    measured = []
    true: list[Floats] = []
    errors = []
    frames_s = []
    skipped = 0
    with bar("views") as progress:
        for number in range(len(recording)):
            progress((number + 1) / len(recording))
            try:
                images = recording.pair(number)
            except UsageError:
                skipped += 1
                continue

            frame_s, motion = timed(partial(_motion, sensory, recording, number, images))
            frames_s.append(frame_s)
            true_pose = recording.true_poses[number]
            if true:
                rows = motion.motions.numpy().astype(np.float64)
                pose = moved_by(pose, rows)
                errors.append(_normalised(rows, moved_by(np.zeros(3), rows), true[-1], true_pose))
            else:
                pose = true_pose
            measured.append(pose)
            true.append(true_pose)

    # The first view makes its tables.
    return Drive(
        np.array(measured), np.array(true), np.array(errors), np.array(frames_s[1:]), skipped
    )


def _motion(
    sensory: Module, recording: StereoRecording, number: int, images: tuple[Bytes, Bytes]
) -> SelfMotion:
    left, right = images
    frame = StereoFrame(
        stamp_ns=int(recording.stamps_ns[number]),
        frame=number,
        left=Array.of(left),
        right=Array.of(right),
        calibration=recording.calibration,
    )
    *_, motion = sensory.feed(frame)
    assert isinstance(motion, SelfMotion)
    return motion


def _normalised(rows: Floats, step: Floats, before: Floats, after: Floats) -> tuple[float, float]:
    """Return the errors of a motion's distance and turn over their standard deviations."""
    _, _, dt_s, speed_sd_m_s, turn_rate_sd_rad_s = rows.T
    distance_sd_m = np.sqrt(((speed_sd_m_s * dt_s) ** 2).sum())
    turn_sd_rad = np.sqrt(((turn_rate_sd_rad_s * dt_s) ** 2).sum())

    distance_m = np.hypot(*step[:2]) - np.hypot(*(after - before)[:2])
    turn_rad = step[2] - (after - before)[2]
    return float(distance_m / distance_sd_m), float(turn_rad / turn_sd_rad)


def _length_m(poses: Floats) -> float:
    return float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())


def _drift_share(measured: Floats, true: Floats) -> float:
    """Return the distance of the last two positions over the length of the true path."""
    end_m = np.hypot(*(measured[-1] - true[-1])[:2])
    return float(end_m / max(_length_m(true), 1e-9))


def _plain_poses(recording: StereoRecording) -> Floats:
    """Return the poses (n, 3) that OpenCV's own parts give: corners of the last image with depth by
    StereoSGBM, followed by optical flow, and PnP with RANSAC. Where they fail, nothing moved.
    """
    assert recording.true_poses is not None
    calibration = recording.calibration
    camera = np.array(
        [
            [calibration.fx_px, 0.0, calibration.cx_px],
            [0.0, calibration.fy_px, calibration.cy_px],
            [0.0, 0.0, 1.0],
        ]
    )
    placed = np.eye(4)
    poses = []
    last: tuple[Bytes, Singles] | None = None
    cv2.setRNGSeed(0)
    with bar("OpenCV's") as progress:
        for number in range(len(recording)):
            progress((number + 1) / len(recording))
            try:
                left, right = recording.pair(number)
            except UsageError:
                continue
            if left.ndim == 3:
                left = np.asarray(cv2.cvtColor(left, cv2.COLOR_RGB2GRAY), np.uint8)
                right = np.asarray(cv2.cvtColor(right, cv2.COLOR_RGB2GRAY), np.uint8)
            if last is not None:
                placed = placed @ _plain_motion(last, left, camera, calibration)
            last = (left, plain_disparity_px(left, right, NEAREST_SHARE * left.shape[1]))
            poses.append(placed)

    matrices = np.stack(poses)
    ahead = matrices[:, :3, 2]
    heading_rad = np.unwrap(np.arctan2(-ahead[:, 0], ahead[:, 2]))
    return np.column_stack([matrices[:, 2, 3], -matrices[:, 0, 3], heading_rad])


def _plain_motion(
    last: tuple[Bytes, Singles], new: Bytes, camera: Floats, calibration: Calibration
) -> Floats:
    """Return the pose of the new image's camera as seen from that of the last one (4, 4)."""
    grey, disparity_px = last
    corners = cv2.goodFeaturesToTrack(grey, FEATURES, QUALITY, SPACING_PX)
    if corners is None:
        return np.eye(4)

    pixels = np.asarray(corners, np.float32).reshape(-1, 2)
    found, status, _ = cv2.calcOpticalFlowPyrLK(grey, new, pixels, np.zeros_like(pixels))
    columns, rows = np.rint(pixels).astype(int).T
    at_px = disparity_px[rows, columns]
    is_usable = (status[:, 0] > 0) & (at_px > MIN_DISPARITY_PX)
    if is_usable.sum() < MIN_POINTS:
        return np.eye(4)

    depth_m = calibration.fx_px * calibration.baseline_m / at_px[is_usable]
    rays = np.column_stack([pixels[is_usable], np.ones(len(depth_m))]) @ np.linalg.inv(camera).T
    points_m = rays * depth_m[:, None]
    is_solved, turn, shift_m, _ = cv2.solvePnPRansac(
        points_m, np.asarray(found)[is_usable], camera, None, reprojectionError=REPROJECTION_PX
    )
    if not is_solved:
        return np.eye(4)

    to_new = np.eye(4)
    to_new[:3, :3] = cv2.Rodrigues(turn)[0]
    to_new[:3, 3] = shift_m[:, 0]
    result = np.linalg.inv(to_new)
    return result.astype(np.float64)
