# SPDX-License-Identifier: BSD-3-Clause
"""The storage part of docs/fidelity.md: bytes and seconds of flat proxies [Tikhonova 2010, Fig. 15]."""
import math
import re

COLORS = {512: "#1f77b4", 1024: "#2ca02c", 2048: "#d62728"}
SIDES = (128, 256, 512, 1024, 2048, 4096)  # of volumes
LINE = re.compile(r"flat_storage_([a-z]+)(\d+)_(\d+)_(\d+)")


def measured(figures):
    """[(scene, side of the volume, side of the pictures, proxies, bytes, seconds)]"""
    rows = []
    for name, (value, *_) in figures.items():
        if (m := LINE.fullmatch(name)) and not math.isnan(value):
            seconds = figures.get(name.replace("storage_", "storage_seconds_"), (math.nan,))[0]
            rows.append((m[1], *map(int, m.groups()[1:]), value, seconds))
    return rows


def plot(rows):
    width, height, left, top, low, high = 560, 330, 60, 30, 4, 12  # decades of bytes

    def x(side):
        return left + (math.log2(side) - 7) / 5 * (width - left - 130)

    def y(size):
        return top + (high - math.log10(size)) / (high - low) * (height - top - 45)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
           'font-family="sans-serif" font-size="11">',
           f'<rect width="{width}" height="{height}" fill="white"/>',
           f'<text x="{left}" y="16" font-size="13">Bytes of a step: the field, and flat proxies'
           '</text>',
           f'<text x="{x(724)}" y="{height - 6}" text-anchor="middle">samples along a side</text>']
    for side in SIDES:
        out.append(f'<path d="M{x(side):.1f} {top}V{height - 45}" stroke="#ddd"/>'
                   f'<text x="{x(side):.1f}" y="{height - 30}" text-anchor="middle">{side}</text>')
    for power in range(low, high + 1):
        name = {4: "10 kB", 5: "100 kB", 6: "1 MB", 7: "10 MB", 8: "100 MB", 9: "1 GB",
                10: "10 GB", 11: "100 GB", 12: "1 TB"}[power]
        out.append(f'<path d="M{left} {y(10.0 ** power):.1f}H{x(4096):.1f}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{y(10.0 ** power) + 4:.1f}" text-anchor="end">{name}'
                   '</text>')
    raw = [(x(side), y(4.0 * side ** 3)) for side in SIDES]
    for points, dash in ((raw[:3], ""), (raw[2:], ' stroke-dasharray="4 3"')):
        path = "L".join(f"{a:.1f} {b:.1f}" for a, b in points)
        out.append(f'<path d="M{path}" fill="none" stroke="#000" stroke-width="1.5"{dash}/>')
    out.append(f'<text x="{x(4096) + 6:.1f}" y="{raw[-1][1] + 4:.1f}">float32 (dashed: 4 N³)</text>')
    for side, color in COLORS.items():
        lines = {}
        for scene, volume, pixels, proxies, size, _ in rows:
            if pixels == side:
                lines.setdefault((scene, proxies), []).append((volume, size))
        for (scene, proxies), points in lines.items():
            points.sort()
            title = f"{proxies} proxies of {side}², {scene}"
            path = "L".join(f"{x(v):.1f} {y(s):.1f}" for v, s in points)
            out.append(f'<path d="M{path}" fill="none" stroke="{color}"/>')
            out += [f'<circle cx="{x(v):.1f}" cy="{y(s):.1f}" r="3" fill="{color}">'
                    f'<title>{title}: {s / 1e6:.2f} MB</title></circle>' for v, s in points]
        if lines:
            row = list(COLORS).index(side)
            out.append(f'<circle cx="{x(4096) + 12:.1f}" cy="{180 + 14 * row}" r="3" '
                       f'fill="{color}"/><text x="{x(4096) + 20:.1f}" y="{184 + 14 * row}">'
                       f'{side}² pixels</text>')
    out.append("</svg>\n")
    return "\n".join(out)


def section(figures, images):
    """Lines of the page; the plot goes to the folder `images`. Nothing measured: nothing."""
    rows = measured(figures)
    if not rows:
        return []
    (images / "flat_storage.svg").write_text(plot(rows))
    lines = ["## Storage and cost of flat proxies", "",
             "Attenuation in n intervals, one picture each, of one view: bytes of the file, and seconds of",
             "marching and encoding on this machine. Proxies follow pixels and content, the field its samples:",
             "4 N³ bytes, measured up to 512³ and arithmetic beyond, where nothing was run.", "",
             "![bytes of flat proxies and of fields](images/flat_storage.svg)", "",
             "| field | pixels | n | bytes | % of the field | seconds |", "|---|---|---|---|---|---|"]
    for scene, volume, pixels, proxies, size, seconds in rows:
        took = "-" if math.isnan(seconds) else f"{seconds:.2f}"
        lines.append(f"| {scene} {volume}³ | {pixels}² | {proxies} | {size / 1e6:.2f} MB | "
                     f"{100 * size / (4 * volume ** 3):.2f} | {took} |")
    sizes = [row for row in rows if row[1] == 256 and row[2] >= 512]
    if sizes:
        most = max(sizes, key=lambda row: row[4])
        lines += ["", f"The most that was measured, {most[3]} proxies of {most[2]}² pixels "
                  f"({most[4] / 1e6:.0f} MB), would be",
                  ", ".join(f"{100 * most[4] / (4 * side ** 3):.2g} % of {side}³"
                            for side in SIDES[3:]) + " in float32, by this arithmetic."]
    return lines + [""]
