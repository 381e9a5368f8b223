"""Settings of perception."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from cogmap.schemas.base import Share

WeightsPath = Annotated[str, msgspec.Meta(max_length=4096)]
Processor = Literal["cpu", "gpu"]
WeightsSet = Literal["rendered", "camvid"]


class Priming(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How what was conscious makes perception expect what it goes with, and feel about it."""

    share: Annotated[
        Share,
        msgspec.Meta(
            description="How much likelier all names together are, at most, for what was "
            "conscious just before, as a share of 1; at 0 nothing is primed. LIDA: "
            "0.9 of a node's activation is passed on (upscale; downscale 0.5), and "
            "added; here it changes the prior of names, because activation is the "
            "probability of a name."
        ),
    ] = 0.5
    half_life_s: Annotated[
        float,
        msgspec.Meta(
            gt=0,
            le=3600,
            description="The activation of a PAM node halves in so many seconds after it was "
            "conscious. LIDA: falls by 0.05 a tick, to 0 in 100 ms; here halves in 3 "
            "s, because a view is primed by what was conscious two views, 400 ms, "
            "before it.",
        ),
    ] = 3.0
    feeling_threshold: Annotated[
        Share,
        msgspec.Meta(
            description="A percept has the feelings that its PAM node activates more than so "
            "much. LIDA: 0.7, PAM's threshold of percepts; here 0.3, because one "
            "encounter is to be enough, after which the link to a feeling has a "
            "weight of 0.5."
        ),
    ] = 0.3


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Weights of the networks, the threshold of percepts, and priming.

    A segment that shows a building with a probability over `percept_threshold` is a percept, with
    the activation of the likeliest PAM node: the probability of its name.
    """

    priming: Annotated[
        Priming,
        msgspec.Meta(
            description="How what was conscious makes perception expect what goes with it."
        ),
    ] = Priming()
    weights: Annotated[
        WeightsSet,
        msgspec.Meta(
            description="The built-in networks that find road and buildings. rendered: trained on "
            "rendered towns. camvid: for real cameras, trained on CamVid's street photographs too, "
            "whose licence is for non-commercial use."
        ),
    ] = "rendered"
    segments_weights: Annotated[
        WeightsPath,
        msgspec.Meta(
            description="ONNX file of the segmentation network, with that of the closer look "
            "beside it, as FILE-far.onnx, if there is one; empty: those of `weights`."
        ),
    ] = ""
    object_weights: Annotated[
        WeightsPath,
        msgspec.Meta(
            description="ONNX file of the embedding network, with its prototypes in a .json file "
            "beside it; empty: the built-in one."
        ),
    ] = ""
    road_weights: Annotated[
        WeightsPath,
        msgspec.Meta(description="ONNX file of the road network; empty: that of `weights`."),
    ] = ""
    processor: Annotated[
        Processor,
        msgspec.Meta(
            description="What runs the networks. gpu: the GPU for which the installed ONNX "
            "Runtime has a provider, as onnxruntime-gpu has for CUDA; sums may round "
            "differently there, so a log is replayed to the byte by the processor "
            "that it was recorded with."
        ),
    ] = "cpu"
    percept_threshold: Annotated[
        Share,
        msgspec.Meta(
            description="A segment is a percept if it shows a building with a higher probability. "
            "LIDA: 0.7 of total activation; here of that probability, because which "
            "building it is, is found by its place and look when it enters the workspace."
        ),
    ] = 0.7
