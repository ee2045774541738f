#!/usr/bin/env bash
# Kills, full disks, fuzzed scenes and damaged files, some minutes of each; see tests/soak/__main__.py.
cd "$(dirname "$0")/.." && exec python -m tests.soak "$@"
