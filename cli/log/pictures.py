"""`cogmap log image` and `perception`: what was seen, as pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
import msgspec

from cogmap.cli.log import formatting
from cogmap.cli.log.files import save
from cogmap.cli.log.progress import bar
from cogmap.cli.options import FiniteRange, json_option
from cogmap.errors import LogError, UsageError
from cogmap.recording import views
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.views import CameraFrame, Depth
from cogmap.schemas import topics
from cogmap.schemas.sensing import Percepts, StereoFrame, View
from cogmap.schemas.topics import Topic

IMAGES = (".png", ".jpg", ".jpeg")
PLOTS = (".png", ".pdf")
MIN_FOCAL_LENGTH_PX = 1.0
_IMAGE_EPILOG = """\b
Examples:
  cogmap log image drive.mcap                          the view in the middle of the log
  cogmap log image drive.mcap --frame 40 --percepts    what was recognised in it, outlined
  cogmap log image drive.mcap --at 12.5 --depth        how far away what it shows is, in colours
  cogmap log image drive.mcap --camera right -o right.jpg
"""
_PERCEPTION_EPILOG = """\b
Examples:
  cogmap log perception drive.mcap                     the view in which most is recognised
  cogmap log perception drive.mcap --at 12.5 -o figure.pdf
"""
_Command = Callable[..., None]


class Picture(msgspec.Struct, frozen=True):
    """A file that was written, and which frame of the log it shows; `at_s` counts from the log's
    first message.
    """

    path: str
    topic: str
    frame: int
    stamp_ns: int
    at_s: float
    objects: list[str] | None = None


def _frame_options(command: _Command) -> _Command:
    """The options for which frame to show, and which file to write."""
    options = (
        json_option,
        click.option(
            "-o",
            "--output",
            type=click.Path(path_type=Path),
            help="The file; named by the frame otherwise.",
        ),
        click.option(
            "--at",
            "at_s",
            type=FiniteRange(min=0),
            metavar="SECONDS",
            help="Nearest to this time.",
        ),
        click.option(
            "--frame", type=click.IntRange(min=0), metavar="N", help="The frame with this number."
        ),
        click.argument("log", type=click.Path(path_type=Path)),
    )
    for option in options:
        command = option(command)
    return command


@click.command(epilog=_IMAGE_EPILOG)
@click.option(
    "--camera", type=click.Choice(["left", "right"]), help="As this camera gave it, not rectified."
)
@click.option("--depth", is_flag=True, help="Its depth, in colours, with a scale.")
@click.option("--percepts", is_flag=True, help="Outline and name what was recognised in it.")
@_frame_options
def image(
    log: Path,
    frame: int | None,
    at_s: float | None,
    output: Path | None,
    as_json: bool,
    camera: str | None,
    depth: bool,
    percepts: bool,
) -> None:
    """Save a view in LOG as an image file: a recorded pixel a pixel, as PNG or JPEG.

    That is the rectified left image, of which depth and percepts are; --camera gives the image of a
    camera as it was. Without --frame or --at it is the view in the middle. With --depth or
    --percepts each pixel is several wide.
    """
    if camera and (depth or percepts):
        raise click.UsageError(
            "depth and percepts are of the rectified view: leave --camera out, or --depth and "
            "--percepts"
        )
    reader = LogReader(log)
    topic = topics.STEREO if camera else topics.VIEW
    frames = _frames(reader, topic, percepts)
    chosen = _chosen(reader, frames, frame, at_s) or frames[len(frames) // 2]

    kind = _kind(camera, depth, percepts)
    path = _output(output, log, chosen, kind, IMAGES)
    suffix = path.suffix.lower()
    recognised = views.percepts(reader, chosen) if percepts else None
    if camera:
        content = _camera_image(reader, chosen, camera, suffix)
    else:
        content = _view_image(reader, chosen, depth, recognised, suffix)
    save(path, content)
    _report(_picture(path, topic, chosen, recognised), log, as_json)


@click.command(epilog=_PERCEPTION_EPILOG)
@_frame_options
def perception(
    log: Path, frame: int | None, at_s: float | None, output: Path | None, as_json: bool
) -> None:
    """Draw what perception made of a view in LOG: figure 3 of the paper, as PNG or PDF.

    Camera image, depth, segments with their names, the road in the image, and from above the
    projected road with the objects where they stand. Without --frame or --at it is the view in
    which most is recognised.
    """
    reader = LogReader(log)
    frames = _frames(reader, topics.VIEW, True)
    chosen = _chosen(reader, frames, frame, at_s) or max(frames, key=lambda each: each.objects)
    path = _output(output, log, chosen, "perception", PLOTS)

    recognised = views.percepts(reader, chosen)
    assert recognised is not None
    content = _perception_plot(reader, chosen, recognised, path.suffix.lower())
    save(path, content)
    _report(_picture(path, topics.VIEW, chosen, recognised), log, as_json)


def _frames(reader: LogReader, topic: Topic, recognised: bool) -> list[CameraFrame]:
    """The frames on a topic, only those with percepts where these are needed."""
    with bar(f"reading {reader.path.name}") as progress:
        found = views.camera_frames(reader, topic, progress)
    return views.with_percepts(reader, found) if recognised else found


def _chosen(
    reader: LogReader, frames: list[CameraFrame], number: int | None, at_s: float | None
) -> CameraFrame | None:
    """The frame that the options name, None where they name none. Raises UsageError."""
    if number is not None and at_s is not None:
        raise click.UsageError("--frame and --at both name a view: leave one out")
    if number is not None:
        return views.by_number(frames, number, reader.path)
    if at_s is not None:
        return views.at_time(frames, at_s, reader)
    return None


def _kind(camera: str | None, depth: bool, percepts: bool) -> str:
    """What an image shows, as the name of its file has it."""
    parts = [camera or "", "depth" if depth else "", "percepts" if percepts else ""]
    return "-".join(filter(None, parts)) or "view"


def _output(
    output: Path | None, log: Path, frame: CameraFrame, kind: str, suffixes: tuple[str, ...]
) -> Path:
    """Where to write. Raises UsageError where that cannot be a file of one of the kinds in
    `suffixes`.
    """
    path = output or Path(f"{log.stem}-frame-{frame.number}-{kind}{suffixes[0]}")
    if path.suffix.lower() not in suffixes:
        raise UsageError(f"-o {path}: name a file that ends in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise UsageError(f"-o {path}: there is no folder {path.parent}: make it first")
    return path


def _camera_image(reader: LogReader, frame: CameraFrame, camera: str, suffix: str) -> bytes:
    """A camera's image as a file. Raises LogError."""
    from cogmap.cli.plots import draw

    message = views.message(reader, frame.record)
    assert isinstance(message, StereoFrame)
    array = message.left if camera == "left" else message.right
    return draw.encode_image(views.image(array, _name(reader, frame)), suffix)


