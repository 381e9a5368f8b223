"""What others may use of extended PAM: its networks, its memories of objects and places, and its
settings.
"""

from __future__ import annotations

from cogmap.services.epam import backbone
from cogmap.services.epam.config import Config as EpamConfig
from cogmap.services.epam.layout import road
from cogmap.services.epam.pam import ExtendedPam
from cogmap.services.epam.places import descriptor
from cogmap.services.epam.places.recognizer import PlaceRecognizer
from cogmap.services.epam.recognition import objects, segments
from cogmap.services.epam.recognition.functions import function_of
from cogmap.services.epam.view import view_arrays

__all__ = [
    "EpamConfig",
    "ExtendedPam",
    "PlaceRecognizer",
    "backbone",
    "descriptor",
    "function_of",
    "objects",
    "road",
    "segments",
    "view_arrays",
]
