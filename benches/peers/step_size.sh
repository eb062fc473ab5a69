#!/usr/bin/env bash
# step_size.sh OUT: 10,000 vertices of which 1, 5 and 20 % collide, filtered and by ipctk's collision-free step size: time, and
# how much of the motion is kept. Ends with a table; trajectories.sh does the same with frames of recorded trajectories.
set -euo pipefail
out=${1:?usage: benches/peers/step_size.sh OUT}
mkdir -p "$out"
out=$(realpath -- "$out")
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.."
. benches/peers/python.sh
cargo bench --quiet --bench filter -- "write=$out"
"$python" benches/peers/step_size.py "$out"
