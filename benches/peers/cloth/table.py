"""Prints the runs of a folder that cloth.sh wrote as a Markdown table: table.py OUT"""
import json
import pathlib
import re
import sys

SCENES = ["drape", "crumple", "falling_cloth"]


def rows(folder):
    for path in sorted(folder.glob("*.json")):
        scene = next((s for s in SCENES if path.stem.endswith("_" + s)), None)
        text = path.read_text()
        if scene is None:
            continue
        system = path.stem[: -len(scene) - 1]
        lines = [line for line in text.splitlines() if line.startswith("{")]
        if bullet := re.search(r"cpu ms/step mean \S+ median (\S+) p95 (\S+)", text):
            yield scene, system, float(bullet[1]) / 1e3, float(bullet[2]) / 1e3, "?", "its own sheet of 2 m; not checked here"
        elif not lines:
            yield scene, system, float("inf"), float("inf"), 0, "failed"
        elif "processor_seconds_per_step" in lines[-1]:
            r = json.loads(lines[-1])
            spread = r["processor_seconds_per_step"]
            yield scene, system, spread["median"], spread["p95"], r["steps"], f"{r['intersections']} crossings, every step certified"
        else:
            r = json.loads(lines[-1])
            said = f"{r['frames_intersecting']} of {r['frames_checked']} checks found crossings"
            if r["self_pairs_max"] == 0:
                said += "; self-contact never reached"
            if r["exploded"]:
                said += "; exploded"
            yield scene, system, r["cpu_per_step_median"], r["cpu_per_step_p95"], r["steps"], said


print("| scene | system | CPU s a step, median | p95 | steps | checks |\n|---|---|---|---|---|---|")
for scene, system, median, p95, steps, said in sorted(rows(pathlib.Path(sys.argv[1])), key=lambda r: (SCENES.index(r[0]), r[2])):
    print(f"| {scene} | {system} | {median:.4f} | {p95:.4f} | {steps} | {said} |")
