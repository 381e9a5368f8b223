"""Images of ROS in every encoding that is read."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from cogmap.data.bags.images import ENCODINGS, image_of
from cogmap.errors import UsageError

RGB = (200, 120, 40)
GREY = 90
SITES = {"r": 0, "g": 1, "b": 2}


def _message(pixels: np.ndarray[Any, Any], encoding: str, *, padding: int = 0, big: int = 0) -> Any:
    """A message of (h, w, ...) pixels, with so many bytes behind each row."""
    rows = np.ascontiguousarray(pixels).reshape(len(pixels), -1).view(np.uint8)
    padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=255)
    return SimpleNamespace(
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=big,
        step=padded.shape[1],
        data=padded.ravel(),
    )


def _mosaic(order: str) -> np.ndarray[Any, Any]:
    """What a sensor whose upper left four pixels have that order of colours sees of RGB."""
    colours = [RGB[SITES[site]] for site in order]
    return np.tile(np.array(colours, np.uint8).reshape(2, 2), (4, 4))


def _coloured(encoding: str) -> np.ndarray[Any, Any]:
    """Pixels of RGB in an encoding of colours."""
    if encoding.startswith("bayer"):
        return _mosaic(encoding.removeprefix("bayer_").rstrip("168"))
    order = "bgr" if encoding == "8UC3" else encoding.rstrip("8")
    values = [(*RGB, 255)["rgba".index(channel)] for channel in order]
    return np.full((8, 8, len(values)), values, np.uint8)


@pytest.mark.parametrize("encoding", ["mono8", "8UC1"])
def test_grey_images_are_as_they_are(encoding: str) -> None:
    pixels = np.arange(48, dtype=np.uint8).reshape(6, 8)

    assert np.array_equal(image_of(_message(pixels, encoding), "it"), pixels)


@pytest.mark.parametrize("big", [0, 1])
def test_of_sixteen_bits_the_upper_eight_are_taken(big: int) -> None:
    pixels = np.full((6, 8), GREY * 256 + 7, ">u2" if big else "<u2")

    assert np.unique(image_of(_message(pixels, "mono16", big=big), "it")).tolist() == [GREY]


COLOURS = [name for name in ENCODINGS if name.endswith("8") and name != "mono8"] + ["8UC3"]


@pytest.mark.parametrize("encoding", COLOURS)
def test_colours_are_red_green_and_blue(encoding: str) -> None:
    image = image_of(_message(_coloured(encoding), encoding, padding=4), "it")

    assert image.shape == (8, 8, 3)
    assert np.unique(image.reshape(-1, 3), axis=0).tolist() == [list(RGB)]


@pytest.mark.parametrize("encoding", [name for name in ENCODINGS if name.startswith("bayer")])
def test_mosaics_are_told_apart(encoding: str) -> None:
    pixels = _coloured(encoding)
    if encoding.endswith("16"):
        pixels = pixels.astype("<u2") << 8

    image = image_of(_message(pixels, encoding), "it")

    assert image[4, 4].tolist() == list(RGB)


def test_compressed_images_keep_their_colours() -> None:
    _, content = cv2.imencode(".png", np.full((6, 8, 3), RGB[::-1], np.uint8))
    message = SimpleNamespace(format="bgr8; png compressed bgr8", data=content.ravel())

    assert image_of(message, "it")[0, 0].tolist() == list(RGB)


@pytest.mark.parametrize("data", [b"", b"no image", b"\x89PNG\r\n\x1a\n"])
def test_a_compressed_image_that_is_none_is_said(data: bytes) -> None:
    message = SimpleNamespace(format="jpeg", data=np.frombuffer(data, np.uint8))

    with pytest.raises(UsageError, match="it cannot be decoded as jpeg"):
        image_of(message, "it")


def test_rows_that_are_too_short_are_said() -> None:
    message = _message(np.zeros((6, 8), np.uint8), "mono16")

    with pytest.raises(UsageError, match="48 bytes for 8 x 6 pixels, mono16"):
        image_of(message, "it")
