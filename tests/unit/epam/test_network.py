"""Which processor runs the networks."""

from __future__ import annotations

import onnxruntime
import pytest

from cogmap.errors import ConfigError
from cogmap.services.epam.config import Config
from cogmap.services.epam.module import build
from cogmap.services.epam.network import CPU_PROVIDER, CUDA_PROVIDER, GPU_PROVIDERS, provider_of

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
