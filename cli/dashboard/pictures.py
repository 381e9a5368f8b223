"""The pictures of the page: views, depth, place nodes, costs. Pure."""

from __future__ import annotations

import base64
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from cogmap.cli.plots.palette import KERB, OBJECT, ROAD
from cogmap.geometry.arrays import Singles
from cogmap.graph.graph import Graph
from cogmap.recording.views import camera_image, depth
from cogmap.schemas.nodes import ROOT_MAP, PlaceColumn
from cogmap.schemas.sensing import View

JPEG_QUALITY = 85
NEAREST_M = 1.0
FARTHEST_M = 100.0
OBSTACLE = "#8d5fc4"
OPACITY = 200
DEAREST = 1000.0
"""Of a place that is not blocked: way back that is blocked since."""

JPEG = "image/jpeg"
PNG = "image/png"
Pixels = npt.NDArray[np.uint8]


def data_url(kind: str, content: bytes) -> str:
    """Return an address that is the picture itself: a page that has it asks for nothing more."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def view_jpeg(view: View) -> bytes:
    """Encode the image of a view. Raises LogError if it is none."""
    image = camera_image(view.image, "the view's image")
    return _encoded(
        ".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    )


def depth_jpeg(view: View) -> bytes:
    """Encode the depth of a view in colours that go by its logarithm, from NEAREST_M to FARTHEST_M;
    grey where it is unknown. Raises LogError if it is none.
    """
    depth_m = depth(view.depth_m, "the view's depth")
    known = depth_m > 0
    span = np.log(FARTHEST_M / NEAREST_M)
    share = np.log(np.maximum(depth_m, NEAREST_M) / NEAREST_M) / span
    levels = np.asarray(255 * (1 - share.clip(0, 1)), np.uint8)
    colours = cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS)
    colours[~known] = _rgb(KERB)[::-1]
    return _encoded(".jpg", colours, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])


def places_png(graph: Graph) -> bytes:
    """Draw the root map's place nodes, north up, a pixel each: road, over it what stands there, and
    over both the places that are active.
    """
    columns = (PlaceColumn.ROAD, PlaceColumn.OBSTACLE)
    window = graph.places.window(ROOT_MAP, columns)
    width, height = window.shape
    pixels = np.zeros((max(height, 1), max(width, 1), 4), np.uint8)
    if width and height:
        _paint(pixels, window.column(PlaceColumn.ROAD), ROAD)
        _paint(pixels, window.column(PlaceColumn.OBSTACLE), OBSTACLE)
        _paint(pixels, _activation(graph), OBJECT)
    return _encoded(".png", pixels, [])


def costs_png(cost: Singles) -> bytes:
    """Draw what it costs to drive over places, (width, height), north up, a pixel each: the dearer
    the darker, by the logarithm up to DEAREST. What is blocked is grey.
    """
    is_blocked = ~np.isfinite(cost)
    share = np.log(np.where(is_blocked, DEAREST, cost.clip(1.0, DEAREST))) / np.log(DEAREST)
    levels = np.asarray(255 * (1 - np.flipud(share.T)), np.uint8)
    pixels = cv2.cvtColor(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2BGRA)
    pixels[np.flipud(is_blocked.T), :3] = _rgb(KERB)[::-1]
    pixels[..., 3] = OPACITY
    return _encoded(".png", pixels, [])


def _activation(graph: Graph) -> npt.NDArray[np.float32]:
    """Return the activation of the root map's place nodes in this cycle, (width, height)."""
    extent = graph.places.extent(ROOT_MAP)
    active = np.zeros(extent.shape, np.float32)
    west, south = extent.lower
    for (_, x, y), tile in graph.places.of_map(ROOT_MAP):
        values = tile.activation(graph.cycle, graph.decay.place_activation)
        side_i, side_j = values.shape
        i = x * side_i - west
        j = y * side_j - south
        active[i : i + side_i, j : j + side_j] = values
    return active


def _paint(pixels: Pixels, shares: npt.NDArray[np.float32], colour: str) -> None:
    """Lay a colour over BGRA pixels, as opaque as each cell's share."""
    upright = np.flipud(shares.T)
    is_seen = upright > 0
    share = upright[is_seen].clip(0, 1)[:, None]
    colour_bgr = np.array(_rgb(colour)[::-1], np.float32)
    below = pixels[is_seen]
    below[:, :3] = below[:, :3] * (1 - share) + colour_bgr * share
    below[:, 3] = np.maximum(below[:, 3], OPACITY * share[:, 0])
    pixels[is_seen] = below


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def _encoded(suffix: str, pixels: npt.NDArray[Any], options: list[int]) -> bytes:
    _, encoded = cv2.imencode(suffix, pixels, options)
    return encoded.tobytes()
