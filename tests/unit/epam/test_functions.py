"""What EPAM knows of the use of what it recognises."""

from __future__ import annotations

import json

from cogmap.schemas.nodes import FUNCTIONS
from cogmap.services.epam.recognition.functions import LABELS_OF, function_of
from cogmap.services.epam.recognition.objects import DEFAULT_PATH


def test_everything_that_was_trained_has_a_function() -> None:
    trained = json.loads(DEFAULT_PATH.with_suffix(".json").read_text())["names"]

    assert [name for name in trained if not function_of(name)] == []


def test_every_function_is_one_that_schemes_may_name() -> None:
    assert LABELS_OF.keys() <= {*FUNCTIONS}


def test_a_building_learned_in_an_encounter_has_none() -> None:
    assert function_of("new-building-1") == ""
