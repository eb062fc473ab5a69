"""The table of benches/filter_scenes.sh from the reports of its runs: filter_scenes.py OUT SCENE..."""

import csv
import json
import pathlib
import sys

FAIL_SAFES = {"rigid_zone": "rigid", "inelastic_projection": "inelastic", "unilateral_projection": "unilateral"}
HEADER = ["scene", "fail-safe", "degrees of freedom", "time step [s]", "steps", "total [s]", "collision [s]", "mean [s]",
          "steps with zones", "most zones", "steps pinched", "came [m]"]


def row(out, scene, fail_safe):
    folder = out / f"{scene}-{fail_safe}"
    report = json.loads((folder / "report.json").read_text())
    with open(folder / "stats.csv", newline="") as file:
        steps = list(csv.DictReader(file))
    # Processor seconds, of which the part that is not spent on dynamics: the clock also counts what else runs.
    total = sum(float(step["processor_seconds"]) for step in steps)
    clock = sum(float(step["seconds"]) for step in steps)
    collision = total * (1.0 - report["seconds_by_stage"]["dynamics"] / clock)
    zones = max(int(step["projected_zones"]) + int(step["rigid_zones"]) for step in steps)
    came = ", ".join(f"{end['travel']:.2f}" for end in report["ends"])
    return [scene, FAIL_SAFES[fail_safe], degrees_of_freedom(report), f"{report['dt']:.5f}", report["steps"], f"{total:.1f}",
            f"{collision:.1f}", f"{collision / max(len(steps), 1):.4f}", report["failsafes"], zones, report["pinched"], came]


def degrees_of_freedom(report):
    return 3 * report["free_vertices"]


def main():
    out = pathlib.Path(sys.argv[1])
    lines = [HEADER, ["---"] * len(HEADER)]
    for scene in (argument.split(":")[0] for argument in sys.argv[2:]):
        lines += [row(out, scene, fail_safe) for fail_safe in FAIL_SAFES]
    for line in lines:
        print("| " + " | ".join(str(cell) for cell in line) + " |")


if __name__ == "__main__":
    main()
