#!/usr/bin/env bash
# ccd_side_by_side.sh PYTHON DIR...: benches/ccd and ipctk on the same steps in one run, as lines of JSON.
set -euo pipefail
python=$1
shift
here=$(cd -- "$(dirname -- "$0")" && pwd)
dirs=()
for d in "$@"; do dirs+=("$(realpath -- "$d")"); done
cd -- "$here/../.."
cargo bench --quiet --bench ccd -- "${dirs[@]}"
"$python" "$here/ccd_ipctk.py" "${dirs[@]}"
