"""`cogmap log image` and `perception`: camera images and percepts as pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
import msgspec

from cogmap.cli.files import check_picture, save
from cogmap.cli.options import FiniteRange, json_option
from cogmap.cli.printing import print_json
from cogmap.cli.progress import bar
from cogmap.errors import LogError
from cogmap.recording import views
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.views import CameraFrame
from cogmap.schemas import topics
from cogmap.schemas.sensing import Percepts, StereoFrame, View
from cogmap.schemas.topics import Topic

IMAGES = (".png", ".jpg", ".jpeg")
PLOTS = (".png", ".pdf")
MIN_FOCAL_LENGTH_PX = 1.0
_IMAGE_EPILOG = """\b
Examples:
  cogmap log image drive.mcap                          the image in the middle of the log
  cogmap log image drive.mcap --frame 40 --percepts    with the recognised objects outlined
  cogmap log image drive.mcap --at 12.5 --depth        depth in colours
  cogmap log image drive.mcap --camera right -o right.jpg
"""
_PERCEPTION_EPILOG = """\b
Examples:
  cogmap log perception drive.mcap                     the view with most recognised objects
  cogmap log perception drive.mcap --at 12.5 -o figure.pdf
"""
_Command = Callable[..., None]


class Picture(msgspec.Struct, frozen=True):
    """A file that was written, and the frame that it shows, `at_s` after the log began."""

    path: str
    topic: str
    frame: int
    stamp_ns: int
    at_s: float
    objects: list[str] | None = None


def _frame_options(command: _Command) -> _Command:
    """Add the options that choose the frame to show and the file to write."""
    options = (
        json_option,
        click.option(
            "-o",
            "--output",
            type=click.Path(path_type=Path),
            help="The picture.  [default: named after LOG and the frame]",
        ),
        click.option(
            "--at",
            "at_s",
            type=FiniteRange(min=0),
            metavar="SECONDS",
            help="The frame nearest to this time of the log, in seconds since its first message.",
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
    "--camera", type=click.Choice(["left", "right"]), help="The unrectified image of this camera."
)
@click.option("--depth", is_flag=True, help="Show depth in colours, with a scale.")
@click.option("--percepts", is_flag=True, help="Outline and name the recognised objects.")
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
    """Save a camera image in LOG, as PNG or JPEG.

    It is the rectified left image, which depth and percepts refer to, or with --camera the image
    of a camera as it was taken. Without --frame or --at it is the image in the middle of LOG.
    With --depth or --percepts the image is enlarged.
    """
    if camera and (depth or percepts):
        raise click.UsageError(
            "depth and percepts refer to the rectified view: leave out --camera, or --depth and "
            "--percepts"
        )
    from cogmap.cli.plots import draw

    reader = LogReader(log)
    topic = topics.STEREO if camera else topics.VIEW
    frames = _frames(reader, topic, percepts)
    chosen = _chosen(reader, frames, frame, at_s) or frames[len(frames) // 2]
    shown = [camera, "depth" if depth else None, "percepts" if percepts else None]
    kind = "-".join(filter(None, shown)) or "view"
    path = _output(output, log, chosen, kind, IMAGES)

    name = f"{log}, frame {chosen.number}"
    message = views.message(reader, chosen.record)
    recognised = views.percepts(reader, chosen) if percepts else None
    if isinstance(message, StereoFrame):
        chosen_image = message.left if camera == "left" else message.right
        pixels = views.camera_image(chosen_image, name)
    else:
        assert isinstance(message, View)
        pixels = views.image(message.image, name)
        depth_m = views.depth(message.depth_m, name) if depth else None
        if depth_m is not None or recognised is not None:
            objects = recognised.objects if recognised is not None else []
            pixels = draw.draw_view(pixels, depth_m, message.calibration, objects)

    save(path, draw.encode_image(pixels, path.suffix.lower()))
    _report(path, topic, chosen, recognised, log, as_json)


@click.command(epilog=_PERCEPTION_EPILOG)
@_frame_options
def perception(
    log: Path, frame: int | None, at_s: float | None, output: Path | None, as_json: bool
) -> None:
    """Draw how a view in LOG was perceived, as figure 3 of the paper, as PNG or PDF.

    Camera image, depth, segments with their names, the road in the image, and the road and the
    objects seen from above. Without --frame or --at it is the view with most recognised objects.
    """
    reader = LogReader(log)
    frames = _frames(reader, topics.VIEW, True)
    chosen = _chosen(reader, frames, frame, at_s) or max(frames, key=lambda each: each.objects)
    path = _output(output, log, chosen, "perception", PLOTS)

    recognised = views.percepts(reader, chosen)
    view = views.message(reader, chosen.record)
    assert recognised is not None
    assert isinstance(view, View)
    name = f"{log}, frame {chosen.number}"
    if min(view.calibration.fx_px, view.calibration.fy_px) < MIN_FOCAL_LENGTH_PX:
        raise LogError(
            f"{name}: its calibration's focal lengths must be at least 1 pixel: choose another "
            "frame"
        )

    from cogmap.cli.plots.perception import figure  # matplotlib takes long to import

    pixels = views.image(view.image, name)
    depth_m = views.depth(view.depth_m, name)
    title = f"Perception in frame {chosen.number}, {chosen.at_s:.1f} s into {log.name}"
    save(path, figure(view, pixels, depth_m, recognised, title, path.suffix.lower()))
    _report(path, topics.VIEW, chosen, recognised, log, as_json)


def _frames(reader: LogReader, topic: Topic, recognised: bool) -> list[CameraFrame]:
    """Return the frames on a topic, only those with percepts if `recognised`."""
    with bar(f"reading {reader.path.name}") as progress:
        found = views.camera_frames(reader, topic, progress)
    return views.with_percepts(reader, found) if recognised else found


def _chosen(
    reader: LogReader, frames: list[CameraFrame], number: int | None, at_s: float | None
) -> CameraFrame | None:
    """Choose the frame that the options name; None if they name none. Raises UsageError."""
    if number is not None and at_s is not None:
        raise click.UsageError("--frame and --at both name a view: leave one out")
    if number is not None:
        return views.by_number(frames, number, reader.path)
    if at_s is not None:
        return views.at_time(frames, at_s, reader)
    return None


def _output(
    output: Path | None, log: Path, frame: CameraFrame, kind: str, suffixes: tuple[str, ...]
) -> Path:
    """Name the file to write. Raises UsageError if it cannot be one of the kinds in `suffixes`."""
    path = output or Path(f"{log.stem}-frame-{frame.number}-{kind}{suffixes[0]}")
    check_picture("-o", path, suffixes)
    return path


def _report(
    path: Path,
    topic: Topic,
    frame: CameraFrame,
    recognised: Percepts | None,
    log: Path,
    as_json: bool,
) -> None:
    """Print the name of the file that was written, and what it shows."""
    objects = None if recognised is None else [each.name for each in recognised.objects]
    if as_json:
        number = frame.number
        print_json(Picture(str(path), topic.name, number, frame.stamp_ns, frame.at_s, objects))
        return

    shown = "" if objects is None else f", with {_listed(objects)}"
    place = f"frame {frame.number} at {frame.at_s:.3f} s of {log}"
    click.echo(f"{path}: {topic.name}, {place}{shown}")


def _listed(names: list[str]) -> str:
    """Write the names of what was recognized; what has none is counted."""
    words = [name for name in names if name]
    strangers = len(names) - len(words)
    if strangers:
        words.append(f"{strangers} without a name")
    return ", ".join(words) or "nothing recognised"
