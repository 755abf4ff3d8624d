# SPDX-License-Identifier: BSD-3-Clause
"""Compiles, links and runs every whole C program in the documentation.

usage: snippets.py SOURCE_DIR INCLUDE_DIR LIBRARY CC
A ```c block with a main() is a program; it must compile without a warning, end with 0, and leave an
archive with rows in it.
"""
import pathlib
import re
import subprocess
import sys
import tempfile


def programs(source):
    for page in [source / "README.md", *sorted((source / "docs").glob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"^```c\n(.*?)^```$", text, re.M | re.S):
            if re.search(r"\bint main\(", match.group(1)):
                line = text[:match.start()].count("\n") + 1
                yield f"{page.name}:{line}", match.group(1)


def run(name, code, include, library, compiler):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "program.c").write_text(code, encoding="utf-8")
        subprocess.run([compiler, "-std=c11", "-Wall", "-Wextra", "-Werror", "-O1",
                        f"-I{include}", "program.c", "-o", "program", str(library),
                        f"-Wl,-rpath,{library.parent}", "-lm"], cwd=folder, check=True)
        subprocess.run([str(folder / "program")], cwd=folder, check=True, timeout=280)
        tables = list(folder.glob("*.cdb/data.csv"))
        if not tables or any(len(t.read_text().splitlines()) < 2 for t in tables):
            raise SystemExit(f"{name} ran, but left no archive with rows in it")
    print(f"{name}: compiled and ran")


def main():
    source, include, library = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    found = list(programs(source))
    if not any(name.startswith("README.md") for name, _ in found):
        raise SystemExit("README.md has no whole C program")
    for name, code in found:
        run(name, code, include, library, sys.argv[4])


if __name__ == "__main__":
    main()
