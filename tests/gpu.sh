#!/usr/bin/env bash
# Run the tests marked gpu on a device, then print a dated record of its speed; at most 8 minutes on a card.
#
#     tests/gpu.sh [cuda|vulkan]
#
# On vulkan sizes are small: Mesa's software device compiles a step for a minute.
set -uo pipefail
cd "$(dirname "$0")/.."
device=${1:-cuda}
export TISIM_DEVICE=$device
if [ "$device" = cuda ]; then
    limits=(--most 1000000 --worlds 4096 --limit 180)
    tests=(tests)
    processes=auto
else
    limits=(--most 1000 --worlds 16 --limit 90)
    tests=(tests/device tests/numerics)
    processes=0
fi
# Interrupted tests still name those that have failed.
timeout --signal=INT --kill-after=20 270 python -m pytest -q -rfEs -n "$processes" --dist worksteal -m "gpu and not slow" "${tests[@]}"
tested=$?
TISIM_DEVICE= timeout 200 python tests/benchmarks/scaling.py --device "$device" "${limits[@]}" || exit
exit $tested
