"""Traversals kept in files as they end, so that an interrupted experiment continues."""

from __future__ import annotations

import hashlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from cogmap.errors import UsageError
from cogmap.experiments.city_maps import drive, self_driven
from cogmap.experiments.city_maps.guide import Outcome
from cogmap.experiments.city_maps.observer import Traversal
from cogmap.files.packed import read_arrays
from cogmap.runtime.config import Sections
from cogmap.version import VERSION

SUFFIX = ".npz"
ALONE = "alone:"
OUTCOME = "outcome"


def traverse_once(configured: Sections, folder: Path | None) -> Traversal:
    """Drive as `drive.traverse` does, or `self_driven.traverse` if there is a guide, unless a file
    in `folder` has that traversal, and keep it there; without a folder nothing is kept.
    """
    traverse = self_driven.traverse if self_driven.GUIDE in configured else drive.traverse
    if folder is None:
        return traverse(configured)

    path = folder / f"{_digest(configured)}{SUFFIX}"
    if path.exists():
        return _read(path)

    found = traverse(configured)
    _write(path, found)
    return found


def _digest(configured: Sections) -> str:
    """Return a name for all that a traversal depends on, but the code of this version."""
    text = msgspec.json.encode([VERSION, configured], order="deterministic")
    return hashlib.sha256(text).hexdigest()


def _write(path: Path, found: Traversal) -> None:
    """Write a traversal, so that a file is whole or is not there."""
    columns: dict[str, Any] = asdict(found)
    for name, alone_m in columns.pop("alone_m").items():
        columns[ALONE + name] = alone_m
    if columns.pop(OUTCOME) is not None:
        columns[OUTCOME] = np.array(msgspec.json.encode(found.outcome).decode())

    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        np.savez(file, allow_pickle=False, **columns)
    partial.replace(path)


def _read(path: Path) -> Traversal:
    """Read a traversal. Raises UsageError if the file is damaged."""
    try:
        arrays: dict[str, Any] = read_arrays(path)
        alone = [name for name in arrays if name.startswith(ALONE)]
        alone_m = {name.removeprefix(ALONE): arrays.pop(name) for name in alone}
        outcome = None
        if OUTCOME in arrays:
            outcome = msgspec.json.decode(str(arrays.pop(OUTCOME)), type=Outcome)
        return Traversal(alone_m=alone_m, outcome=outcome, **arrays)
    except (UsageError, TypeError, msgspec.DecodeError) as error:
        raise UsageError(f"{path} is damaged ({error}): remove it, and it is made anew") from None
