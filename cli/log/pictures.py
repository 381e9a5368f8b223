"""`cogmap log image` and `perception`: what was seen, as pictures."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import msgspec

from cli.log import formatting
from cli.log.progress import bar
from cli.options import json_option
from cogmap.errors import LogError, UsageError
from cogmap.recording import views
from cogmap.recording.storage.reader import LogReader
from cogmap.recording.views import Sight
from schemas import topics
from schemas.sensing import Percepts, StereoFrame, View
from schemas.topics import Topic

IMAGES = (".png", ".jpg", ".jpeg")
FIGURES = (".png", ".pdf")
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


def _which(command: _Command) -> _Command:
    """The options that say which frame, and where to."""
    for option in (
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
            type=click.FloatRange(min=0),
            metavar="SECONDS",
            help="Nearest to this time.",
        ),
        click.option(
            "--frame", type=click.IntRange(min=0), metavar="N", help="The frame with this number."
        ),
        click.argument("log", type=click.Path(path_type=Path)),
    ):
        command = option(command)
    return command


@click.command(epilog=_IMAGE_EPILOG)
@click.option(
    "--camera", type=click.Choice(["left", "right"]), help="As this camera gave it, not rectified."
)
@click.option("--depth", is_flag=True, help="Its depth, in colours, with a scale.")
@click.option("--percepts", is_flag=True, help="Outline and name what was recognised in it.")
@_which
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

    That is the rectified left image, of which depth and percepts are; --camera has it as a camera
    gave it. Unless --frame or --at says which, it is the one in the middle. With --depth or
    --percepts each pixel is several wide.
    """
    if camera and (depth or percepts):
        raise click.UsageError(
            "depth and percepts are of the rectified view: leave --camera out, or --depth and --percepts"
        )
    reader = LogReader(log)
    topic = topics.STEREO if camera else topics.VIEW
    found = _sights(reader, topic, percepts)
    sight = _chosen(reader, found, frame, at_s) or found[len(found) // 2]
    kinds = [camera or "", "depth" if depth else "", "percepts" if percepts else ""]
    path = _output(output, log, sight, "-".join(filter(None, kinds)) or "view", IMAGES)
    said = views.percepts(reader, sight) if percepts else None
    path.write_bytes(_image(reader, sight, camera, depth, said, path.suffix.lower()))
    _say(path, log, topic, sight, said, as_json)


@click.command(epilog=_PERCEPTION_EPILOG)
@_which
def perception(
    log: Path, frame: int | None, at_s: float | None, output: Path | None, as_json: bool
) -> None:
    """Draw what perception made of a view in LOG: figure 3 of the paper, as PNG or PDF.

    Camera image, depth, segments with their names, the road in the image, and from above the
    projected road with the objects where they stand. Unless --frame or --at says which, it is the
    view in which most is recognised.
    """
    reader = LogReader(log)
    found = _sights(reader, topics.VIEW, True)
    sight = _chosen(reader, found, frame, at_s) or max(found, key=lambda sight: sight.objects)
    path = _output(output, log, sight, "perception", FIGURES)
    said = views.percepts(reader, sight)
    view = views.message(reader, sight.record)
    named = f"{log}, frame {sight.frame}"
    assert isinstance(view, View)
    assert said is not None
    if min(view.calibration.fx_px, view.calibration.fy_px) < 1:
        raise LogError(
            f"{named}: its calibration's focal lengths must be at least 1 pixel: choose another frame"
        )
    pixels = views.image(view.image, named)
    depth_m = views.depth(view.depth_m, named)
    title = f"What was perceived in frame {sight.frame}, {sight.at_s:.1f} s into {log.name}"
    draw: Any = importlib.import_module(
        "cli.plots.perception"
    )  # other commands have no use for matplotlib
    path.write_bytes(draw.figure(view, pixels, depth_m, said, title, path.suffix.lower()))
    _say(path, log, topics.VIEW, sight, said, as_json)


def _sights(reader: LogReader, topic: Topic, told: bool) -> list[Sight]:
    with bar(f"reading {reader.path.name}") as progress:
        found = views.sights(reader, topic, progress)
    return views.recognised(reader, found) if told else found


def _chosen(
    reader: LogReader, found: list[Sight], frame: int | None, at_s: float | None
) -> Sight | None:
    if frame is not None and at_s is not None:
        raise click.UsageError("--frame and --at both say which view: leave one out")
    if frame is not None:
        return views.of_frame(found, frame, reader.path)
    return None if at_s is None else views.at_time(found, at_s, reader)


def _output(
    output: Path | None, log: Path, sight: Sight, kind: str, suffixes: tuple[str, ...]
) -> Path:
    """Where to write. Raises UsageError where that cannot be a file of one of the kinds in
    `suffixes`.
    """
    path = output or Path(f"{log.stem}-frame-{sight.frame}-{kind}{suffixes[0]}")
    if path.suffix.lower() not in suffixes:
        raise UsageError(f"-o {path}: name a file that ends in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise UsageError(f"-o {path}: there is no folder {path.parent}: make it first")
    return path


def _image(
    reader: LogReader,
    sight: Sight,
    camera: str | None,
    depth: bool,
    percepts: Percepts | None,
    suffix: str,
) -> bytes:
    message = views.message(reader, sight.record)
    named = f"{reader.path}, frame {sight.frame}"
    paint: Any = importlib.import_module("cli.plots.paint")
    if isinstance(message, StereoFrame):
        side = message.left if camera == "left" else message.right
        return bytes(paint.encoded(views.image(side, named), suffix))
    assert isinstance(message, View)
    pixels = views.image(message.image, named)
    if depth or percepts is not None:
        depth_m = views.depth(message.depth_m, named) if depth else None
        pixels = paint.drawn(
            pixels, depth_m, message.calibration, percepts.objects if percepts else []
        )
    return bytes(paint.encoded(pixels, suffix))


def _say(
    path: Path, log: Path, topic: Topic, sight: Sight, percepts: Percepts | None, as_json: bool
) -> None:
    objects = None if percepts is None else [percept.label for percept in percepts.objects]
    if as_json:
        formatting.say_json(
            Picture(str(path), topic.name, sight.frame, sight.stamp_ns, sight.at_s, objects)
        )
        return
    shown = "" if objects is None else f", with {', '.join(objects) or 'nothing recognised'}"
    click.echo(f"{path}: {topic.name}, frame {sight.frame} at {sight.at_s:.3f} s of {log}{shown}")
