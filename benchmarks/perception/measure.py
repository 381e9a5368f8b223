"""The metrics of perception: in held-out towns, or on images of a user's own."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.benchmark import Setting, path_option
from benchmarks.perception import photographs, stereo, towns
from benchmarks.report import Metrics
from cogmap.cli.options import FiniteRange
from cogmap.services.epam.public import road
from cogmap.training.photographs import camvid_iou

OPTIONS = (
    path_option(
        "--stereo",
        "pair",
        nargs=3,
        metavar="LEFT RIGHT DISPARITY",
        text="Measure only the stereo matching, on a rectified pair of yours: its images, and the "
        "true disparities of the left one, as an image of --scale times the pixels, 0 where "
        "unknown.",
    ),
    click.Option(
        ["--scale"],
        type=FiniteRange(0, min_open=True),
        metavar="N",
        help="Of --stereo; 1 if not given.",
    ),
    path_option(
        "--camvid",
        metavar="DIR",
        text="Measure only how well road is found in street photographs after training on others: "
        "DIR has CamVid's folders train, trainannot, val and valannot.",
    ),
    click.Option(
        ["--by-drive", "is_by_drive"],
        is_flag=True,
        help="Of --camvid: each drive of DIR/train_320 and train_320_annot, else of DIR/train and "
        "trainannot, is left out of the training once, and measured on. A drive is what stands "
        "before the first _ of a file's name.",
    ),
    path_option(
        "--camvid-test",
        nargs=2,
        metavar="IMAGES LABELS",
        text="Measure only how well road is found in street photographs: two folders of PNG files "
        "with the same names, labelled as CamVid's 12 classes are.",
    ),
    path_option(
        "--road-weights",
        metavar="FILE",
        text="Of --camvid-test: the road network, as cogmap train road --camvid wrote it; "
        "that of the running system if not given.",
    ),
)


def measure(
    setting: Setting,
    *,
    pair: tuple[Path, Path, Path] | None = None,
    scale: float | None = None,
    camvid: Path | None = None,
    is_by_drive: bool = False,
    camvid_test: tuple[Path, Path] | None = None,
    road_weights: Path | None = None,
) -> Metrics:
    """Measure what perception makes of towns that it never saw: names, new buildings, roads, depth,
    places, and how fast.

    Draws them, with light, noise and clutter, and looks at them with the modules of the running
    system, in two processes. Takes four to five minutes on two cores; leave both to it. --camvid
    trains first, for some minutes; with --by-drive for each drive.
    """
    belonging = (
        ("--scale", scale is not None, "--stereo", bool(pair)),
        ("--road-weights", road_weights is not None, "--camvid-test", bool(camvid_test)),
        ("--by-drive", is_by_drive, "--camvid", camvid is not None),
    )
    for option, is_given, owner, has_owner in belonging:
        if is_given and not has_owner:
            raise click.BadParameter(f"it belongs to {owner}: give that too", param_hint=option)
    if camvid is not None and camvid_test:
        raise click.BadParameter("give it or --camvid-test, not both", param_hint="--camvid")

    metrics: Metrics = {}
    if pair:
        metrics |= stereo.measure(*pair, scale or 1.0)
    if camvid_test:
        metrics["camvid_iou"] = camvid_iou(road_weights or road.DEFAULT_PATH, *camvid_test)
    if camvid is not None and is_by_drive:
        metrics |= photographs.measure_by_drive(camvid, setting.folder, setting.announce)
    if camvid is not None and not is_by_drive:
        metrics |= photographs.measure(camvid, setting.folder)

    return metrics or towns.measure()
