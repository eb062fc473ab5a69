#!/usr/bin/env bash
# trajectories.sh OUT [STEPS]: cloth that MuJoCo (contact rows) and Bullet (soft body) let cross is recorded, made
# collision-free by ci/clean-trajectory in displacement and in position mode, and checked by ci/certify and by ipctk.
# STEPS (120) steps of MuJoCo, 200 of Bullet; every fourth is a frame. A position mode that takes longer than SECONDS_EACH
# (300) is cut off. Ends with a table; ipctk's collision-free step size on the same frames beside it.
set -euo pipefail
out=${1:?usage: benches/peers/trajectories.sh OUT [STEPS]}
steps=${2:-120}
seconds=${SECONDS_EACH:-300}
mkdir -p "$out"
out=$(realpath -- "$out")
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.."
. benches/peers/python.sh
cargo build --release --quiet --example clean_trajectory --example certify
g++ -O2 benches/peers/cloth/bullet_cloth.cpp -o "$out/bullet_cloth" $(pkg-config --cflags --libs bullet-float64)

for scene in drape crumple; do
  for peer in mujoco bullet; do
    name=${peer}_$scene
    options=(--friction 0.3 --thickness 0.002 --fps 62.5)
    if [ -e "$out/$name/frame_0000.obj" ]; then
      echo "$name is there" >&2
    elif [ $peer = mujoco ]; then
      echo "$(date +%T) $name" >&2
      "$python" benches/peers/cloth/mujoco_flex.py --mode rows --scene $scene --steps "$steps" --check 4 --save "$out/$name.npz" >"$out/$name.json"
      "$python" benches/peers/cloth/frames.py "$out/$name.npz" "$out/$name" $scene
    else
      mkdir -p "$out/$name"
      FRAMES="$out/$name" "$out/bullet_cloth" soft 50 200 - 1 $scene >"$out/$name.txt"
    fi
    if [ $peer = mujoco ]; then
      options+=(--scripted ground)
      [ $scene = crumple ] || options+=(--scripted sphere)
    else
      options+=(--scripted box)
    fi
    for mode in displacement position; do
      rm -rf "${out:?}/${name}_$mode"
      status=0
      timeout "$seconds" target/release/examples/clean_trajectory "$out/$name" "$out/${name}_$mode" --mode $mode "${options[@]}" >"$out/${name}_$mode.csv" || status=$?
      [ $status = 0 ] || echo "$name, $mode mode: status $status" >&2
      target/release/examples/certify "$out/${name}_$mode"/*.obj >"$out/${name}_$mode.certificate" || echo "$name, $mode mode: not certified" >&2
    done
  done
done
"$python" benches/peers/trajectories.py "$out"
