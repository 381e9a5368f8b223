"""What a run takes from the recording that it plays: the settings that it asks for, and time."""

from __future__ import annotations

from dataclasses import replace

from cogmap.cli.launch.plan import Choices
from cogmap.cli.progress import bar
from cogmap.cli.run.options import AROUND_S
from cogmap.errors import UsageError
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from cogmap.services import registry
from cogmap.services.player import formats
from cogmap.services.player.config import Config
from cogmap.services.player.recording import Recording

VIEW_S = 2.0
"""The wall-clock time that a view may take in lockstep: some ten times as much as it does."""


def chosen(choices: Choices, given: Sections) -> Choices:
    """Return the choices, with the recording that the settings name if they do.

    Raises UsageError for what a recording leaves no choice of.
    """
    player = given.get(registry.PLAYER, {})
    named = choices.recording or str(player.get("recording", ""))
    if not named:
        if choices.speed is not None:
            raise UsageError("--speed is for a recording: leave it out, or name one by --recording")
        return choices

    simulated = {
        "--seed": choices.seed is not None,
        "--town": choices.town is not None,
        "--tour": choices.tour,
        "--explore": choices.explore_s is not None,
        "--goals": bool(choices.goals),
        "--laps": choices.laps is not None,
        "--energy": choices.energy,
    }
    refused = [option for option, is_given in simulated.items() if is_given]
    if refused:
        raise UsageError(
            f"{', '.join(refused)} and --recording: a recording goes where it went, leave one out"
        )

    name, path = formats.named(named)
    return replace(choices, recording=f"{name}:{path.resolve()}")


def opened(choices: Choices, given: Sections) -> Recording | None:
    """Open the recording that is chosen, if one is. Raises UsageError if it cannot be played."""
    if not choices.recording:
        return None

    player = given.get(registry.PLAYER, {}) | {"recording": choices.recording}
    with bar(f"reading {formats.named(choices.recording).title}"):
        return formats.opened(config.typed({registry.PLAYER: player}, registry.PLAYER, Config))


def with_settings(given: Sections, recording: Recording) -> Sections:
    """Return the settings, with those that the recording asks for where there are none."""
    sections = {name: dict(section) for name, section in given.items()}
    for name, section in recording.settings.items():
        sections[name] = section | sections.get(name, {})
    return sections


def limit_s(recording: Recording, sections: Sections) -> float:
    """Return how long a run that plays a recording may take once it has begun."""
    stamps_ns = recording.stamps_ns
    if sections["run"]["lockstep"]:
        return len(stamps_ns) * VIEW_S + AROUND_S

    duration_s = (stamps_ns[-1] - stamps_ns[0]) / 1e9
    speed = sections[registry.PLAYER].get("speed", Config().speed)
    return duration_s / float(speed) + AROUND_S
