#!/usr/bin/env bash
# filter_scenes.sh OUT [--passes N] [SCENE[:STEPS]...]: the scenes of [Harmon10, §3.8] with each fail-safe, one thread, and their
# table in the shape of his Table 3.1; reports and the last frames go into OUT. Without scenes: all of the table, whole.
# --passes 0: without impulses, so that zones answer what springs leave.
set -euo pipefail
out=${1:?usage: benches/filter_scenes.sh OUT [--passes N] [SCENE[:STEPS]...]}
shift
passes=()
if [ "${1:-}" = --passes ]; then
  passes=(--passes "${2:?--passes N}")
  shift 2
fi
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
[ $# -gt 0 ] || set -- ribbon funnel funnel_coarse crushed_cylinder squares_incline squares_plane
cargo build --release --quiet --features runner --bin signorini-run
mkdir -p "$out"
for scene in "$@"; do
  name=${scene%%:*}
  steps=()
  [ "$name" = "$scene" ] || steps=(--steps "${scene##*:}")
  for fail_safe in rigid_zone inelastic_projection unilateral_projection; do
    # A bound that a fail-safe breaks is part of the result.
    "${CARGO_TARGET_DIR:-target}/release/signorini-run" "examples/scenes/$name.toml" --fail-safe "$fail_safe" "${steps[@]}" "${passes[@]}" \
      --out "$out/$name-$fail_safe" > /dev/null || echo "$name with $fail_safe: status $?" >&2
  done
done
python3 benches/filter_scenes.py "$out" "$@" | tee "$out/table.md"
