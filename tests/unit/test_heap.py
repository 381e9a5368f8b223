"""Memory that a process has freed."""

from __future__ import annotations

import ctypes
import platform
import resource
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cogmap import heap
from cogmap.heap import ARENAS, keep_freed_memory, share_arenas

ARRAYS = 6
ARRAY_BYTES = 2**20
ROUNDS = 10
FEW_FAULTS = 100
THREADS = 12
BLOCK_BYTES = 4096
BLOCKS = 10_000
PAGE_BYTES = resource.getpagesize()

needs_glibc = pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="sets glibc's options")


def output_of(name: str) -> str:
    """What a function of MEASURED_BY writes in a process of its own."""
    command = [sys.executable, __file__, name]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout


def faults_of_arrays() -> int:
    """The page faults of writing arrays that replace others of the same size."""
    faults_before = 0
    for number in range(ROUNDS + 1):
        if number == 1:
            faults_before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        arrays = [np.ones(ARRAY_BYTES, np.uint8) for _ in range(ARRAYS)]
        del arrays

    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - faults_before


def write_faults() -> None:
    """Write the faults by default, then with freed memory kept."""
    by_default = faults_of_arrays()
    keep_freed_memory()
    sys.stdout.write(f"{by_default} {faults_of_arrays()}")


def write_arenas() -> None:
    """Write what the C library says of its arenas, after many threads have allocated at once."""
    library = ctypes.CDLL(None)
    library.malloc.restype = ctypes.c_void_p
    together = threading.Barrier(THREADS)

    def allocate() -> None:
        together.wait()
        library.free(ctypes.c_void_p(library.malloc(BLOCK_BYTES)))
        together.wait()

    threads = [threading.Thread(target=allocate) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    library.malloc_info(0, ctypes.c_void_p.in_dll(library, "stdout"))
    library.fflush(None)


def write_shared_arenas() -> None:
    """Write that of a process whose threads share them."""
    share_arenas()
    write_arenas()


def resident_bytes() -> int:
    """The memory of this process that is in use or not returned."""
    _, pages, *_ = Path("/proc/self/statm").read_text().split()
    return int(pages) * PAGE_BYTES


def write_returned() -> None:
    """Wait until most bytes are returned of blocks that were freed, before one that is in use."""
    heap.RETURN_PERIOD_S = 0.01
    heap.return_freed_memory_regularly()
    keep_freed_memory()
    blocks = [b"x" * number for number in range(BLOCK_BYTES, BLOCK_BYTES + BLOCKS)]
    last = blocks[-1]
    used_bytes = resident_bytes()
    del blocks
    while resident_bytes() > used_bytes - BLOCKS * BLOCK_BYTES / 2:
        threading.Event().wait(0.01)
    sys.stdout.write(f"returned before {len(last)}")


MEASURED_BY: dict[str, Callable[[], None]] = {
    "faults": write_faults,
    "arenas": write_arenas,
    "shared": write_shared_arenas,
    "returned": write_returned,
}


@needs_glibc
def test_arrays_reuse_the_memory_of_arrays_that_were_freed() -> None:
    by_default, kept = map(int, output_of("faults").split())

    assert kept < FEW_FAULTS < by_default


@needs_glibc
def test_many_threads_share_few_arenas() -> None:
    assert output_of("arenas").count("<heap nr=") > ARENAS
    assert output_of("shared").count("<heap nr=") == ARENAS


@needs_glibc
def test_freed_memory_before_a_block_in_use_is_returned_in_time() -> None:
    assert output_of("returned").startswith("returned")


if __name__ == "__main__":
    MEASURED_BY[sys.argv[1]]()
