#!/usr/bin/env python3
"""phases.py PROGRAM [PROGRAM ...]: where the seconds of a solve go, of one or more builds in turns, on one thread.

Medians over the repetitions, in ms; `other` is what belongs to no phase, and its part of the total. Models are written into a folder of their own first."""
import argparse
import json
import os
import statistics
import subprocess
import tempfile

MODELS = {
    "cantilever": (["cantilever"], 20),
    "turbine": (["turbine"], 20),
    "crank": (["crank"], 20),
    "grid 20x14": (["grid"], 56),
    "grid 60x42": (["grid", "--cells", "60x42"], 56),
    "fine crank": (["crank", "--density", "8"], 20),
    "grid 220x150": (["grid", "--cells", "220x150"], 56),
}
PHASES = ["analyze", "factorize", "solve", "orthogonalize", "examine", "place", "iterate", "recover", "judge", "other", "total"]


def seconds_of(program, path, modes):
    run = subprocess.run([program, "solve", path, "--modes", str(modes), "--format", "json", "--quiet"],
                         capture_output=True, check=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    result = json.loads(run.stdout)
    return result["seconds"], result["peak_memory_bytes"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+", metavar="PROGRAM")
    parser.add_argument("--models", default=",".join(list(MODELS)[:5]), help="of: " + ", ".join(MODELS))
    parser.add_argument("--repeat", type=int, default=5)
    arguments = parser.parse_args()
    print("| model | program | " + " | ".join(PHASES) + " | other / total | MB |")
    print("|---" * (len(PHASES) + 4) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.models.split(","):
            scene, modes = MODELS[name]
            path = os.path.join(folder, "model.h5")
            subprocess.run([arguments.programs[0], "scene", *scene, "--output", path], check=True, stdout=subprocess.DEVNULL)
            runs = {program: [] for program in arguments.programs}
            for _ in range(arguments.repeat):
                for program in arguments.programs:
                    runs[program].append(seconds_of(program, path, modes))
            for number, program in enumerate(arguments.programs, 1):
                medians = [statistics.median(seconds[phase] for seconds, _ in runs[program]) for phase in PHASES]
                peak = statistics.median(peak for _, peak in runs[program])
                print(f"| {name} | {number} | " + " | ".join(f"{1e3*value:.4g}" for value in medians)
                      + f" | {medians[-2]/medians[-1]:.0%} | {peak/1e6:.0f} |", flush=True)
            os.remove(path)


if __name__ == "__main__":
    main()
