#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""citations.py SOURCE_DIR: what code and pages cite is in the repository.

Every [Key YEAR] stands in docs/references.md, every key there is cited, every "method §N" and "classification §N" is a
section of that page, a section or equation without a key stands in a file that names its paper, and links between
pages reach a file and a heading. Prints what dangles; exits with 1 if anything does.
"""
import pathlib
import re
import sys

KEY = r"[A-Z][a-z]+ (?:19|20)\d\d|Bergeron"
CITED = re.compile(r"\[((?:" + KEY + r")(?:[,;] [^\]]*)?)\]")
LOCATOR = re.compile(r"(?:\beqs?\. ?\d|\bFigs?\. ?\d|\bTables? \d|(?<!method )(?<!Method )(?<!classification )(?<!and )(?<!, )§\d)")
SECTION = re.compile(r"\b([Mm]ethod|classification) (§\d+(?:(?:, | and )§\d+)*)")
LINK = re.compile(r"\]\(([^)\s]+)\)")
FOLDERS = ("adaptor", "docs", "examples", "explorer", "mini-sim", "proxy", "tests")
GONE = re.compile(r"\bdesign\.md|visualization-by-proxy|piecewise-analytic-novel-views|gaussian-transfer-functions|"
                  r"position-dependent-classification|direct-volume-rendering-notes|\bet al\.|\bpaper \d")


def headings(text):
    """Anchors of a page as they are linked to."""
    lines = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S).splitlines()
    names = [line.lstrip("#").strip() for line in lines if re.match(r"#+ ", line)]
    return {re.sub(r"[^\w\- ]", "", name.lower()).replace(" ", "-") for name in names}


def main():
    top = pathlib.Path(sys.argv[1])
    listed = [f.relative_to(top).as_posix() for folder in FOLDERS for f in sorted((top / folder).rglob("*"))]
    listed += [f.name for f in top.glob("*.md")]
    ends = (".md", ".h", ".hpp", ".c", ".cpp", ".glsl", ".frag", ".vert", ".py", ".txt")
    names = [n for n in listed if n.endswith(ends) and (top / n).is_file()
             and n not in ("CHANGELOG.md", "tests/docs/citations.py")]
    texts = {n: (top / n).read_text() for n in names}
    references = texts["docs/references.md"]
    known = set(re.findall(r"^- \*\*\[(" + KEY + r")\]\*\*", references, re.M))
    sections = {
        page: set(re.findall(r"^## (\d+)\. ", texts[f"docs/{page}.md"], re.M)) for page in ("method", "classification")
    }
    faults, cited = [], set()
    for name, text in texts.items():
        keys = set()
        for inside in CITED.findall(text if name != "docs/references.md" else ""):
            keys.update(re.findall(KEY, inside))
        cited |= keys
        faults += [f"{name}: [{key}] is not in docs/references.md" for key in sorted(keys - known)]
        faults += [f"{name}: cites '{gone}', by no key" for gone in set(GONE.findall(text))]
        if name.endswith(".md"):
            for target in LINK.findall(text):
                page, _, anchor = target.partition("#")
                other = (top / name).parent / page if page else top / name
                if "://" in target:
                    continue
                if not other.exists():
                    faults.append(f"{name}: no file {target}")
                elif anchor and anchor not in headings(other.read_text()):
                    faults.append(f"{name}: no heading {target}")
        else:
            joined = re.sub(r"\n[ \t]*(?:///?|#|\*)[ \t]*", " ", text)
            for where in LOCATOR.finditer(joined if not keys else ""):
                faults.append(f"{name}: of which paper? {joined[max(0, where.start() - 40):where.end() + 20]}")
        for page, numbers in SECTION.findall(re.sub(r"\n[ \t]*(?:///?|#|\*)?[ \t]*", " ", text)):
            for number in re.findall(r"\d+", numbers):
                if number not in sections[page.lower()]:
                    faults.append(f"{name}: {page} §{number} is no section of docs/{page.lower()}.md")
    faults += [f"docs/references.md: nothing cites [{key}]" for key in sorted(known - cited)]
    print("\n".join(faults))
    print(f"{len(texts)} files, {len(cited)} works cited, {len(faults)} faults")
    return 1 if faults or not cited else 0


if __name__ == "__main__":
    sys.exit(main())
