"""Checks the inputs of a drive before any process is started."""

from __future__ import annotations

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
    """Raise the CogmapError with which a module of the drive would end as it starts, for its file
    of schemes, the settings of the simulation, the file of its town, or the database of
    long-term memory; a recording is opened before. Inputs of modules that somebody else starts are
    not checked.
    """
    if PROCEDURAL not in choices.without:
        registry.build(PROCEDURAL, sections)

    if SIM in choices.modules and SIM not in choices.without:
        settings = config.typed(sections, SIM, Config)
        check(settings, config.typed(sections, SECTION, Run))
        if towns.is_file(settings.town):  # one from a seed takes seconds, and cannot fail
            towns.place(settings.town, settings.seed, settings.town_size_m)

    memory = choices.memory
    if MEMORY not in choices.without and memory is not None and memory.exists():
        with checked(memory):
            return
