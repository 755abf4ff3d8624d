# SPDX-License-Identifier: BSD-3-Clause
"""Compiles, links and runs every whole C program in the documentation, and draws what its page draws.

usage: snippets.py SOURCE_DIR INCLUDE_DIR LIBRARY CC EXPLORER
A ```c block with a main() is a program; it must compile without a warning, end with 0, and leave an
archive with rows in it. Run again, it must say that the archive exists and end with that code. The
page's lines "vestige-explorer render ARCHIVE ..." must make pictures that show something.
"""
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
from collections import Counter


def programs(source):
    for page in [source / "README.md", *sorted((source / "docs").glob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"^```c\n(.*?)^```$", text, re.M | re.S):
            if re.search(r"\bint main\(", match.group(1)):
                line = text[:match.start()].count("\n") + 1
                yield f"{page.name}:{line}", match.group(1), text


def show_something(name, picture):
    """Fails for a picture that is black, flat, or a square of one colour."""
    data = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", picture, "-f", "rawvideo",
                           "-pix_fmt", "gray", "-"], capture_output=True, check=True).stdout
    histogram = Counter(data)
    mean = sum(v * n for v, n in histogram.items()) / len(data)
    spread = (sum((v - mean) ** 2 * n for v, n in histogram.items()) / len(data)) ** 0.5
    # Of what is drawn, no one brightness is most: shapes are shaded.
    background = data[0]
    drawn = {v: n for v, n in histogram.items() if abs(v - background) > 4}
    share = sum(drawn.values()) / len(data)
    flattest = max(drawn.values(), default=0) / max(1, sum(drawn.values()))
    figures = f"mean {mean:.1f}, spread {spread:.1f}, drawn {share:.3f}, flattest {flattest:.2f}"
    print(f"{name}: {picture.name}: {figures}")
    if not (3 < mean < 200 and spread > 10 and 0.05 < share < 0.95 and flattest < 0.3):
        raise SystemExit(f"{name}: {picture.name} shows nothing: {figures}")


def run(name, code, page, include, library, compiler, explorer):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "program.c").write_text(code, encoding="utf-8")
        subprocess.run([compiler, "-std=c11", "-Wall", "-Wextra", "-Werror", "-O1",
                        f"-I{include}", "program.c", "-o", "program", str(library),
                        f"-Wl,-rpath,{library.parent}", "-lm"], cwd=folder, check=True)
        program = [str(folder / "program")]
        done = subprocess.run(program, cwd=folder, check=True, timeout=280, capture_output=True)
        if done.stderr:
            raise SystemExit(f"{name} printed {done.stderr}")
        tables = list(folder.glob("*.cdb/data.csv"))
        if not tables or any(len(t.read_text().splitlines()) < 2 for t in tables):
            raise SystemExit(f"{name} ran, but left no archive with rows in it")
        again = subprocess.run(program, cwd=folder, timeout=280, capture_output=True, text=True)
        if again.returncode != 8 or "exists already" not in again.stderr:
            raise SystemExit(f"{name} ran again: {again.returncode}, {again.stderr!r}")
        archives = [table.parent.name for table in tables]
        lines = [shlex.split(line) for line in re.findall(r"^vestige-explorer render .*$", page, re.M)]
        lines = [line for line in lines if line[2] in archives]
        if not lines:
            raise SystemExit(f"{name}: its page draws nothing of {archives}")
        for line in lines:
            subprocess.run([explorer, *line[1:]], cwd=folder, check=True, timeout=280)
            show_something(name, folder / line[line.index("-o") + 1])
    print(f"{name}: compiled and ran")


def main():
    source, include, library = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    found = list(programs(source))
    if not any(name.startswith("README.md") for name, _, _ in found):
        raise SystemExit("README.md has no whole C program")
    for name, code, page in found:
        run(name, code, page, include, library, sys.argv[4], sys.argv[5])


if __name__ == "__main__":
    main()
