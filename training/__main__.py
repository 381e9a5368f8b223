"""`python -m training`: trains the networks of perception."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import click

from cogmap.errors import UsageError
from cogmap.runtime.command import run_command
from services.epam.layout.road import DEFAULT_PATH as ROAD
from services.epam.recognition.objects import DEFAULT_PATH as OBJECTS
from services.epam.recognition.segments import DEFAULT_PATH as SEGMENTS
from training.photographs import camvid_iou

CAMVID_ROAD = Path("road-camvid.onnx")
folder = click.Path(file_okay=False, path_type=Path)
seed_option = click.option(
    "--seed", type=click.IntRange(0, 2**31 - 1), default=0, show_default=True, metavar="N"
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def train() -> None:
    """Train the networks of perception; one seed gives the same weights each time.

    This needs torch, which running Cogmap does not: pip install 'cogmap[train]'. DATA_DIR holds renderings of towns:

    \b
    python -m training.rendering.dataset --out DATA_DIR
    python -m training segments DATA_DIR
    python -m training objects DATA_DIR
    python -m training road DATA_DIR
    """


@train.command(name="road")
@click.argument("data_dir", required=False, type=folder)
@click.option(
    "--camvid", type=folder, metavar="DIR", help="Train on the street photographs there instead."
)
@click.option(
    "--camvid-test",
    type=(folder, folder),
    metavar="IMAGES LABELS",
    help="Print the IoU of road on these photographs, after training or without any.",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help=f"The weights.  [default: {CAMVID_ROAD} here with --camvid or --camvid-test, else EPAM's own]",
)
@seed_option
@click.option(
    "--epochs", type=click.IntRange(1, 1000), metavar="N", help="How often every sample is used."
)
def road_command(
    *,
    data_dir: Path | None,
    camvid: Path | None,
    camvid_test: tuple[Path, Path] | None,
    out: Path | None,
    seed: int,
    epochs: int | None,
) -> None:
    """Train the network that finds the road, about ten minutes on one thread; prints the IoU on held-out towns.

    With --camvid it is trained on photographs instead: DIR/train/*.png, with label images of the same names in
    DIR/trainannot, where 3 is road and 11 unlabelled, as in CamVid.

    \b
    python -m training road --camvid DIR
    python -m training road --camvid-test DIR/val DIR/valannot
    """
    sources = (data_dir is not None) + (camvid is not None)
    if sources > 1 or (not sources and camvid_test is None):
        raise UsageError(
            "name what to train on, either DATA_DIR, with renderings of towns, or --camvid DIR"
        )
    chosen = {} if epochs is None else {"epochs": epochs}
    weights = out or (ROAD if data_dir is not None else CAMVID_ROAD)
    if data_dir is not None:
        iou = _trainer("road").train_on_renderings(data_dir, weights, seed=seed, **chosen)
        click.echo(f"road IoU on {data_dir / 'val'}: {iou:.4f}")
    if camvid is not None:
        _trainer("camvid").train_on_photographs(camvid, weights, seed=seed, **chosen)
    if sources:
        click.echo(f"weights: {weights}")
    if camvid_test is not None:
        click.echo(f"road IoU on {camvid_test[0]}: {camvid_iou(weights, *camvid_test):.4f}")


@train.command(name="segments")
@click.argument("data_dir", type=folder)
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), default=SEGMENTS, help="The weights."
)
@seed_option
@click.option(
    "--epochs", type=click.IntRange(1, 1000), metavar="N", help="How often every view is used."
)
def segments_command(*, data_dir: Path, out: Path, seed: int, epochs: int | None) -> None:
    """Train the network that divides a view into candidates; prints how many it finds in held-out
    towns.

    About a quarter of an hour on one thread.
    """
    _train_and_tell("segments", data_dir, out, seed, epochs)


@train.command(name="objects")
@click.argument("data_dir", type=folder)
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), default=OBJECTS, help="The weights."
)
@seed_option
@click.option(
    "--epochs", type=click.IntRange(1, 1000), metavar="N", help="How often every segment is used."
)
def objects_command(*, data_dir: Path, out: Path, seed: int, epochs: int | None) -> None:
    """Train the network that names what a segment shows; prints how it does in held-out towns.

    Its segments are those of the network that divides a view: train that first. Beside the weights
    it writes the names and what makes their activation a probability. About a quarter of an hour on
    one thread.
    """
    _train_and_tell("objects", data_dir, out, seed, epochs)


def _train_and_tell(name: str, data_dir: Path, out: Path, seed: int, epochs: int | None) -> None:
    chosen = {} if epochs is None else {"epochs": epochs}
    figures = _trainer(name).train_on_renderings(data_dir, out, seed=seed, **chosen)
    for key, value in figures.items():
        click.echo(f"{key}: {value:.4f}")
    click.echo(f"weights: {out}")


def _trainer(name: str) -> ModuleType:
    """The module that trains `name`. Raises UsageError where torch is not installed."""
    try:
        return importlib.import_module(f"training.{name}")
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        raise UsageError("training needs torch: pip install 'cogmap[train]'") from None


def main() -> None:
    """Run a command; what the user can mend is one sentence and exit code 2."""
    run_command(train, "train", "python -m training")


if __name__ == "__main__":
    main()
