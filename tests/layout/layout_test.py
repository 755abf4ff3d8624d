#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""layout.py finds every kind of fault that it is there for."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent


def faults(rooms, files):
    """What layout.py prints about files (path: text) under these rooms; its last line counts them."""
    with tempfile.TemporaryDirectory() as top:
        for path, text in files.items():
            file = pathlib.Path(top) / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        order = pathlib.Path(top) / "rooms.txt"
        order.write_text(rooms)
        run = subprocess.run(
            [sys.executable, HERE / "layout.py", top, order], capture_output=True, text=True, check=False
        )
    return run.returncode, run.stdout


ROOMS = "a:\n  a/high\n  a/low\n\nb: a/low\n  b\n"
GOOD = {
    "a/high/top.cpp": '#include "a/low/base.h"\n#include "shade_frag.embed.h"\n',
    "a/low/base.h": "",
    "a/low/shade.frag": "",
    "b/use.cpp": '#include "a/low/base.h"\n',
}


class Layout(unittest.TestCase):
    def test_downward_is_right(self):
        self.assertEqual(faults(ROOMS, GOOD)[0], 0)

    def finds(self, what, changes):
        code, text = faults(ROOMS, GOOD | changes)
        self.assertEqual(code, 1)
        self.assertIn(what, text)

    def test_upward(self):
        self.finds("a/high stands above a/low", {"a/low/base.h": '#include "a/high/up.h"\n', "a/high/up.h": ""})

    def test_upward_by_shader(self):
        self.finds(
            "a/high stands above a/low",
            {"a/low/base.h": '#include "warp_vert.embed.h"\n', "a/high/warp.vert": ""},
        )

    def test_another_folder(self):
        self.finds("b may include", {"b/use.cpp": '#include "a/high/top.h"\n', "a/high/top.h": ""})

    def test_no_room(self):
        self.finds("no room", {"a/attic/box.h": ""})

    def test_tests_without_a_room(self):
        self.finds("no room", {"tests/a/attic/box_test.cpp": ""})

    def test_a_hall(self):
        self.finds("at most 30", {f"a/low/f{i}.h": "" for i in range(31)})

    def test_an_empty_room(self):
        code, text = faults("a:\n  a/high\n  a/low\n  a/cellar\n\nb: a/low\n  b\n", GOOD)
        self.assertEqual(code, 1)
        self.assertIn("empty", text)


if __name__ == "__main__":
    unittest.main()
