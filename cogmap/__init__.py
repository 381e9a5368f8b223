"""Cogmap: LIDA's cognitive architecture with spatial memory, as modules on a message bus.

The public names are those of `cogmap.api`, such as `cogmap.Module`, `cogmap.Graph` and
`cogmap.open_log`. They are imported when one of them is first used, so that a program that needs
only a part of the library does not wait for all of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cogmap.api import *  # noqa: F403
else:

    def __getattr__(name: str) -> Any:
        if name.startswith("_") and name != "__all__":
            raise AttributeError(f"module 'cogmap' has no attribute {name!r}")

        import cogmap.api as public

        if name == "__all__":
            return public.__all__
        if name not in public.__all__:
            raise AttributeError(f"module 'cogmap' has no attribute {name!r}")
        return getattr(public, name)

    def __dir__() -> list[str]:
        import cogmap.api as public

        return sorted({*globals(), *public.__all__})
