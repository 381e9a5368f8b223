"""Pictures out of logs: a view as it was recorded, its depth, what was recognised in it, and the
figure of it all.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import pytest
from click import UsageError as ClickUsageError
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from cogmap.cli.plots import draw, ground
from cogmap.cli.plots.labels import Label, place
from cogmap.cli.plots.palette import KERB, SEVERAL
from cogmap.errors import LogError, UsageError
from cogmap.schemas.array import Array
from cogmap.schemas.base import Message
from cogmap.schemas.sensing import Percept, Percepts, StereoFrame, View
from tests.support.logs import SECOND_NS, write_log
from tests.support.system.commands import log_command, log_facts
from tests.support.world.blocks import ASPHALT, CAMERA, GRASS, Block, painted

FRAMES = 5
FIRST = 3
RECOGNISED = {4: 1, 5: 2, 7: 1}
REFERENCE = Path(__file__).parents[3] / "replay" / "reference.mcap"
HOUSE = Block(
    x_m=12.0, y_m=5.0, turn_rad=0.0, sides_m=(6.0, 6.0), height_m=6.0, colour=(180, 60, 40)
)
SCENE, DEPTH_M, _ = painted([HOUSE])
OUTLINE = [(40, 60), (120, 70), (120, 150), (40, 160)]
Pixels = npt.NDArray[np.uint8]
SCALE = 3


def shade(frame: int) -> Pixels:
    """The image of a frame: no two are the same."""
    brightened = SCENE.astype(int) * (10 + frame) // 20
    return np.asarray(brightened, np.uint8)


def percept(number: int) -> Percept:
    return Percept(
        name=f"town_hall_{number}",
        activation=0.9,
        evidence=0.9,
        bearing_rad=0.3 - 0.5 * number,
        range_m=12.0,
        bearing_sd_rad=0.02,
        range_sd_m=0.4,
        width_m=6.0,
        height_m=6.0,
        whole=True,
        box_px=(40 + 100 * number, 60, 80, 100),
        outline_px=OUTLINE if number == 0 else [],
    )


def view(frame: int, image: Pixels | None = None) -> View:
    pixels = shade(frame) if image is None else image
    return View(
        stamp_ns=frame,
        frame=frame,
        image=Array.of(pixels),
        depth_m=Array.of(DEPTH_M),
        calibration=CAMERA,
    )


def answer(frame: int) -> Percepts:
    road_m = itertools.product(np.arange(3.2, 14, 0.5), np.arange(-3.7, 4, 0.5))
    ends_m = itertools.product(range(5, 14), (-4.0, 4.0))
    return Percepts(
        stamp_ns=frame,
        frame=frame,
        objects=[percept(number) for number in range(RECOGNISED[frame])],
        road_m=Array.of(np.array(list(road_m), np.float32)),
        road_boundary_m=Array.of(np.array(list(ends_m), np.float32)),
    )


def write(path: Path, messages: list[Message]) -> Path:
    """A log with a message every second."""
    rows = [(number * SECOND_NS, message) for number, message in enumerate(messages, 1)]
    return write_log(path, rows)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Views 3 to 7, a second each, of which 4, 5 and 7 have percepts half a second later."""
    messages: list[Message] = []
    for frame in range(FIRST, FIRST + FRAMES):
        pair = StereoFrame(
            frame=frame,
            stamp_ns=frame,
            left=Array.of(shade(frame)),
            right=Array.of(255 - shade(frame)),
            calibration=CAMERA,
        )
        messages += [view(frame), pair]
        if frame in RECOGNISED:
            messages.append(answer(frame))
    return write(tmp_path_factory.mktemp("pictures") / "drive.mcap", messages)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Images go into a folder of their own."""
    monkeypatch.chdir(tmp_path)


def read(path: str | Path) -> Pixels:
    image = cv2.imread(str(path))
    assert image is not None
    return np.asarray(image[..., ::-1], np.uint8)


def test_an_image_has_the_pixels_of_the_view_one_for_one(drive: Path) -> None:
    printed = log_command("image", drive, "--frame", "4").stdout

    assert printed == f"drive-frame-4-view.png: sensory/view, frame 4 at 2.000 s of {drive}\n"
    assert np.array_equal(read("drive-frame-4-view.png"), shade(4))


def test_what_has_no_name_is_counted_and_shown_without_one(tmp_path: Path) -> None:
    strangers = [msgspec.structs.replace(percept(number), name="") for number in range(2)]
    seen = msgspec.structs.replace(answer(5), objects=[percept(0), *strangers])
    log = write(tmp_path / "strangers.mcap", [view(5), seen])

    printed = log_command("perception", log, "-o", "figure.png").stdout

    assert printed.endswith("with town_hall_0, 2 without a name\n")


def test_the_pictures_of_a_wide_camera_stand_below_each_other(tmp_path: Path) -> None:
    wide = msgspec.structs.replace(CAMERA, height_px=100, cy_px=50.0)
    cut = msgspec.structs.replace(
        view(4, shade(4)[:100]), depth_m=Array.of(DEPTH_M[:100]), calibration=wide
    )
    log = write(tmp_path / "wide.mcap", [cut, answer(4)])

    log_command("perception", log, "-o", "figure.png")

    height_px, _, _ = read("figure.png").shape
    assert height_px > 949


def test_a_grey_camera_is_shown_in_grey(tmp_path: Path) -> None:
    grey = np.ascontiguousarray(SCENE[..., 0])
    pair = StereoFrame(
        frame=4, stamp_ns=4, left=Array.of(grey), right=Array.of(grey), calibration=CAMERA
    )
    log = write(tmp_path / "grey.mcap", [pair])
    log_command("image", log, "--camera", "left", "-o", "left.png")

    assert np.array_equal(read("left.png"), np.dstack([grey] * 3))


def levels(colour: str) -> npt.NDArray[np.float64]:
    """Red, green and blue of a colour, from 0 to 255."""
    return np.array(to_rgb(colour)) * 255


def enlarged(path: str | Path) -> npt.NDArray[np.int64]:
    """The middle of each enlarged pixel of the view in an image."""
    shown = read(path)[1 : SCALE * 240 : SCALE, 1 : SCALE * 320 : SCALE]
    return shown.astype(int)


def test_it_is_the_view_in_the_middle_or_the_nearest_to_a_time(drive: Path) -> None:
    middle = log_facts("image", drive)
    assert middle["frame"] == 5
    assert middle["topic"] == "sensory/view"
    assert middle["objects"] is None

    near = log_facts("image", drive, "--at", "3.2")
    assert near["frame"] == 4
    assert near["at_s"] == 2.0
    assert near["stamp_ns"] == 4
    assert np.array_equal(read(near["path"]), shade(4))


def test_a_camera_is_shown_as_it_gave_its_image(drive: Path) -> None:
    log_command("image", drive, "--frame", "6", "--camera", "right", "-o", "right.png")
    log_command("image", drive, "--frame", "6", "--camera", "left", "-o", "left.JPG")

    left = read("left.JPG").astype(int)
    right = read("right.png")

    assert np.array_equal(right, 255 - shade(6))
    assert np.abs(left - shade(6)).mean() < 6


def test_depth_is_coloured_by_distance_grey_where_unknown_and_has_a_scale(drive: Path) -> None:
    log_command("image", drive, "--frame", "6", "--depth", "-o", "depth.png")
    shown = read("depth.png").astype(int)
    assert shown.shape == (SCALE * 240, SCALE * 320 + draw.SCALE_PX, 3)

    pixels = enlarged("depth.png")
    grey = np.round(levels(KERB))
    is_grey = np.abs(pixels - grey).max(axis=-1) <= 1
    assert np.array_equal(is_grey, DEPTH_M == 0)

    nearer_and_nearer = pixels[130:, 310]
    green = nearer_and_nearer[:, 1]
    assert len(np.unique(nearer_and_nearer, axis=0)) > 50
    assert (np.diff(green) >= 0).all()

    scale = shown[:, SCALE * 320 :]
    assert np.ptp(scale) > 100


def test_percepts_are_outlined_where_they_are_and_leave_the_rest_of_the_view(drive: Path) -> None:
    facts = log_facts("image", drive, "--frame", "5", "--percepts")
    assert facts["objects"] == ["town_hall_0", "town_hall_1"]

    shown = enlarged(facts["path"])
    first = shown[110, 40]
    second = shown[110, 219]
    assert read(facts["path"]).shape == (SCALE * 240, SCALE * 320, 3)
    # A pixel at an outline is partly of what is beside it.
    colours = np.array([levels(colour) for colour in SEVERAL])
    assert np.abs(colours - first).max(axis=1).argmin() == 0
    assert np.abs(colours - second).max(axis=1).argmin() == 1

    changed = np.abs(shown - shade(5)).max(axis=-1) > 1
    assert changed[75:145, 45:115].all()
    assert not changed[:, :20].any()
    assert not changed[165:].any()


def test_with_percepts_only_views_that_were_answered_are_chosen(drive: Path) -> None:
    facts = log_facts("image", drive, "--percepts", "--at", "7.4")

    assert facts["frame"] == 5
    with pytest.raises(
        UsageError, match=r"no frame 6 in .*: there are 3, from 4 to 7, and 5 is the nearest"
    ):
        log_command("image", drive, "--percepts", "--frame", "6")


def test_the_plot_has_the_most_percepts(drive: Path) -> None:
    facts = log_facts("perception", drive)

    assert facts["path"] == "drive-frame-5-perception.png"
    assert facts["frame"] == 5
    assert facts["objects"] == ["town_hall_0", "town_hall_1"]
    assert read(facts["path"]).shape == (949, 1690, 3)


def test_the_plot_has_the_same_bytes_each_time(drive: Path) -> None:
    log_command("perception", drive, "--frame", "4", "-o", "first.pdf")
    log_command("perception", drive, "--frame", "4", "-o", "second.pdf")
    first = Path("first.pdf").read_bytes()
    second = Path("second.pdf").read_bytes()

    assert first.startswith(b"%PDF")
    assert first == second


def test_a_view_in_which_nothing_was_recognised_has_a_plot_too(tmp_path: Path) -> None:
    unknown = Array.of(np.zeros((240, 320), np.float32))
    nothing = Array.of(np.empty((0, 2), np.float32))
    blind = msgspec.structs.replace(view(0), depth_m=unknown)
    log = write(tmp_path / "empty.mcap", [blind, Percepts(frame=0, objects=[], road_m=nothing)])

    log_command("perception", log, "-o", "figure.png")
    printed = log_command("image", log, "--percepts", "--depth").stdout

    assert read("figure.png").shape == (949, 1690, 3)
    assert "with nothing recognised" in printed


def test_the_reference_drive_has_its_plot() -> None:
    facts = log_facts("perception", REFERENCE, "-o", "reference.png")

    assert facts["objects"]


@pytest.mark.parametrize(
    ("left_m", "colour"),
    [(0.0, ASPHALT), (3.8, ASPHALT), (-3.8, ASPHALT), (4.2, GRASS), (-4.2, GRASS)],
)
def test_ground_is_laid_into_the_image_where_the_camera_sees_it(
    left_m: float, colour: tuple[int, int, int]
) -> None:
    image = painted([])[0].astype(int)
    ahead_m = np.arange(4.0, 15.0, 0.5)
    points_m = np.stack([ahead_m, np.full_like(ahead_m, left_m)], axis=1)
    pixels = np.rint(ground.to_image(points_m, CAMERA)).astype(int)
    inside = (pixels >= 0) & (pixels < (320, 240))
    column, row = pixels[inside.all(axis=1)].T

    assert len(row) > 10
    assert np.abs(image[row, column] - colour).max() < 20


def test_labels_stay_inside_and_hide_none_of_the_others() -> None:
    labels = [Label(f"number {n}", 9.7, 0.1 * n, "#000000") for n in range(6)]
    axes, boxes = placed(labels)
    inside = axes.get_window_extent()

    for number, box in enumerate(boxes):
        assert inside.x0 <= box.x0 < box.x1 <= inside.x1
        assert inside.y0 <= box.y0 < box.y1 <= inside.y1
        assert not any(box.overlaps(other) for other in boxes[:number])


def placed(labels: list[Label]) -> tuple[Axes, list[Bbox]]:
    figure = Figure(figsize=(4, 3))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 10), ylim=(0, 10))
    place(axes, labels, size=9)

    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in axes.texts]
    return axes, boxes


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["image", "--frame", "99"],
            r"no frame 99 in .*: there are 5, from 3 to 7, and 7 is the nearest",
        ),
        (["image", "--at", "60"], r"lasts 12.000 s: choose a time before that, not 60 s"),
        (
            ["image", "-o", "view.gif"],
            r"-o view.gif: name a file that ends in .png or .jpg or .jpeg",
        ),
        (["perception", "-o", "figure"], r"-o figure: name a file that ends in .png or .pdf"),
        (["image", "-o", "nowhere/view.png"], r"there is no folder nowhere: make it first"),
        (
            ["image", "--frame", "4", "--at", "1"],
            r"--frame and --at both name a view: leave one out",
        ),
        (
            ["image", "--camera", "left", "--depth"],
            r"leave out --camera, or --depth and --percepts",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_is_wrong_is_named_with_the_remedy(
    drive: Path, arguments: list[str], words: str
) -> None:
    with pytest.raises((UsageError, ClickUsageError), match=words):
        log_command(arguments[0], drive, *arguments[1:])
    assert not list(Path().iterdir())


def test_a_picture_that_cannot_be_written_is_one_sentence(drive: Path) -> None:
    Path("taken.png").mkdir()

    for command in ("image", "perception"):
        with pytest.raises(LogError, match=r"cannot write taken\.png \(Is a directory\)"):
            log_command(command, drive, "-o", "taken.png")


def test_a_log_without_views_or_percepts_names_the_command_that_helps(tmp_path: Path) -> None:
    with pytest.raises(
        LogError, match=r"holds no sensory/view: `cogmap log info .*` shows what it holds"
    ):
        log_command("image", write(tmp_path / "none.mcap", [answer(4)]))
    with pytest.raises(LogError, match=r"holds no epam/percepts of any of its 1 frames"):
        log_command("perception", write(tmp_path / "views.mcap", [view(4)]))


def test_a_view_whose_image_is_none_is_named(tmp_path: Path) -> None:
    log = write(tmp_path / "grey.mcap", [view(4, SCENE[..., 0]), answer(4)])

    for command in ("image", "perception"):
        with pytest.raises(
            LogError, match=r"grey.mcap, frame 4: expected a uint8 image \(height, width, 3\), got"
        ):
            log_command(command, log)
