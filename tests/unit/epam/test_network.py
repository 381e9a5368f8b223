"""Which processor runs the networks."""

from __future__ import annotations

from pathlib import Path

import onnxruntime
import pytest

from cogmap.errors import ConfigError
from cogmap.files.digests import DIGESTS, read_checked, write_digests
from cogmap.services.epam.config import Config
from cogmap.services.epam.layout import road
from cogmap.services.epam.module import CAMVID, build
from cogmap.services.epam.network import (
    CPU_PROVIDER,
    CUDA_PROVIDER,
    FREE_AREA_PX,
    GPU_PROVIDERS,
    WEIGHTS,
    Network,
    provider_of,
)

COREML = "CoreMLExecutionProvider"


def test_the_cpu_runs_them_though_there_is_a_gpu() -> None:
    assert provider_of("cpu", [CUDA_PROVIDER, CPU_PROVIDER]) == CPU_PROVIDER


@pytest.mark.parametrize(
    ("installed", "taken"),
    [
        ([CPU_PROVIDER, CUDA_PROVIDER], CUDA_PROVIDER),
        ([COREML, CPU_PROVIDER], COREML),
        ([COREML, CUDA_PROVIDER, CPU_PROVIDER], CUDA_PROVIDER),
    ],
)
def test_the_gpu_runs_them_by_the_first_provider_that_is_installed(
    installed: list[str], taken: str
) -> None:
    assert provider_of("gpu", installed) == taken


def test_a_gpu_that_is_not_there_is_refused_in_a_sentence() -> None:
    if not set(GPU_PROVIDERS).isdisjoint(onnxruntime.get_available_providers()):
        pytest.skip("the installed ONNX Runtime has a provider for a GPU")

    with pytest.raises(ConfigError, match=r"set epam\.processor to cpu"):
        build(Config(processor="gpu"), "epam")


def test_networks_have_the_names_that_onnx_runtime_gives_its_providers() -> None:
    assert set(GPU_PROVIDERS) < set(onnxruntime.get_all_providers())


def _road(path: Path) -> Network:
    return Network(path, (1, road.CHANNELS, None, None), road.OUTPUT_SHAPES)


@pytest.mark.parametrize("view", [(240, 320), (185, 613), (1080, 1920)])
def test_a_network_of_one_size_receives_every_view_at_that_size(view: tuple[int, int]) -> None:
    size = _road(road.DEFAULT_PATH).view_size(view, road.PADDING_PX)

    assert size == (road.HEIGHT_PX, road.WIDTH_PX, road.PADDING_PX)


@pytest.mark.parametrize("view", [(240, 320), (185, 613), (1080, 1920), (640, 480)])
def test_a_network_of_any_size_receives_views_in_about_their_proportions(
    view: tuple[int, int],
) -> None:
    height, width = view
    size = _road(CAMVID / "road.onnx").view_size(view, road.PADDING_PX)

    assert size.width_px / size.height_px == pytest.approx(width / height, rel=0.15)
    assert size.width_px * size.height_px == pytest.approx(FREE_AREA_PX, rel=0.12)
    assert size.padding_px == 0


BUNDLED = [*WEIGHTS.glob("*.onnx"), *CAMVID.glob("*.onnx")]


@pytest.mark.parametrize("path", BUNDLED, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_bundled_weights_of_which_a_bit_is_another_are_refused(path: Path, tmp_path: Path) -> None:
    content = bytearray(path.read_bytes())
    changed = tmp_path / path.name
    changed.write_bytes(content)
    (tmp_path / DIGESTS).write_bytes((path.parent / DIGESTS).read_bytes())
    assert read_checked(changed) == content

    content[len(content) // 2] ^= 1
    changed.write_bytes(content)
    with pytest.raises(ConfigError, match=rf"{path.name} does not have its digest.*train it again"):
        Network(changed, (1,), {})


def test_weights_without_a_digest_are_refused_with_the_way_to_write_one(tmp_path: Path) -> None:
    alone = tmp_path / "road.onnx"
    alone.write_bytes(road.DEFAULT_PATH.read_bytes())
    with pytest.raises(ConfigError, match=r"sha256sum road\.onnx >> SHA256SUMS"):
        _road(alone)

    write_digests(alone)
    _road(alone)
