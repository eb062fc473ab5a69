"""Repeats the figures of [Otaduy09, §6] and draws them. Called by benches/figures.sh, which builds what it runs.

    python benches/figures.py OUT [anticipation] [resolution] [rounds] [ablation]

Times are processor seconds on one thread, averaged over windows of 600 ms of the simulation as in the paper, or of 150 ms where
few steps are run.
"""

import csv
import json
import pathlib
import re
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

WINDOW = 0.6  # s
SCENES = pathlib.Path("examples/scenes")
FEWEST_CONTACTS = 300  # below, a step is its fixed costs


def bench(*words):
    subprocess.run(["cargo", "bench", "--quiet", "--bench", "figures", "--", *map(str, words)], check=True)


def run(scene, out, *words):
    """The runner on a scene, one thread; its final line. A run that stands in OUT already is not repeated."""
    if (out / "report.json").exists():
        return json.loads((out / "report.json").read_text())
    command = ["target/release/signorini-run", scene, "--out", out, "--threads", "1", "--json", *words]
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, text=True)
    if not (out / "stats.csv").exists():
        sys.exit(f"{scene}: {done.stdout}")
    return json.loads(done.stdout.splitlines()[-1])


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def windows(steps, seconds="seconds", window=WINDOW):
    """Mean contacts and seconds of each window of the simulation, of those with contacts enough."""
    if not steps:
        return np.zeros((0, 2))
    groups = {}
    for step in steps:
        groups.setdefault(int(int(step["step"]) * float(step["dt"]) / window), []).append(step)
    mean = lambda group, name: np.mean([float(step[name]) for step in group])
    points = [(mean(group, "contacts"), mean(group, seconds)) for _, group in sorted(groups.items())]
    return np.array([point for point in points if point[0] >= FEWEST_CONTACTS]).reshape(-1, 2)


def slope(points):
    """Exponent of the best power law."""
    if len(points) < 3:
        return float("nan")
    return np.polyfit(np.log(points[:, 0]), np.log(points[:, 1]), 1)[0]


def plot(path, series, title):
    """Seconds over contacts, both axes logarithmic; the slope of each series in the legend."""
    figure, axes = plt.subplots(figsize=(6, 4.2), layout="constrained")
    for (name, points), marker in zip(series.items(), "os^Dv"):
        if len(points):
            axes.loglog(points[:, 0], points[:, 1], marker, label=f"{name}: slope {slope(points):.2f}")
    axes.set(xlabel="contacts", ylabel="s per step", title=title)
    axes.legend()
    axes.grid(True, which="both", alpha=0.3)
    figure.savefig(path, dpi=110)
    for name, points in series.items():
        print(f"{path.name}, {name}: slope {slope(points):.2f},", ", ".join(f"{c:.0f}: {s:.3f}" for c, s in points))


def anticipation(out):
    """Fig. 6, left: full against iterative anticipation on the same steps, without friction; then with friction."""
    series = {}
    cases = {"without friction": ["friction=0"], "friction 0.4": ["friction=0.4", "contacts=3000", "steps=20", "every=3"]}
    for name, words in cases.items():
        path = out / f"anticipation_{words[0].split('=')[1]}.csv"
        bench("anticipation", path, *words)
        table = rows(path)
        for method in ["full", "iterative"]:
            mine = [row for row in table if row["method"] == method]
            missed = sum(int(row["not_converged"]) for row in mine if int(row["contacts"]) > 0)
            touching = sum(int(row["contacts"]) > 0 for row in mine)
            print(f"{name}, {method} anticipation: {missed} of {touching} steps not converged")
            if name == "without friction":
                series[f"{method} anticipation"] = windows(mine)
    plot(out / "figure_6_left.png", series, "Full against iterative anticipation, no friction")


