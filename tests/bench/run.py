# SPDX-License-Identifier: BSD-3-Clause
"""Runs the benches and judges their figures: the engine of scripts/bench.

A bench prints "name<TAB>value" lines; units, goals and which bench makes which line stand in
lines.tsv beside this file. Every line of the table is printed, as nan and miss when its bench
failed or kept it back, so a figure cannot vanish quietly.
"""
import argparse
import math
import pathlib
import subprocess
import sys

import fidelity_page

HERE = pathlib.Path(__file__).resolve().parent
# What the page docs/fidelity.md is made of; `scripts/bench fidelity` measures these and writes it.
FIDELITY = ("edit_psnr_", "edit_bytes_", "novel_view_", "learned_error_", "ao_", "enhance_",
            "flat_storage_")


def read_table():
    """[(name, unit, goal, bench)] in printing order; goal is '-', '>=x' or '<=x'."""
    rows = []
    for line in (HERE / "lines.tsv").read_text().splitlines():
        if line and not line.startswith("#"):
            name, unit, goal, bench = line.split("\t")
            rows.append((name, unit, goal, bench))
    return rows


def verdict(value, goal):
    if math.isnan(value):
        return "miss"
    if goal == "-":
        return "pass"
    bound = float(goal[2:])
    return "pass" if (value >= bound if goal.startswith(">=") else value <= bound) else "miss"


def run_bench(bench, binaries, wanted, seeds):
    """Values by name; the bench is told which lines are wanted and its stderr passes through."""
    command = [str(binaries / "bin" / bench)]
    if bench.endswith(".py"):
        command = ["/usr/bin/python3", str(HERE / bench), "--bin", str(binaries)]
    command += ["--seeds", seeds, *wanted]
    print("bench:", " ".join(command), file=sys.stderr, flush=True)
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        print(f"bench: {bench} ended with {done.returncode}", file=sys.stderr)
    values = {}
    for line in done.stdout.splitlines():
        name, _, value = line.partition("\t")
        try:
            values[name] = float(value)
        except ValueError:
            print(f"bench: {bench} said: {line}", file=sys.stderr)
    return values


def main():
    parser = argparse.ArgumentParser(prog="scripts/bench", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="names or prefixes; none = all; fidelity = what docs/fidelity.md shows, "
                             "with --page")
    parser.add_argument("--page", action="store_true",
                        help="write docs/fidelity.md from what was measured")
    parser.add_argument("--list", action="store_true", help="print the names and goals only")
    parser.add_argument("--seeds", default="1..20", metavar="A..B",
                        help="seeds of the random transfer functions (default 1..20)")
    parser.add_argument("--known", type=pathlib.Path, metavar="FILE",
                        help="figures that this script or a bench printed before, NAME<TAB>VALUE...: "
                             "not measured again")
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bench"),
                        help="the build folder of preset bench")
    options = parser.parse_args()

    table = read_table()
    whole = "fidelity" in options.names
    names = [n.removesuffix("_256") for n in options.names if n != "fidelity"]
    names += FIDELITY if whole else ()
    lines = {row[0] for row in table}
    # A whole name is that line alone, not what it is a prefix of.
    rows = [row for row in table
            if not names or row[0] in names
            or any(row[0].startswith(n) for n in names if n not in lines)]
    if not rows:
        parser.error(f"no line is called or begins with {' or '.join(options.names)}; see --list")
    if options.list:
        for name, unit, goal, _ in rows:
            print(f"{name}\t{unit}\t{goal}")
        return 0

    known = {}
    for line in options.known.read_text().splitlines() if options.known else ():
        name, value, *_ = line.split("\t") + [""]
        known[name] = float(value)
    unmeasured, figures = False, {}
    for bench in dict.fromkeys(row[3] for row in rows):
        mine = [row for row in rows if row[3] == bench]
        left = [row[0] for row in mine if row[0] not in known]
        values = known | (run_bench(bench, options.bin, left, options.seeds) if left else {})
        for name, unit, goal, _ in mine:
            value = values.get(name, math.nan)
            outcome = verdict(value, goal)
            unmeasured |= math.isnan(value)
            figures[name] = (value, unit, goal, outcome)
            print(f"{name}\t{value:.4g}\t{unit}\t{goal}\t{outcome}", flush=True)
    if whole or options.page:
        fidelity_page.write(HERE.parents[1] / "docs", figures, options.seeds,
                            sum(row[0].startswith(FIDELITY) for row in table))
    return 1 if unmeasured else 0  # a missed goal is a finding, not a failure


if __name__ == "__main__":
    sys.exit(main())
