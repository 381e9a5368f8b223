"""What a drive cannot begin with, found before any process is started."""

from __future__ import annotations

from pathlib import Path

from cogmap.cli.launch.plan import MEMORY, Choices
from cogmap.cli.memory.show import checked
from cogmap.runtime import config
from cogmap.runtime.config import Sections
from cogmap.runtime.run import SECTION, Run
from cogmap.services import registry
from cogmap.services.sim.config import Config, check
from cogmap.services.sim.layout import towns

PROCEDURAL = "procedural"
SIM = "sim"


def check_inputs(sections: Sections, choices: Choices) -> None:
    """Raise the CogmapError with which a module of the drive would end as it starts: of a file of
    schemes, of the settings of the simulation or the extract of its town, of the database of
    long-term memory. What belongs to a module that somebody else starts is not checked.
    """
    if PROCEDURAL not in choices.without:
        registry.build(PROCEDURAL, sections)
    if SIM not in choices.without:
        _check_town(config.typed(sections, SIM, Config), config.typed(sections, SECTION, Run))
    if MEMORY not in choices.without and choices.memory is not None:
        _check_memory(choices.memory)


def _check_town(settings: Config, run: Run) -> None:
    """A town from a seed is made by the simulation alone: a large one takes seconds."""
    check(settings, run)
    if settings.town.startswith(towns.OSM):
        towns.place(settings.town, settings.seed, settings.town_size_m)


def _check_memory(path: Path) -> None:
    """Check all of a database that there is."""
    if path.exists():
        with checked(path):
            return
