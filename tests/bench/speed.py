# SPDX-License-Identifier: BSD-3-Clause
"""Ratios of our times to VTK's on the same scene in the same minutes, and bytes of archives.

Repetitions of ours (bench_speed) and of theirs (vtk_side.py) are interleaved and medians taken, so
that what else the machine does falls on both. VTK draws twice: an edit of a volume that it knows
("render"), the smaller figure, is what ratios are made of.
"""
import argparse
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
REPETITIONS = {128: 9, 256: 5, 512: 3}
TIERS = ("flat", "sliced", "sliced3", "layered", "field")


class Side:
    """A program that answers each line that we write with one of figures."""

    def __init__(self, command):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        text=True)
        self.answer("ready")

    def answer(self, expected=None):
        line = self.process.stdout.readline().rstrip("\n")
        if not line or (expected and line != expected):
            raise RuntimeError(f"{self.process.args[0]} ended or said '{line}'")
        return line

    def ask(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        return [float(figure) for figure in self.answer().split("\t")]

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def ours(binaries, scene, size, folder):
    return Side([str(binaries / "bin" / "bench_speed"), scene, str(size), str(folder)])


def vtk(folder, pixels):
    return Side(["xvfb-run", "-a", "/usr/bin/python3", str(HERE / "vtk_side.py"),
                 str(folder / f"{pixels}.json")])


def report(name, value):
    print(f"{name}\t{value:.6g}", flush=True)


def alternate(count, *asks):
    """Medians of each ask's figures, asked in turn `count` times after one round of warming up."""
    for ask in asks:
        ask()
    rounds = [[ask() for ask in asks] for _ in range(count)]
    return [[statistics.median(figures) for figures in zip(*(one[i] for one in rounds))]
            for i in range(len(asks))]


def measure_size(binaries, size, suffix, wanted, folder):
    count = REPETITIONS[size]
    we = ours(binaries, "turbulent", size, folder)
    insitu = {f"insitu_vs_vtk{suffix}", f"insitu_seconds{suffix}", "encode_write_vs_vti_zlib"}
    if insitu & wanted:
        they = vtk(folder, 512)
        execute, render, write = alternate(
            count, lambda: we.ask("execute"), lambda: they.ask("render"),
            lambda: they.ask(f"write {folder}/field.vti"))
        they.close()
        report(f"insitu_vs_vtk{suffix}", execute[0] / render[0])
        report(f"insitu_seconds{suffix}", execute[0])
        if not suffix:
            report("encode_write_vs_vti_zlib", execute[1] / write[0])
    if not suffix and "peak_memory_over_field" in wanted:
        fresh = ours(binaries, "turbulent", size, folder)
        grown, field = fresh.ask("memory")
        fresh.close()
        report("peak_memory_over_field", grown / field)
    if f"turbulent_bytes_percent{suffix}" in wanted:
        *parts, field = we.ask("bytes")
        report(f"turbulent_bytes_percent{suffix}", 100 * sum(parts) / field)
    for order in ("", "_runs") if not suffix else ("",):
        edits = {f"edit_vs_vtk{order}{suffix}", f"open_and_edit_vs_vtk{order}{suffix}"}
        if not edits & wanted:
            continue
        command = order.replace("_", "-")
        they = vtk(folder, 1024)
        edit, render = alternate(count, lambda: we.ask("edit" + command),
                                 lambda: they.ask("render"))
        report(f"edit_vs_vtk{order}{suffix}", render[0] / edit[0])
        if not suffix:
            opened, render = alternate(count, lambda: we.ask("open" + command),
                                       lambda: they.ask("render"))
            report(f"open_and_edit_vs_vtk{order}", render[0] / opened[0])
        they.close()
    we.close()
    if not suffix:
        measure_tiers(binaries, size, wanted, folder)


def measure_tiers(binaries, size, wanted, folder):
    """What each tier costs in situ, and how fast it is seen from elsewhere."""
    count = REPETITIONS[size]
    for tier in TIERS:
        novel = [(f"novel_view_vs_vtk_{tier}{how}{name}", f"novel {tier} {pixels} {word}", pixels)
                 for pixels, name in (("1024", ""), ("512", "_512px"))
                 for how, word in (("", "same"), ("_changed", "changed"))]
        insitu, peak = f"insitu_step_vs_vtk_{tier}", f"peak_memory_over_field_{tier}"
        if not wanted.intersection([insitu, peak, *(line for line, _, _ in novel)]):
            continue
        we = ours(binaries, "turbulent", size, folder)
        if peak in wanted:
            grown, field = we.ask(f"grown {tier}")
            report(peak, grown / field)
        if insitu in wanted:
            they = vtk(folder, 512)
            step, render = alternate(count, lambda: we.ask(f"step {tier}"),
                                     lambda: they.ask("render"))
            they.close()
            report(insitu, step[0] / render[0])
        for line, command, pixels in novel:
            if line not in wanted:
                continue
            they = vtk(folder, f"{pixels}-turned")
            turn, render = alternate(count, lambda: we.ask(command), lambda: they.ask("render"))
            they.close()
            report(line, render[0] / turn[0])
        we.close()


def measure_plume_bytes(binaries, folder):
    we = ours(binaries, "plume", 256, folder)
    *parts, field = we.ask("bytes")
    we.close()
    for name, part in zip(("attenuation", "length", "depth", "mip", "reference"), parts):
        report(f"archive_bytes_percent_{name}", 100 * part / field)
    report("archive_bytes_percent_sum", 100 * sum(parts) / field)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", help="not used: nothing here is random")
    parser.add_argument("lines", nargs="+")
    options = parser.parse_args()
    wanted = set(options.lines)
    for size, suffix in ((256, ""), (128, "_128"), (512, "_512")):
        mine = {line for line in wanted if line.endswith(suffix) and not
                line.startswith("archive_bytes") and (suffix or line[-4:] not in ("_128", "_512"))}
        if not mine:
            continue
        folder = pathlib.Path(tempfile.mkdtemp(prefix="vestige-bench-"))
        try:
            measure_size(options.bin, size, suffix, mine, folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    if any(line.startswith("archive_bytes") for line in wanted):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="vestige-bench-"))
        try:
            measure_plume_bytes(options.bin, folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
