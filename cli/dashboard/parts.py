"""What the page is told, as JSON: a part for each group of panels."""

from __future__ import annotations

import enum

import msgspec
import numpy as np
import numpy.typing as npt

Point = tuple[float, float]
Flat = list[float]
"""x and y of one point after the other, in metres, to the centimetre."""


class PartName(enum.StrEnum):
    """The parts, each of which is sent again when it has changed."""

    NOW = "now"
    MAP = "map"
    PLACES = "places"
    COSTS = "costs"
    CUTS = "cuts"
    CAMERA = "camera"
    DEPTH = "depth"
    MIND = "mind"
    SYSTEM = "system"
    TOPICS = "topics"
    STREETS = "streets"
    TRUTH = "truth"


ASKED_FOR = frozenset((PartName.COSTS, PartName.CUTS, PartName.TRUTH))
"""Layers of the map that are large, and that few look at: a browser gets those that it shows."""


class Part(msgspec.Struct, kw_only=True):
    """A part of what is shown."""


class Now(Part, kw_only=True):
    """Where the agent takes itself to be, what it does, and how it fares. `at_s` is the time of its
    newest message, in seconds of the drive.
    """

    at_s: float = 0.0
    cycle: int = 0
    pose: tuple[float, float, float] | None = None
    pose_sd_m: float = 0.0
    samples: Flat = []
    speed_m_s: float = 0.0
    halted_by: str = ""
    slowed_by: str = ""
    is_paused: bool = False
    energy: float | None = None
    is_charging: bool = False
    conscious: str = ""
    action: str = ""
    plan: str = ""


class MapObject(Part, kw_only=True):
    """An individual object of the map, with twice the standard deviations of its place."""

    label: str
    name: str
    at_m: Point
    spread_m: Point
    samples: Flat


class MapGoal(Part, kw_only=True):
    """A goal of the agent."""

    name: str
    at_m: Point
    is_reached: bool


class District(Part, kw_only=True):
    """A sub-map: the hull of its objects."""

    name: str
    hull: Flat


class Layer(Part, kw_only=True):
    """A picture of place nodes, empty where there are none: `west_m` and `south_m` is where its
    corner lies.
    """

    picture: str = ""
    west_m: float = 0.0
    south_m: float = 0.0
    width_m: float = 0.0
    height_m: float = 0.0


class MapPart(Part, kw_only=True):
    """The learned map, in its own frame: the origin is where the agent began."""

    objects: list[MapObject] = []
    path: Flat = []
    closures: Flat = []
    districts: list[District] = []
    goals: list[MapGoal] = []
    route: Flat = []


class Cuts(Part, kw_only=True):
    """The links between place nodes that are cut: both ends of each."""

    links: Flat = []


class Seen(Part, kw_only=True):
    """A percept, over the image: the corners of its outline, or of its box, in pixels."""

    outline: Flat
    name: str
    label: str
    activation: float
    range_m: float
    bearing_deg: float
    names: list[tuple[str, float]]


class Camera(Part, kw_only=True):
    """The newest view, its picture, and what was recognized in view `percepts_frame`; -1 where
    there is none.
    """

    frame: int = -1
    picture: str = ""
    percepts_frame: int = -1
    at_s: float = 0.0
    width_px: int = 0
    height_px: int = 0
    seen: list[Seen] = []


class Depth(Part, kw_only=True):
    """How far away what the newest view shows is, as a picture; empty where there is none."""

    picture: str = ""


class Contending(Part, kw_only=True):
    """A coalition in one competition."""

    codelet: str
    activation: float
    fate: str


class Competed(Part, kw_only=True):
    """A competition, and what of it became conscious, empty where nothing did."""

    cycle: int
    at_s: float
    contenders: list[Contending]
    conscious: str = ""


class ShownRow(Part, kw_only=True):
    """A line of a stage."""

    cells: tuple[str, ...]
    is_chosen: bool


class ShownStage(Part, kw_only=True):
    """A stage of the cycle that is explained."""

    title: str
    after: str
    rows: list[ShownRow]
    why: list[str]


class Scheme(Part, kw_only=True):
    """A behaviour that action selection considered."""

    name: str
    action: str
    activation: float
    verdict: str
    is_chosen: bool


class NeedLevel(Part, kw_only=True):
    """How strong a need is, from 0 to 1."""

    name: str
    level: float
    is_eased: bool


class Mind(Part, kw_only=True):
    """What competes, what is conscious, and why the agent does what it does."""

    competitions: list[Competed] = []
    explained: str = ""
    stages: list[ShownStage] = []
    schemes: list[Scheme] = []
    needs: list[NeedLevel] = []


class StageTime(Part, kw_only=True):
    """What a module took of the last cycles in the median: to compute, and to wait and travel."""

    module: str
    compute_ms: float
    rest_ms: float


class ProcessHealth(Part, kw_only=True):
    """How a process fares. `is_silent` if it has said nothing for long."""

    instance: str
    is_worker: bool
    busy: float
    compute_p50_ms: float
    memory_mb: float
    queued: int
    lost: int
    rejected: int
    notes: list[str]
    is_silent: bool


class SystemPart(Part, kw_only=True):
    """Latency by stage, from sensing to the motor command, and the health of the processes."""

    cycle_p50_ms: float = 0.0
    cycle_max_ms: float = 0.0
    stages: list[StageTime] = []
    processes: list[ProcessHealth] = []


class TopicCount(Part, kw_only=True):
    """How many messages of a topic came."""

    name: str
    type: str
    count: int


class Topics(Part, kw_only=True):
    """The topics of which messages came."""

    topics: list[TopicCount] = []


class Streets(Part, kw_only=True):
    """The names of the streets that a person may close, where the simulator says them."""

    names: list[str] = []


class TrueStreet(Part, kw_only=True):
    """A street of the true town, in the frame of the map."""

    line: Flat
    is_closed: bool


class Truth(Part, kw_only=True):
    """The town as it is, where the simulator says it, for observers alone: in the frame of the
    map, nothing where that frame is not known.
    """

    streets: list[TrueStreet] = []
    buildings: list[Flat] = []
    path: Flat = []


def flat(points: npt.ArrayLike) -> Flat:
    """Return (n, 2) points as x and y of one after the other, to the centimetre."""
    rounded = np.round(np.asarray(points, np.float64).reshape(-1), 2)
    values: Flat = rounded.tolist()
    return values
