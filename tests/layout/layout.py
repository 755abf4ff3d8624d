#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""layout.py SOURCE_DIR [ROOMS]: holds the includes of the sources against the declared order of rooms (rooms.txt).

A room is a folder. Prints every arrow that points upward or sideways to another folder, every source file outside of a
declared room, every test outside of one, and every room of more than MOST files; exits with 1 if there is any.
"""
import pathlib
import re
import sys

MOST = 30
SOURCES = {".c", ".cpp", ".h", ".hpp", ".glsl", ".frag", ".vert", ".comp", ".map"}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)


def declared(path):
    """The rooms from top to bottom, and for each folder what others its files may include."""
    rooms, others = [], {}
    for line in path.read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith(" "):
            rooms.append(line.strip())
        else:
            folder, _, seen = line.partition(":")
            others[folder] = seen.split()
    return rooms, others


def main():
    top = pathlib.Path(sys.argv[1])
    here = pathlib.Path(__file__).with_name("rooms.txt")
    rooms, others = declared(pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else here)
    files = sorted(
        p.relative_to(top) for folder in others for p in (top / folder).rglob("*") if p.suffix in SOURCES
    )
    # Shaders are included through the headers that they are embedded in.
    embedded = {re.sub(r"[^A-Za-z0-9]", "_", p.name) + ".embed.h": p for p in files}
    faults, count, arrows = [], dict.fromkeys(rooms, 0), 0
    for file in files:
        room = str(file.parent)
        if room not in count:
            faults.append(f"{file}: its folder is no room of rooms.txt")
            continue
        count[room] += 1
        for name in INCLUDE.findall((top / file).read_text(errors="replace")):
            beside = file.parent / name
            target = embedded.get(name) or (beside if (top / beside).is_file() else pathlib.Path(name))
            other = str(target.parent)
            if other == room or not (top / target).is_file():
                continue
            arrows += 1
            folder = file.parts[0]
            if target.parts[0] != folder:
                if not any(other == seen or other.startswith(seen + "/") for seen in others[folder]):
                    faults.append(f"{file}: includes {target}, but {folder} may include {others[folder] or 'no other'}")
            elif rooms.index(other) < rooms.index(room):
                faults.append(f"{file}: includes {target}, but {other} stands above {room}")
    for file in sorted(p for folder in others for p in (top / "tests" / folder).rglob("*_test.cpp")):
        room = str(file.parent.relative_to(top / "tests"))
        if room not in count:
            faults.append(f"{file.relative_to(top)}: tests stand in the rooms of what they test; {room} is no room")
    faults += [f"{room}: {n} files, at most {MOST}" for room, n in count.items() if n > MOST]
    faults += [f"{room}: declared, but empty" for room, n in count.items() if n == 0]
    print("\n".join(faults))
    print(f"{len(files)} files in {len(rooms)} rooms, {arrows} includes across rooms, {len(faults)} faults")
    return 1 if faults or arrows == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
