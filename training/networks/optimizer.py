"""Optimization that gives the same weights from one seed: AdamW with one cycle of the learning
rate, on one thread.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch
from torch import Tensor, nn


def seed_torch(seed: int) -> None:
    """Make what torch computes from here on a function of `seed` alone."""
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(True)
    torch.utils.deterministic.fill_uninitialized_memory = False
    torch.set_num_threads(1)


def training_device() -> torch.device:
    """Return the GPU, if there is one, else the processor. On a GPU one seed no longer gives
    exactly the same weights: not all that training needs is computed in a fixed order there.
    """
    if not torch.cuda.is_available():
        return torch.device("cpu")

    torch.use_deterministic_algorithms(mode=False)
    return torch.device("cuda")


def mixed_precision() -> torch.autocast:
    """Return a context in which a network computes in bfloat16 where the processor can: one without
    AVX-512 would take ten times as long as in single precision (measured on such a one).
    """
    is_fast = torch.backends.cpu.get_cpu_capability().startswith("AVX512")
    return torch.autocast("cpu", torch.bfloat16, enabled=is_fast)


class Optimizer:
    """AdamW (Loshchilov & Hutter 2019), whose learning rate rises to `max_rate` in the share
    `warm_up` of all steps and then falls (Smith & Topin 2019). Parameters in groups have one such
    rate a group.
    """

    def __init__(
        self,
        parameters: Iterable[nn.Parameter] | Iterable[dict[str, Any]],
        steps: int,
        max_rate: float | list[float],
        weight_decay: float,
        warm_up: float = 0.1,
    ) -> None:
        self._adam = torch.optim.AdamW(parameters, weight_decay=weight_decay)
        self._rate = torch.optim.lr_scheduler.OneCycleLR(
            self._adam, max_rate, total_steps=steps, pct_start=warm_up
        )

    def step(self, loss: Tensor) -> float:
        """Change the parameters against the gradient of `loss`, and return its value."""
        self._adam.zero_grad()
        loss.backward()
        self._adam.step()
        self._rate.step()
        return float(loss.item())