def resolution(out):
    """Fig. 6, right: soft boxes of four resolutions, iterative anticipation."""
    source = (SCENES / "soft_pile.toml").read_text()
    # Boxes alone, in every other slot: side by side some of them would overlap. No friction, as on the left.
    source = re.sub(r'\[\[solid\]\]\nname = "cylinder".*?(?=\n\[\[)', "", source, flags=re.S)
    source = re.sub(r"friction = [0-9.]+", "friction = 0.0", source)
    source = re.sub(r"\[bounds\].*?(?=\n\[\[)", "", source, flags=re.S)
    source += '\n[settings]\nsolver = "iterative_anticipation"\n'
    series = {}
    for cells in [[2, 1, 1], [2, 2, 2], [4, 3, 2], [5, 4, 3]]:
        scene = out / f"boxes_{'x'.join(map(str, cells))}.toml"
        scene.write_text(source.replace("cells = [4, 3, 2]", f"cells = {cells}"))
        folder = out / scene.stem
        report = run(scene, folder, "--steps", "90")
        steps = [dict(step, dt=report["dt"]) for step in rows(folder / "stats.csv")]
        tetrahedra = 6 * cells[0] * cells[1] * cells[2]
        series[f"{tetrahedra} tetrahedra a body"] = windows(steps, "processor_seconds", 0.15)
    plot(out / "figure_6_right.png", series, "Iterative anticipation, 82 soft boxes")


def rounds(out):
    """Histogram of the rounds, constrained against unconstrained solve, tail, and time by stage, scene by scene."""
    scenes = {"drape": None, "crumple": None, "falling_cloth": None, "soft_pile": None, "pile": None, "letters": None,
              "layered_dress_six": None}
    figure, (axes, times) = plt.subplots(2, len(scenes), figsize=(2.2 * len(scenes), 4.6), layout="constrained", sharey="row")
    print("scene | steps | rounds 1, 2, 3, more | at most 3 | solve over dynamics | slowest over median solve | dynamics, search and"
          " detection, rows, solve, certificate")
    for axis, time, (name, steps) in zip(axes, times, scenes.items()):
        folder = out / name
        words = ["--steps", str(steps)] if steps else []
        report = run(SCENES / f"{name}.toml", folder, *words)
        histogram = {int(k): v for k, v in report["cmr_rounds_histogram"].items()}
        total = sum(histogram.values())
        axis.bar([str(k) for k in sorted(histogram)], [histogram[k] / total for k in sorted(histogram)])
        axis.set(title=name, xlabel="rounds")
        shares = np.sort([float(row["processor_seconds"]) for row in rows(folder / "stats.csv")])
        time.semilogy(np.linspace(0, 1, len(shares)), shares)
        time.set(xlabel="share of steps")
        time.grid(True, alpha=0.3)
        table = [row for row in rows(folder / "stats.csv") if int(row["contacts"]) > 0]
        solve = np.array([float(row["solve"]) for row in table])
        dynamics = np.array([float(row["dynamics"]) for row in table])
        few = [histogram.get(k, 0) for k in [1, 2, 3]]
        stages = report["seconds_by_stage"]
        whole = stages["total"]
        split = [stages["dynamics"], stages["search"] + stages["detection"], stages["rows"], stages["solve"], stages["certificate"]]
        slow = np.mean(solve > 10 * np.median(solve))
        print(
            f"{name} | {report['steps']} | {few} {total - sum(few)} | {report['rounds_within_three']:.3f} |"
            f" {np.median(solve / dynamics):.2f} | {solve.max() / np.median(solve):.1f} ({100 * slow:.1f} % beyond 10) | "
            + ", ".join(f"{100 * part / whole:.0f} %" for part in split)
        )
    axes[0].set_ylabel("share of steps with contact")
    times[0].set_ylabel("processor s, at most")
    figure.savefig(out / "rounds.png", dpi=110)


def ablation(out):
    """What near contacts, rows in positions and repeats are worth."""
    bench("ablation", out / "ablation.csv")
    for row in rows(out / "ablation.csv"):
        print(" | ".join(row.values()))


if __name__ == "__main__":
    figures = {f.__name__: f for f in [anticipation, resolution, rounds, ablation]}
    folder, chosen = pathlib.Path(sys.argv[1]), sys.argv[2:] or list(figures)
    for name in chosen:
        figures[name](folder)
