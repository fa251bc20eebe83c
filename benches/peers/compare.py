"""Noctule and its peers on the same scenarios in one run; see `run` in this directory."""

import argparse
import csv
import importlib
import importlib.metadata
import json
import math
import multiprocessing
import pathlib
import platform
import resource
import subprocess
import sys

import sampling
import tangents
from coding import CODINGS
from pricing import Pricer, Spent, binary
from searches import SEARCHES

WAYPOINTS = 10
SCENARIOS = sorted(pathlib.Path(__file__).parents[2].glob("scenarios/paper-*.json"))


def cpu_s():
    """CPU seconds of this process and its finished children."""
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def search(job):
    """One run of a peer: (feasible, cost, CPU seconds, evaluations)."""
    name, coding_idx, file, seed, budget = job
    for package in name.split()[0], "numpy", "scipy.optimize":
        importlib.import_module(package)
    begun = cpu_s()
    coding = CODINGS[coding_idx](json.loads(file.read_text()), WAYPOINTS)
    with Pricer(file, coding, budget) as pricer:
        try:
            SEARCHES[name](pricer, seed, budget)
        except Spent:
            pass
    violation, cost = pricer.best
    return violation == 0.0, cost, cpu_s() - begun, pricer.evaluations


def plan(document, seed):
    """One plan by noctule with its defaults: (feasible, cost, CPU seconds, evaluations)."""
    document = {**document, "planner": {"waypoints": WAYPOINTS, "seed": seed}}
    begun = cpu_s()
    done = subprocess.run(
        [binary(), "plan", "-"], input=json.dumps(document), stdout=subprocess.PIPE, text=True
    )
    if done.returncode not in (0, 3):
        raise SystemExit(f"benches/peers: {binary()} plan failed with {done.returncode}")
    result = json.loads(done.stdout)
    return result["feasible"], result["cost"]["total"], cpu_s() - begun, result["evaluations"]


def ompl_length(job):
    name, scenario, discs, seconds, seed = job
    begun = cpu_s()
    length = sampling.length(name, scenario, discs, seconds, seed)
    return length is not None, length, cpu_s() - begun, None


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else math.nan


def row(scenario, name, coding, runs):
    costs = [run[1] for run in runs if run[0]]
    return {
        "scenario": scenario,
        "planner": name,
        "coding": coding,
        "feasible": f"{len(costs)} of {len(runs)}",
        "mean": mean(costs),
        "best": min(costs, default=math.nan),
        "CPU s": mean(run[2] for run in runs),
    }


def costs(pool, peers, seeds, budget):
    """For each scenario, a row for noctule and one for each peer's better coding."""
    rows = []
    for file in SCENARIOS:
        document = json.loads(file.read_text())
        own = row(file.stem, "noctule", "", [plan(document, seed) for seed in seeds])
        rows.append(own)
        for name in peers:
            jobs = [(name, idx, file, seed, budget) for idx in range(len(CODINGS)) for seed in seeds]
            runs, both = pool.map(search, jobs, chunksize=1), []
            for idx, coding in enumerate(CODINGS):
                part = runs[idx * len(seeds) : (idx + 1) * len(seeds)]
                share = sum(run[0] for run in part)
                both.append((-share, mean(run[1] for run in part), idx, row(file.stem, name, coding.name, part)))
            rows.append(min(both)[-1])
        for entry in rows[-len(peers) - 1 :]:
            entry["cost ratio"] = entry["mean"] / own["mean"]
            entry["CPU ratio"] = entry["CPU s"] / own["CPU s"]
        print(f"{file.stem} is done", file=sys.stderr)
    return rows


def lengths(pool, planners, seeds, seconds):
    """Length only, on flat ground, against the exact shortest way."""
    rows = []
    for file in SCENARIOS:
        scenario = json.loads(file.read_text())
        if scenario["terrain"]["kind"] != "flat":
            continue
        for threat in scenario["threats"]:
            threat["influence"] = threat["radius"]
        scenario["weights"] = {"fuel": 1, "threat": 0, "altitude": 0}
        discs = [(t["center"]["x"], t["center"]["y"], t["radius"]) for t in scenario["threats"]]
        start, target = scenario["start"], scenario["target"]
        level = [(end["x"], end["y"]) for end in (start, target)]
        exact, rise = tangents.shortest(*level, discs), target["z"] - start["z"]
        part = [row(file.stem, "noctule", "", [plan(scenario, seed) for seed in seeds])]
        for name in planners:
            jobs = [(name, scenario, discs, seconds, seed) for seed in seeds]
            runs = pool.map(ompl_length, jobs, chunksize=1)
            # The discs have no top, so the climb is spread along the way.
            runs = [(ok, ok and math.hypot(way, rise), *rest) for ok, way, *rest in runs]
            part.append(row(file.stem, name, "", runs))
        for entry in part:
            entry["exact"] = math.hypot(exact, rise)
            entry["mean excess %"] = (entry["mean"] / entry["exact"] - 1) * 100
            entry["best excess %"] = (entry["best"] / entry["exact"] - 1) * 100
        rows += part
    return rows


def table(rows, columns):
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for entry in rows:
        lines.append("| " + " | ".join(shown(entry[column]) for column in columns) + " |")
    return "\n".join(lines)


def shown(value):
    if not isinstance(value, float):
        return str(value)
    return "-" if math.isnan(value) else f"{value:.4g}" if abs(value) < 10 else f"{value:.2f}"


def installed(package):
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        print(f"benches/peers: {package} is not installed, its rows are left out", file=sys.stderr)
        return None


def main():
    parser = argparse.ArgumentParser(prog="benches/peers/run")
    parser.add_argument("--out", type=pathlib.Path, help="directory for peers.md and CSV files")
    parser.add_argument("--seeds", type=int, default=5, help="runs of each, with the seeds 1, 2, ...")
    parser.add_argument("--evaluations", type=int, default=20_000, help="of a peer's search")
    parser.add_argument("--seconds", type=float, default=1.0, help="for an OMPL planner")
    parser.add_argument("--jobs", type=int, default=1, help="peers' runs side by side")
    arguments = parser.parse_args()
    versions = {package: installed(package) for package in ("mealpy", "scipy", "ompl")}
    peers = [name for name in SEARCHES if versions[name.split()[0]]]
    planners = list(sampling.PLANNERS) if versions["ompl"] else []
    seeds = range(1, arguments.seeds + 1)
    with multiprocessing.get_context("spawn").Pool(arguments.jobs) as pool:
        by_length = lengths(pool, planners, seeds, arguments.seconds)
        by_cost = costs(pool, peers, seeds, arguments.evaluations)
    known = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
    page = "\n\n".join(
        [
            f"Python {platform.python_version()}, {known}; seeds 1 to {arguments.seeds}; N = {WAYPOINTS}.",
            f"Cost, {arguments.evaluations} evaluations a peer:",
            table(by_cost, [*row("", "", "", []), "cost ratio", "CPU ratio"]),
            f"Length alone, {arguments.seconds:g} s an OMPL planner:",
            table(
                by_length,
                ["scenario", "planner", "feasible", "exact", "mean excess %", "best excess %", "CPU s"],
            ),
        ]
    )
    if not arguments.out:
        print(page)
        return
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "peers.md").write_text(page + "\n")
    for name, rows in ("peers-cost.csv", by_cost), ("peers-length.csv", by_length):
        with open(arguments.out / name, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
