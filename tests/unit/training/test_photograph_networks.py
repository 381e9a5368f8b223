"""The networks for photographs: what they see in another light, and what their files hold."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(
    find_spec("torch") is None and "CI" not in os.environ,
    reason="training needs torch: make train-setup",
)
FEATURES = """
import json
import torch
from cogmap.training.networks.encoder import FEATURES, OFFSET, SCALE, Encoder

torch.manual_seed(1)
encoder = Encoder().eval()
shares = torch.rand(1, 3, 64, 96) * 0.4 + 0.2

def features(image):
    with torch.no_grad():
        return encoder(image / SCALE - OFFSET)

plain = features(shares)
assert [tuple(of.shape[1:]) for of in plain] == [
    (channels, 64 // stride, 96 // stride)
    for channels, stride in zip(FEATURES, (4, 8, 16, 32), strict=True)
]

def difference(image):
    changed = features(image)
    return max(
        float((one - other).abs().max() / one.abs().max())
        for one, other in zip(plain, changed, strict=True)
    )

print(json.dumps({"darker": difference(shares * 0.5), "mirrored": difference(shares.flip(3))}))
"""
ODDS = """
import json
import torch
from cogmap.training.networks.photograph import log_odds

torch.manual_seed(1)
classes = torch.randn(2, 11, 4, 6)
share = torch.softmax(classes, 1)[:, 3:4]
difference = (torch.sigmoid(log_odds(classes, 3)) - share).abs().max()
print(json.dumps({"difference": float(difference)}))
"""
HALVED = """
import json
import sys
from pathlib import Path
import numpy as np
import torch
from cogmap.services.epam.network import Network
from cogmap.training.networks.export import export, halve

torch.manual_seed(1)
path = Path(sys.argv[1])
wide = torch.nn.Conv2d(3, 64, 3, padding=1)
net = torch.nn.Sequential(wide, torch.nn.Conv2d(64, 2, 3, padding=1))
export(net, path, "seen", (1, 3, 8, 8), ["shown"], any_size=True)
values = np.random.default_rng(1).random((1, 3, 12, 20), np.float32)

def shown():
    (output,) = Network(path, (1, 3, None, None), {"shown": (1, 2, None, None)})(values)
    return output

before = shown()
whole_bytes = path.stat().st_size
halve(path)
after = shown()
print(json.dumps({
    "shape": after.shape,
    "difference": float(np.abs(after - before).max() / np.abs(before).max()),
    "size": path.stat().st_size / whole_bytes,
}))
"""


def _printed(program: str, *arguments: str) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    printed: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return printed


def test_a_darker_view_has_the_same_features() -> None:
    changes = _printed(FEATURES)

    assert changes["darker"] < 1e-3
    assert changes["mirrored"] > 0.1


def test_odds_of_a_class_are_those_of_its_share_of_all_classes() -> None:
    assert _printed(ODDS)["difference"] < 1e-6


def test_a_network_in_half_precision_gives_what_it_gave_for_views_of_any_size(
    tmp_path: Path,
) -> None:
    halved = _printed(HALVED, str(tmp_path / "net.onnx"))

    assert halved["shape"] == [1, 2, 12, 20]
    assert 0 < halved["difference"] < 0.005
    assert halved["size"] < 0.65
