#!/usr/bin/env bash
# cloth.sh OUT [STEPS] [SCENE...]: this library and other systems on the same cloths (drape, crumple, falling_cloth), one
# after the other, STEPS steps (100) each or SECONDS_EACH (400) processor seconds; ends with a table. PEERS narrows the list.
set -euo pipefail
out=${1:?usage: benches/peers/cloth.sh OUT [STEPS] [SCENE...]}
steps=${2:-100}
scenes=("${@:3}")
[ ${#scenes[@]} -gt 0 ] || scenes=(drape crumple falling_cloth)
peers=${PEERS:-mujoco_ipc mujoco_rows newton newton_4 pybullet ipc bullet}
budget=${SECONDS_EACH:-400}
mkdir -p "$out"
out=$(realpath -- "$out")
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.."
. benches/peers/python.sh
cargo build --release --quiet --features runner --bin signorini-run
g++ -O2 benches/peers/cloth/bullet_cloth.cpp -o "$out/bullet_cloth" $(pkg-config --cflags --libs bullet-float64)

# One run; a system that fails leaves its words and the table says so.
run() {
  local name=$1
  shift
  echo "$(date +%T) $name" >&2
  "$@" >"$out/$name.json" 2>"$out/$name.err" || echo "$name failed: $(tail -1 "$out/$name.err")" >&2
}
for scene in "${scenes[@]}"; do
  run "signorini_$scene" target/release/signorini-run "examples/scenes/$scene.toml" --threads 1 --steps "$steps" --json --out "$out/run_$scene"
  options=(--scene "$scene" --steps "$steps" --budget "$budget")
  for peer in $peers; do
    case $peer in
      mujoco_*) run "${peer}_$scene" "$python" benches/peers/cloth/mujoco_flex.py "${options[@]}" --mode "${peer#mujoco_}" ;;
      newton) run "newton_$scene" "$python" benches/peers/cloth/newton_cloth.py "${options[@]}" ;;
      newton_4) run "newton_4_$scene" "$python" benches/peers/cloth/newton_cloth.py "${options[@]}" --substeps 4 --iterations 5 --ring-filter 1 ;;
      pybullet) run "pybullet_$scene" "$python" benches/peers/cloth/pybullet_soft.py "${options[@]}" ;;
      ipc) run "ipc_$scene" "$python" benches/peers/cloth/ipc_step.py "${options[@]}" ;;
      bullet) [ "$scene" = falling_cloth ] || run "bullet_$scene" "$out/bullet_cloth" soft 50 "$steps" - 2 "$scene" ;;
    esac
  done
done
"$python" benches/peers/cloth/table.py "$out"
