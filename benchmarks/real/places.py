"""Places recognized along a walk through which somebody walked before: EPAM's own memory of places
gets the pictures of both walks, one after the other, and is restored between them, as on another
day.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from rich.progress import track

from benchmarks.report import Metrics
from benchmarks.threshold import Thresholds, at_least
from cogmap.errors import UsageError
from cogmap.geometry.arrays import Bytes
from cogmap.services.epam.public import PlaceRecognizer, backbone, descriptor

THRESHOLDS: Thresholds = {
    "recall_at_1": at_least(0.85),
    "sequence_recall_at_100p": at_least(0.97),
}
SUFFIXES = (".jpg", ".jpeg", ".png")
# A place is the one of the same number, or of one that is so near.
TOLERANCE = 2
FRAME_NS = 400_000_000


@dataclass(frozen=True)
class Answer:
    """Of a picture: the number of the most similar one of the first walk, if any, and the frame
    that it was matched with, with its score.
    """

    nearest: int | None
    matched: int | None
    score: float


def measure(reference: Path, query: Path) -> Metrics:
    """Measure how many pictures of `query` are recognized as those of the same number in
    `reference`: by one view alone, and by the views that lead to it.

    One view alone: the most similar of the first walk. By the views that led to it: all that is
    remembered may match, views of the second walk too, and those that match nothing are remembered.
    """
    learned = _codes(reference)
    asked = _codes(query)
    first = len(learned)

    alone = _walk(learned, asked, learning=False)[first:]
    ranked = [
        answer.nearest is not None and _is_same(answer.nearest, number)
        for number, answer in enumerate(alone)
    ]

    answers = _walk(learned, asked, learning=True)
    right = np.array(
        [
            frame >= first
            and answer.matched is not None
            and _is_same(answer.matched, frame - first)
            for frame, answer in enumerate(answers)
        ]
    )
    score = np.array([answer.score for answer in answers])
    wrong = (score > 0) & ~right
    highest_wrong = float(score[wrong].max(initial=0.0))
    sure = right & (score > highest_wrong)
    count = len(asked)

    return {
        "recall_at_1": sum(ranked) / count,
        "sequence_recall_at_100p": float(sure.sum() / count),
        "sequence_recall": float(right.sum() / count),
        "sequence_wrong": float(wrong.sum()),
        "pictures": float(len(answers)),
    }


def _walk(reference: list[Bytes | None], query: list[Bytes | None], learning: bool) -> list[Answer]:
    """Return the answer to each picture; of the second walk views are remembered if `learning`."""
    recognizer = PlaceRecognizer()
    answers = []

    for frame, code in enumerate([*reference, *query]):
        if frame == len(reference):
            remembered = recognizer.all
            recognizer = PlaceRecognizer()
            recognizer.restore(remembered)

        learns = learning or frame < len(reference)
        matches, _ = recognizer.observe(frame, frame * FRAME_NS, code, learns)
        nearest = recognizer.nearest
        answers.append(
            Answer(
                nearest.frame if nearest is not None else None,
                matches[0].frame if matches else None,
                matches[0].score if matches else 0.0,
            )
        )

    return answers


def _codes(folder: Path) -> list[Bytes | None]:
    """Return the code of each picture in `folder`, in the order of their names; None if it cannot
    be read, or shows no place.

    Raises UsageError if there is no picture.
    """
    paths = sorted(path for path in folder.glob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise UsageError(f"there are no pictures in {folder}: put JPEG or PNG files there")

    features = backbone.load()
    codes: list[Bytes | None] = []
    for path in track(paths, f"pictures of {folder.name}"):
        picture = cv2.imread(str(path))
        if picture is None:
            codes.append(None)
            continue

        image = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)
        shows_place = descriptor.shows_place(image, None)
        codes.append(descriptor.code(features.features(image)) if shows_place else None)

    return codes


def _is_same(one: int, other: int) -> bool:
    return abs(one - other) <= TOLERANCE