def _view_image(
    reader: LogReader, frame: CameraFrame, depth: bool, recognised: Percepts | None, suffix: str
) -> bytes:
    """A view as a file, drawn over where depth or percepts are to be shown. Raises LogError."""
    from cogmap.cli.plots import draw

    view = _view(reader, frame)
    name = _name(reader, frame)
    pixels = views.image(view.image, name)
    depth_m: Depth | None = views.depth(view.depth_m, name) if depth else None
    if depth_m is not None or recognised is not None:
        objects = recognised.objects if recognised is not None else []
        pixels = draw.draw_view(pixels, depth_m, view.calibration, objects)
    return draw.encode_image(pixels, suffix)


def _perception_plot(
    reader: LogReader, frame: CameraFrame, recognised: Percepts, suffix: str
) -> bytes:
    """The plot of a view and its percepts as a file. Raises LogError."""
    from cogmap.cli.plots import perception as plot  # other commands have no use for matplotlib

    view = _view(reader, frame)
    name = _name(reader, frame)
    focal_px = min(view.calibration.fx_px, view.calibration.fy_px)
    if focal_px < MIN_FOCAL_LENGTH_PX:
        raise LogError(
            f"{name}: its calibration's focal lengths must be at least 1 pixel: choose another "
            "frame"
        )
    pixels = views.image(view.image, name)
    depth_m = views.depth(view.depth_m, name)
    place = f"frame {frame.number}, {frame.at_s:.1f} s into {reader.path.name}"
    title = f"What was perceived in {place}"
    return plot.figure(view, pixels, depth_m, recognised, title, suffix)


def _view(reader: LogReader, frame: CameraFrame) -> View:
    message = views.message(reader, frame.record)
    assert isinstance(message, View)
    return message


def _name(reader: LogReader, frame: CameraFrame) -> str:
    return f"{reader.path}, frame {frame.number}"


def _picture(path: Path, topic: Topic, frame: CameraFrame, recognised: Percepts | None) -> Picture:
    objects = None
    if recognised is not None:
        objects = [percept.label for percept in recognised.objects]
    return Picture(str(path), topic.name, frame.number, frame.stamp_ns, frame.at_s, objects)


def _report(picture: Picture, log: Path, as_json: bool) -> None:
    """Print which file was written and what it shows."""
    if as_json:
        formatting.print_json(picture)
        return
    shown = ""
    if picture.objects is not None:
        shown = f", with {', '.join(picture.objects) or 'nothing recognised'}"
    place = f"frame {picture.frame} at {picture.at_s:.3f} s of {log}"
    click.echo(f"{picture.path}: {picture.topic}, {place}{shown}")
