"""Settings of perception."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from cogmap.schemas.base import PositiveShare, Share

WeightsPath = Annotated[str, msgspec.Meta(max_length=4096)]
Pixels = Annotated[int, msgspec.Meta(ge=4, le=1000)]
Deviations = Annotated[float, msgspec.Meta(gt=0, le=100)]
Processor = Literal["cpu", "gpu"]


class Priming(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """How what was conscious makes perception expect what it goes with, and feel about it."""

    share: Annotated[
        Share,
        msgspec.Meta(
            description="how much likelier all names together are, at most, for what was conscious "
            "just before, as a share of 1, 0 to 1; at 0 nothing is primed. LIDA: 0.9 of a node's "
            "activation is passed on (upscale; downscale 0.5), and added; here it changes the "
            "prior of names, because activation is the probability of a name"
        ),
    ] = 0.5
    half_life_s: Annotated[
        float,
        msgspec.Meta(
            gt=0,
            le=3600,
            description="the activation of a PAM node halves in so many seconds after it was "
            "conscious, over 0, at most 3600. LIDA: falls by 0.05 a tick, to 0 in 100 ms; here "
            "halves in 3 s, because a view is primed by what was conscious two views, 400 ms, "
            "before it",
        ),
    ] = 3.0
    learning_rate: Annotated[
        PositiveShare,
        msgspec.Meta(
            description="how far one broadcast moves base levels and weights of links towards what "
            "was conscious, over 0, at most 1. LIDA: no published rate that we know"
        ),
    ] = 0.1
    feeling_rate: Annotated[
        PositiveShare,
        msgspec.Meta(
            description="how far one broadcast moves the link from a PAM node to what is felt with "
            "it towards 1, over 0, at most 1: a danger is known after one encounter; LIDA gives no "
            "rate"
        ),
    ] = 0.5
    feeling_unlearning_rate: Annotated[
        Share,
        msgspec.Meta(
            description="how far one broadcast of a PAM node moves its links to other feelings "
            "than novelty that are not felt with it towards 0, 0 to 1: fear is extinguished more "
            "slowly than it is learned"
        ),
    ] = 0.02
    feeling_threshold: Annotated[
        Share,
        msgspec.Meta(
            description="a percept has the feelings that its PAM node activates more than so much, "
            "0 to 1. LIDA: 0.7, PAM's threshold of percepts; here 0.3, because one encounter is to "
            "be enough, after which the link to a feeling has a weight of 0.5 (`feeling_rate`)"
        ),
    ] = 0.3
    kept_broadcasts: Annotated[
        int,
        msgspec.Meta(
            ge=1,
            le=10_000,
            description="broadcasts between two times at which the graph is published, to be kept, "
            "1 to 10000",
        ),
    ] = 16


class Config(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Weights, thresholds of percepts and of learning, limits of a footprint's fit, and priming.

    A segment that shows a building with a probability over `percept_threshold` is a percept,
    labelled as the likeliest PAM node, with the total activation of that node: base level and
    current activation.
    """

    priming: Annotated[
        Priming,
        msgspec.Meta(
            description="how what was conscious makes perception expect what goes with it"
        ),
    ] = Priming()
    segments_weights: Annotated[
        WeightsPath,
        msgspec.Meta(description="ONNX file of the segmentation network; empty: the built-in one"),
    ] = ""
    object_weights: Annotated[
        WeightsPath,
        msgspec.Meta(
            description="ONNX file of the embedding network, with its prototypes in a .json file "
            "beside it; empty: the built-in one"
        ),
    ] = ""
    road_weights: Annotated[
        WeightsPath,
        msgspec.Meta(description="ONNX file of the road network; empty: the built-in one"),
    ] = ""
    processor: Annotated[
        Processor,
        msgspec.Meta(
            description="what runs the networks. gpu: the GPU for which the installed ONNX Runtime "
            "has a provider, as onnxruntime-gpu has for CUDA; sums may round differently there, so "
            "a log is replayed to the byte by the processor that it was recorded with"
        ),
    ] = "cpu"
    base_level: Annotated[
        Share,
        msgspec.Meta(
            description="base-level activation added to the current activation of every percept, "
            "0 to 1. LIDA: that which the PAM node has learned; here 0 for all, because activation "
            "is the probability of a name, and learned base levels count in the workspace"
        ),
    ] = 0.0
    percept_threshold: Annotated[
        Share,
        msgspec.Meta(
            description="a segment is a percept if it shows a building with a higher probability, "
            "0 to 1. LIDA: 0.7 of total activation; here of that probability, because which "
            "building it is, is decided by its evidence (`workspace.recognition_threshold`)"
        ),
    ] = 0.7
    learned_share: Annotated[
        Share,
        msgspec.Meta(
            description="smallest share of the view's pixels, 0 to 1, that an unknown building "
            "covers when it gets a PAM node"
        ),
    ] = 0.15
    familiar: Annotated[
        Share,
        msgspec.Meta(
            description="a building that is well visible gets a PAM node unless it is recognized "
            "as one that was taught with a higher activation, 0 to 1: a stranger that is like that "
            "has a name of its own, too"
        ),
    ] = 0.85
    familiar_learned: Annotated[
        Share,
        msgspec.Meta(
            description="the activation for one that was learned, in the place of `familiar`, 0 to "
            "1; higher, because one encounter tells less of a building than teaching, and a second "
            "node for it does less harm than one node for two buildings"
        ),
    ] = 0.97
    sure: Annotated[
        Share,
        msgspec.Meta(
            description="a learned object gets another appearance if it is recognized with a "
            "higher activation, 0 to 1, in a view that does not make it a node of its own"
        ),
    ] = 0.65
    narrowest_px: Annotated[
        Pixels,
        msgspec.Meta(description="narrowest segment that is recognized, in pixels, 4 to 1000"),
    ] = 8
    worst_misfit: Annotated[
        Deviations,
        msgspec.Meta(
            description="largest misfit of a fitted footprint, in standard deviations, over 0, at "
            "most 100; beyond it the object is placed as one of the usual size"
        ),
    ] = 2.0
    worst_range_sd_share: Annotated[
        PositiveShare,
        msgspec.Meta(
            description="largest standard deviation of a fitted range, as a share of the range, "
            "over 0, at most 1; beyond it the object is placed as one of the usual size"
        ),
    ] = 0.15
