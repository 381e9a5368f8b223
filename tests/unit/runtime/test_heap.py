"""Memory that a process has freed."""

from __future__ import annotations

import platform
import resource
import subprocess
import sys

import numpy as np
import pytest

from cogmap.runtime.heap import keep_freed_memory

ARRAYS = 6
ARRAY_BYTES = 2**20
ROUNDS = 10
FEW_FAULTS = 100


def faults_of_arrays() -> int:
    """The page faults of writing arrays that replace others of the same size."""
    faults_before = 0
    for number in range(ROUNDS + 1):
        if number == 1:
            faults_before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        arrays = [np.ones(ARRAY_BYTES, np.uint8) for _ in range(ARRAYS)]
        del arrays

    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - faults_before


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="sets options of glibc")
def test_arrays_reuse_the_memory_of_arrays_that_were_freed() -> None:
    run = subprocess.run(
        [sys.executable, __file__], capture_output=True, text=True, check=True, timeout=60
    )

    by_default, kept = map(int, run.stdout.split())
    assert kept < FEW_FAULTS < by_default


def main() -> None:
    """Write the faults by default, then with freed memory kept."""
    by_default = faults_of_arrays()
    keep_freed_memory()
    sys.stdout.write(f"{by_default} {faults_of_arrays()}")


if __name__ == "__main__":
    main()
