"""A worker process for tests of worker failures, which compiles nothing."""

import os
import pickle
import struct


def serve(connection, share):
    """Echo each request, end, or end in the middle of an answer."""
    while True:
        try:
            scenes = pickle.loads(connection.recv()[0])
        except EOFError:
            return
        if scenes == "end":
            os._exit(3)
        if scenes == "answer in part":
            os.write(connection.fileno(), struct.pack("!i", 1000) + b"too short")
            os._exit(4)
        connection.send(os.getpid() if scenes == "pid" else scenes)
