"""The player as a module: what was recorded comes out, in the place of the simulation; motor
commands come in, and move nothing.
"""

from __future__ import annotations

from cogmap.errors import ConfigError
from cogmap.runtime.module import Module
from cogmap.runtime.repetition import CHECK_NS
from cogmap.runtime.run import REAL_TIME, Run
from cogmap.schemas import topics
from cogmap.schemas.base import Message
from cogmap.services.player import formats
from cogmap.services.player.config import Config
from cogmap.services.player.lockstep import Lockstep
from cogmap.services.player.playhead import Playhead
from cogmap.services.player.real_time import PERIOD_NS, RealTime

__all__ = ["Config", "build"]

NAME = "player"
_EMITS = (
    topics.CLOCK,
    topics.PAUSED,
    topics.STEREO,
    topics.ODOMETRY,
    topics.SELF_MOTION,
    topics.SCAN,
    topics.PERCEPTS,
    topics.ENERGY,
    topics.TRUE_POSE,
    topics.TRUE_TOWN,
    topics.PLAYBACK,
    topics.PRESENCE,
)


def build(config: Config, instance: str = NAME, run: Run = REAL_TIME) -> Module:
    """Return the module `player`. Where the run is simulated it does nothing. Raises UsageError if
    its recording cannot be played, and ConfigError if it has none.
    """
    module = Module(NAME, instance)
    if not config.recording and not run.has_any(NAME):
        module.on(topics.PAUSE, _ignore)
        return module.on(topics.MOTOR_COMMAND, _ignore, _EMITS)
    if not config.recording:
        raise ConfigError("[player] recording is empty: name what is to be played, as FORMAT:PATH")

    recording = formats.opened(config)
    playhead = Playhead(recording, formats.named(config.recording).title)
    module.journaling(topics.PLAYBACK, playhead.resume, playhead.played)

    # Time begins when these are ready: at least the player itself.
    required = run.participants or {NAME: 1}
    if run.lockstep:
        lockstep = Lockstep(playhead)
        module.on(topics.PRESENCE, lockstep.on_presence, _EMITS)
        module.on(topics.MOTOR_COMMAND, lockstep.on_command, _EMITS)
        module.on(topics.PAUSE, lockstep.on_pause, _EMITS)
        module.on_start(lockstep.on_start, required, _EMITS)
        return module.every(CHECK_NS, lockstep.on_timer, _EMITS)

    real_time = RealTime(playhead, config.speed)
    module.on(topics.MOTOR_COMMAND, real_time.on_command, _EMITS)
    module.on(topics.PAUSE, real_time.on_pause, [topics.PAUSED])
    module.on_start(real_time.on_start, required)
    return module.every(PERIOD_NS, real_time.on_timer, _EMITS)


def _ignore(_message: Message) -> None:
    """Do nothing: the simulation obeys it."""
