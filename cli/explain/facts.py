"""A moment as other programs read it: the messages as they were published, and what follows."""

from __future__ import annotations

from typing import Any

from cogmap.cli.explain import reasons
from cogmap.cli.explain.moment import Moment
from cogmap.cli.explain.reading import Logged
from cogmap.schemas.base import Message
from cogmap.schemas.render import to_jsonable

_IN_FULL = ("percepts", "competition", "broadcast", "earlier_broadcast", "action", "earlier_action")


def facts(moment: Moment) -> dict[str, Any]:
    """Collect every field of what was perceived, competed, broadcast, selected and commanded; None
    for what the log lacks.

    Each message has beside it `after_ms`, how long after the view it was sent. Deltas are given by
    their numbers of operations, arrays by their shapes. `entered` has the cycle of each coalition.
    """
    entered = {name: each.cycle for name, each in moment.entered.items()}
    found: dict[str, Any] = {
        "log": str(moment.path),
        "cycle": moment.cycle,
        "at_s": moment.at_s,
        "driven_s": moment.driven_s,
        "stamp_ns": moment.stamp_ns,
    }
    for name in _IN_FULL:
        found[name] = _in_full(getattr(moment, name))

    found["command"] = _in_full(moment.command)
    found["workspace"] = [
        {
            "after_ms": delta.after_ms,
            "phase": delta.message.phase.value,
            "tasks": delta.message.tasks,
            "operations": len(delta.message.operations),
            "rejected": delta.message.rejected,
            "reasons": delta.message.reasons,
        }
        for delta in moment.deltas
    ]
    found["winner"] = moment.winner or None
    found["entered"] = entered
    found["why_conscious"] = reasons.of_competition(moment)
    found["why_action"] = reasons.of_action(moment)
    return found


def _in_full(logged: Logged[Any] | None) -> dict[str, Any] | None:
    if logged is None:
        return None

    message: Message = logged.message
    return {"after_ms": logged.after_ms, "message": to_jsonable(message)}
