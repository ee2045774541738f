"""Access to a cache file from outside, and processes that use one."""

import os
import subprocess
import sys
from pathlib import Path

import h5py

from tisim.files.checksum import with_checksum

WORKER = Path(__file__).with_name("cache_worker.py")
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def payloads(records):
    """The records as sorted bytes."""
    return sorted(record.payload() for record in records)


def journal_of(path):
    return path.with_name(path.name + ".journal")


def lock_of(path):
    return path.with_name(path.name + ".lock")


def hurt(path, dataset, row):
    """Flip the first bit of a row in the raw data of a dataset; nothing else in the file changes."""
    with h5py.File(path, "r") as file:
        at = file[dataset].id.get_offset() + row * file[dataset].dtype.itemsize
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


def of_format(kind):
    """An undamaged HDF5 file with the checksum of a cache file, of some format."""
    with h5py.File("image", "w", driver="core", backing_store=False) as file:
        file.attrs["format"] = kind
        file.create_group("evaluations")
        file.flush()
        return with_checksum(bytes(file.id.get_file_image()))


PIPE = 4096
"""Pipe size: the number of bytes that a process can write before they are read.

Each evaluation takes 72 bytes, so a reader is less than 60 evaluations behind. A search therefore cannot end
before they are read, however fast the machine is.
"""


def worker(*arguments, **options):
    """Start cache_worker.py."""
    command = [sys.executable, str(WORKER), *map(str, arguments)]
    return subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True, **options)
