# SPDX-License-Identifier: BSD-3-Clause
"""plume_overhead_percent and plume_mlups: vestige-mini-sim at 256^3, one field, the default
proxies, one 512^2 view, every 10th cycle; the share of time is what the program itself reports."""
import argparse
import pathlib
import subprocess
import sys
import tempfile

CONFIG = """
[output]
path = "plume.cdb"
[trigger]
every_cycles = 10
[image]
width = 512
height = 512
[[view]]
set = "front"
[[field]]
source = "temperature"
range = [0.0, 1.0]
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", help="not used: nothing here is random")
    parser.add_argument("lines", nargs="+")
    options = parser.parse_args()
    program = (options.bin / "bin" / "vestige-mini-sim").resolve()
    with tempfile.TemporaryDirectory(prefix="vestige-bench-") as folder:
        config = pathlib.Path(folder) / "plume.toml"
        config.write_text(CONFIG)
        done = subprocess.run([str(program), "--size", "256", "--steps", "60", "--config",
                               str(config), "--fields", "temperature", "--quiet"],
                              cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
    figures = dict(line.split() for line in done.stdout.splitlines() if len(line.split()) == 2)
    print(f"plume_overhead_percent\t{figures['adaptor_percent']}")
    print(f"plume_mlups\t{figures['mlups']}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
