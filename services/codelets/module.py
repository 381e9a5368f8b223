"""A worker: it answers the tasks that the workspace gives it, and keeps nothing between them."""

from __future__ import annotations

from collections.abc import Callable

from cogmap.errors import MessageError
from cogmap.runtime.module import Module
from schemas import topics
from schemas.base import Message
from schemas.cognition import Coalitions, Task
from schemas.graph import Operation, Proposal
from services.codelets.attention import attend
from services.codelets.config import Config
from services.codelets.correction.apply_correction import shift_map
from services.codelets.correction.map_correction import correct_map
from services.codelets.localization.landmarks import locate_landmark
from services.codelets.localization.localization import localize
from services.codelets.mapping.loop_detection import revisit
from services.codelets.mapping.object_place import place_object, place_road
from services.codelets.mapping.path import extend_path

__all__ = ["Config", "Worker", "build"]

BUILDERS: dict[str, Callable[[Task, Config], list[Operation]]] = {
    "localization": localize,
    "landmark": locate_landmark,
    "object_place": place_object,
    "road_place": place_road,
    "path": extend_path,
    "revisit": revisit,
    "map_shift": shift_map,
}
ATTENTION = "attention"
MAP_CORRECTION = "map_correction"


class Worker:
    """Runs the codelet that a task names, if the task is for this worker."""

    def __init__(self, config: Config, instance: str) -> None:
        self._config = config
        self._instance = instance

    def work(self, task: Task) -> list[Message] | None:
        """A proposal for a task, before it what attention found or replay tells; a failure is said,
        not kept back.
        """
        if task.worker != self._instance:
            return None
        said: list[Message] = []
        operations: list[Operation] = []
        failure = ""
        try:
            if task.codelet == ATTENTION:
                said.append(attend(task, self._config))
            elif task.codelet == MAP_CORRECTION:
                operations, replay = correct_map(task, self._config)
                said += [] if replay is None else [replay]
            elif task.codelet in BUILDERS:
                operations = BUILDERS[task.codelet](task, self._config)
            else:
                failure = f"no codelet {task.codelet}: there are {', '.join(BUILDERS)}, {MAP_CORRECTION}, {ATTENTION}"
        except (MessageError, ValueError, IndexError, KeyError, StopIteration) as error:
            failure = f"{task.codelet}: {error or type(error).__name__}"
        if failure and task.codelet == ATTENTION:
            said.append(Coalitions(stamp_ns=task.stamp_ns, cycle=task.cycle, coalitions=[]))
        proposal = Proposal(
            stamp_ns=task.stamp_ns,
            task_id=task.task_id,
            worker=self._instance,
            codelet=task.codelet,
            base_version=task.base_version,
            operations=operations,
            failure=failure,
        )
        return [*said, proposal]


def build(config: Config, instance: str) -> Module:
    """The module `codelets`, one worker of it."""
    worker = Worker(config, instance)
    says = (topics.PROPOSAL, topics.COALITIONS, topics.REPLAY)
    return Module("codelets", instance).on(topics.TASK, worker.work, emits=says)
