#!/usr/bin/env bash
# figures.sh OUT [FIGURE...]: repeats the figures of [Otaduy09, §6] and draws them into OUT. Figures: anticipation
# resolution rounds ablation (all by default); each takes minutes to tens of minutes of one core.
set -euo pipefail
out=${1:?usage: benches/figures.sh OUT [FIGURE...]}
shift
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
mkdir -p "$out"
out=$(realpath -- "$out")
if ! out/venv/bin/python -c 'import matplotlib' 2>/dev/null; then
  ci/setup python3-venv
  mkdir -p out
  python3 -m venv out/venv
  out/venv/bin/pip install --quiet -r ci/pictures-requirements.txt
fi
cargo build --release --quiet --features runner --bin signorini-run
cargo bench --quiet --bench figures --no-run
out/venv/bin/python benches/figures.py "$out" "$@"
