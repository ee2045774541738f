"""Looking at a cache file from outside, and processes that use one."""

import os
import subprocess
import sys
from pathlib import Path

import h5py

WORKER = Path(__file__).with_name("cache_worker.py")
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def payloads(records):
    """The records as bytes, in an order of their own."""
    return sorted(record.payload() for record in records)


def journal_of(path):
    return path.with_name(path.name + ".journal")


def lock_of(path):
    return path.with_name(path.name + ".lock")


def hurt(path, dataset, row):
    """Flip the first bit of a row in the raw data of a dataset; nothing else in the file is changed."""
    with h5py.File(path, "r") as file:
        at = file[dataset].id.get_offset() + row * file[dataset].dtype.itemsize
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


PIPE = 4096
"""Bytes (pipesize) that a process may write before they are read. It names evaluations by 72 bytes each: who
reads some is less than 60 of them behind, and a search cannot end meanwhile, however fast the machine is."""


def worker(*arguments, **options):
    """Start cache_worker.py."""
    command = [sys.executable, str(WORKER), *map(str, arguments)]
    return subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True, **options)
