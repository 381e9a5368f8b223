"""Training perception's networks: one seed gives the same weights, and what is missing is named."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from cogmap.errors import UsageError
from services.epam.layout.road import load
from services.epam.recognition import objects, segments
from services.sim.layout.catalogue import CATALOGUE
from tests.support.blocks import CAMERA, painted
from training.__main__ import train
from training.rendering.dataset import Job, render

needs_torch = pytest.mark.skipif(
    find_spec("torch") is None and "CI" not in os.environ,
    reason="training needs torch: make train-setup",
)
TRAINING = """
import sys
from pathlib import Path
from training.camvid import train_on_photographs

folder, out = map(Path, sys.argv[1:])
for name, seed in (("a", 3), ("b", 3), ("c", 4)):
    train_on_photographs(folder, out / f"{name}.onnx", seed, epochs=1, samples=16)
"""


def _python(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in a process of its own: torch's compiler and the simulator's renderer each bring an
    LLVM, and no process bears both.
    """
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four small street photographs, in CamVid's folders."""
    for name in ("train", "trainannot"):
        (tmp_path / name).mkdir()
    for number in range(4):
        image, depth_m, _ = painted([], road_half_m=3.0 + number, seed=number)
        grey = (np.ptp(image.astype(int), axis=2) < 40) & (depth_m > 0)
        cv2.imwrite(str(tmp_path / "train" / f"{number}.png"), image[..., ::-1])
        cv2.imwrite(
            str(tmp_path / "trainannot" / f"{number}.png"),
            np.where(grey, 3, 11 * (number == 0)).astype(np.uint8),
        )
    return tmp_path


@needs_torch
def test_training_twice_from_one_seed_gives_the_same_weights_and_from_another_others(
    folder: Path, tmp_path: Path
) -> None:
    done = _python("-c", TRAINING, str(folder), str(tmp_path))
    assert done.returncode == 0, done.stderr
    first, again, other = ((tmp_path / f"{name}.onnx").read_bytes() for name in "abc")
    assert again == first
    assert other != first
    image = painted([])[0]
    assert load(tmp_path / "a.onnx").mask(image).shape == image.shape[:2]


def test_without_torch_the_remedy_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("torch", "training.camvid", "training.road", "training.unet"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "torch", None)
    run = CliRunner().invoke(
        train, ["road", "--camvid", str(folder), "--out", str(folder / "a.onnx")]
    )
    assert isinstance(run.exception, UsageError)
    assert "pip install 'cogmap[train]'" in str(run.exception)


@pytest.mark.parametrize("arguments", [[], ["DATA", "--camvid", "PHOTOGRAPHS"]])
def test_roads_are_learned_from_one_kind_of_folder(arguments: list[str]) -> None:
    run = CliRunner().invoke(train, ["road", *arguments])
    assert isinstance(run.exception, UsageError)
    assert "either DATA_DIR" in str(run.exception)


@needs_torch
def test_segments_and_objects_are_learned_from_renderings_the_same_each_time(
    tmp_path: Path,
) -> None:
    for split, seed, unknown in (("train", 4007, 0), ("strangers", 4008, 30), ("val", 4009, 20)):
        render(Job(seed, 8, unknown, tmp_path / split / f"town-{seed}.npz"))
    said = {}
    for name in ("segments", "objects"):
        for out in ("a", "b"):
            weights = tmp_path / out / f"{name}.onnx"
            done = _python(
                "-m",
                "training",
                name,
                str(tmp_path),
                "--out",
                str(weights),
                "--epochs",
                "1",
                "--seed",
                "3",
            )
            assert done.returncode == 0, done.stderr
            said[out] = done.stdout.replace(str(weights), "")
        assert said["a"] == said["b"]
    for name in ("segments.onnx", "objects.onnx", "objects.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert objects.load(tmp_path / "a" / "objects.onnx").sizes_m.keys() <= {
        kind.name for kind in CATALOGUE
    }
    image, depth_m, _ = painted([])
    found = segments.load(tmp_path / "a" / "segments.onnx").segments(image, depth_m, CAMERA)
    assert all(each.mask.shape == depth_m.shape for each in found)


@needs_torch
def test_a_folder_without_renderings_is_named_before_anything_is_trained(tmp_path: Path) -> None:
    done = _python("-m", "training", "road", str(tmp_path), "--out", str(tmp_path / "a.onnx"))
    assert done.returncode == 2
    assert "training.rendering.dataset" in done.stderr
    assert "Traceback" not in done.stderr


def test_photographs_are_tested_alone_by_weights_that_must_be_there(
    folder: Path, tmp_path: Path
) -> None:
    out = tmp_path / "none.onnx"
    pair = (str(folder / "train"), str(folder / "trainannot"))
    run = CliRunner().invoke(train, ["road", "--camvid-test", *pair, "--out", str(out)])
    assert isinstance(run.exception, UsageError)
    assert "none.onnx" in str(run.exception)
