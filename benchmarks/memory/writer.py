"""A process that puts records into a database until it is killed.

`python -m benchmarks.memory.writer FILE FIRST` begins with the record of number FIRST. After each
transaction it prints the numbers of the records in it, in one line.
"""

from __future__ import annotations

import sys
from pathlib import Path
from random import Random

from cogmap.runtime.state.database import Database
from cogmap.runtime.state.record import Record

MAX_BYTES = 65_536
BATCH = 500
BATCH_SHARE = 0.1


def record_of(number: int) -> Record:
    """Return the record of a number, with 1 to MAX_BYTES bytes; sizes are log-uniform."""
    random = Random(number)
    size_bytes = int(MAX_BYTES ** random.random())
    return Record(f"record-{number}", "benchmark", random.randbytes(size_bytes))


def main() -> None:
    """Put records, one at a time; a share of BATCH_SHARE of transactions has BATCH of them.

    A batch is larger than SQLite's cache, so that its pages are in the file before its commit.
    """
    path, first_number = sys.argv[1:]
    database = Database(Path(path))
    first = int(first_number)
    random = Random(first)

    while True:
        count = BATCH if random.random() < BATCH_SHARE else 1
        numbers = range(first, first + count)
        database.put(record_of(number) for number in numbers)
        sys.stdout.write(" ".join(map(str, numbers)) + "\n")
        sys.stdout.flush()
        first += count


if __name__ == "__main__":
    main()
