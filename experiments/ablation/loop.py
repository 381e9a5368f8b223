"""Figure 6 of the paper: a path round some blocks, whose end leads along its beginning again."""

from __future__ import annotations

from dataclasses import dataclass

from cogmap.experiments.ablation.outcome import Outcome, carried
from cogmap.experiments.ablation.variants import Rules, with_variant
from cogmap.experiments.loop_closing.observer import rms_m
from cogmap.experiments.loop_closing.run import MODULES, driven, sections
from cogmap.services import registry

METHOD = "heading"
"""The method of correction of `loop_closing` that is ours."""


@dataclass(frozen=True)
class LoopDrive:
    """The path once, with the noise of a seed."""

    seed: int

    def drive(self, rules: Rules) -> Outcome:
        """Drive it. The error is the root mean square of the path's on the map in the end, in m.

        Self-motion is that of the wheels: there are no images. Raises CogmapError if no loop was
        closed, or a message was refused.
        """
        configured = with_variant(sections(self.seed, METHOD), rules)
        loop = driven(configured, [registry.build(name, configured) for name in MODULES])

        true_m = loop.end.true_path_m
        fused_m = rms_m(loop.fused_path_m - true_m)
        wheels_m = rms_m(loop.wheels_path_m - true_m)
        return carried(loop.end.path_error_m, fused_m, wheels_m)
