"""The road network for photographs sees the same in another light."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec

import pytest

pytestmark = pytest.mark.skipif(
    find_spec("torch") is None and "CI" not in os.environ,
    reason="training needs torch: make train-setup",
)
NORMALIZED = """
import json
import numpy as np
import torch
from cogmap.services.epam.layout.road import HEIGHT_PX, WIDTH_PX, network_input
from cogmap.training.networks.photograph import normalized

rng = np.random.default_rng(3)
coarse = rng.uniform(60, 250, (1, HEIGHT_PX // 8, WIDTH_PX // 8, 3))
image = coarse.repeat(8, axis=1).repeat(8, axis=2)

def seen(factor):
    pixels = (image * factor).astype(np.uint8)
    return normalized(torch.from_numpy(network_input(pixels)[:, :3]))

ground = np.ones((HEIGHT_PX, 1, 1))
ground[HEIGHT_PX // 2:] = 0.4
plain = seen(1.0)
differences = {
    "darker": seen(0.4) - plain,
    "tinted": seen(np.array([0.7, 0.85, 1.0])) - plain,
    "lower_half_darker": seen(ground) - plain,
}
print(json.dumps({
    name: float(found[:, :1, -30:].abs().mean() / plain[:, :1, -30:].abs().mean())
    for name, found in differences.items()
} | {"tint_of_tinted": float(differences["tinted"][:, 2:].abs().mean())}))
"""


def test_darker_tinted_or_in_part_in_the_shade_a_view_has_the_same_contrasts() -> None:
    done = subprocess.run(
        [sys.executable, "-c", NORMALIZED], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr

    changes = json.loads(done.stdout)
    assert changes["darker"] < 0.03
    assert changes["tinted"] < 0.03
    assert changes["lower_half_darker"] < 0.05
    assert changes["tint_of_tinted"] < 0.03
