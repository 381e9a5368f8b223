"""The digests of files that must not change unseen: those of a folder are in its SHA256SUMS.

It is written as `sha256sum` writes it, so that `sha256sum -c SHA256SUMS` checks them too.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from cogmap.errors import ConfigError
from cogmap.files.bounds import MIB, Budget

DIGESTS = "SHA256SUMS"
MAX_BYTES = 256 * MIB
"""Of a file with a digest: weights are read at once."""

_LINE = re.compile(r"([0-9a-f]{64}) [ *](\S.*)")


def read_checked(path: Path) -> bytes:
    """Return the content of a file that has its digest. Raises ConfigError if there is no file, or
    no digest, or another one; BoundError if it holds more than MAX_BYTES.
    """
    try:
        Budget(path, "holds", MAX_BYTES).take(path.stat().st_size)
        content = path.read_bytes()
    except FileNotFoundError:
        raise ConfigError(f"no weights {path}: train them with cogmap train") from None
    except OSError as error:
        raise ConfigError(f"cannot read {path} ({error.strerror}): name another file") from None

    expected = _digests(path.parent).get(path.name)
    if expected is None:
        raise ConfigError(
            f"{path} has no digest in the {DIGESTS} beside it: copy that line, too, or, if you "
            f"trust the file, write one there by `sha256sum {path.name} >> {DIGESTS}`"
        )
    if hashlib.sha256(content).hexdigest() != expected:
        raise ConfigError(
            f"{path} does not have its digest in {DIGESTS}: it is damaged or was changed, copy or "
            "train it again"
        )
    return content


def write_digests(*paths: Path) -> None:
    """Write the digests of files as they are now, beside them, in place of those they had."""
    for path in paths:
        digests = _digests(path.parent)
        digests[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
        lines = [f"{digest}  {name}\n" for name, digest in sorted(digests.items())]
        (path.parent / DIGESTS).write_text("".join(lines), encoding="utf-8")


def _digests(folder: Path) -> dict[str, str]:
    """Return the digests in a folder, by the names of the files; none where there is no table."""
    table = folder / DIGESTS
    try:
        Budget(table, "holds", MIB).take(table.stat().st_size)
        lines = table.read_text("utf-8", "replace").splitlines()
    except OSError:
        return {}
    found = map(_LINE.fullmatch, lines)
    return {match[2]: match[1] for match in found if match}
