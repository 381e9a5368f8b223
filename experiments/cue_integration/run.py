"""Trials on the in-memory bus."""

from __future__ import annotations

from bus.errors import CogmapError
from bus.house import House
from experiments.cue_integration import mind, participant, room
from experiments.cue_integration.trial import Response, Trial


def respond(trial: Trial) -> Response:
    """Run `trial` from the start to the participant's answer. Raises CogmapError where none comes."""
    world = room.Room(trial)
    house = House([*mind.modules(trial.number), participant.build(), room.build(world)])
    house.run()
    house.close()
    if world.response is None:
        raise CogmapError(f"{trial} ended without a response: {[shell.intake for shell in house.shells]}")
    return world.response
