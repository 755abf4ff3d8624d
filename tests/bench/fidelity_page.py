# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/fidelity.md and its plots from what `scripts/bench fidelity` measured."""
import html
import math
import re

import storage_plot

COLORS = {"flat": "#7f7f7f", "layered": "#2ca02c", "sliced": "#d62728", "sliced3": "#9467bd",
          "field": "#1f77b4"}
NAMES = {"flat": "flat (lengths)", "layered": "layered", "sliced": "sliced, one stack",
         "sliced3": "sliced, three stacks", "field": "reduced field"}
BUDGETS = (0.25, 0.5, 1, 2, 4, 8)
SCENE = "([a-z]+[0-9]*)"
# Settings of the sweep: they stand in the tables of rate and distortion, not in the first ones.
SWEEP = re.compile(r"_S\d+_q\d+|_\d+px")


class Setting:
    """One setting of one tier on one scene: bytes and what they buy."""

    def __init__(self, scene, name, figures):
        def value(line):
            return figures[line][0] if line in figures else math.nan

        self.scene, self.name = scene, name
        self.tier = name.split("_")[0]
        # The flat tier came first: its edits at 512 pixels have no tier in their names.
        # Three stacks answer an edit at a stored view as one does, at the bytes of three.
        edits = scene if name == "flat" else f"{scene}_{name.replace('sliced3', 'sliced')}"
        bytes_of = "novel_view" if self.tier == "layered" else "edit"
        self.percent = value(f"{bytes_of}_bytes_percent_{scene}_{name}")
        self.mean = value(f"edit_psnr_{edits}_mean")
        self.least = value(f"edit_psnr_{edits}_min")
        self.near = value(f"novel_view_dssim_{scene}_{name}_10")
        self.far = value(f"novel_view_dssim_{scene}_{name}_45")


def settings_of(figures):
    pattern = f"(?:edit|novel_view)_bytes_percent_{SCENE}_((?:{'|'.join(COLORS)})(?:_\\w+)?)"
    found = (re.fullmatch(pattern, name) for name in figures)
    return [Setting(m[1], m[2], figures) for m in found
            if m and not re.search(r"_L\d+$", m[2])]


def plot(title, unit, series, lower_is_better):
    """An SVG of figures over bytes in percent, both axes labelled; bytes are logarithmic."""
    points = [p for line in series.values() for p in line if math.isfinite(p[1])]
    if not points:
        return ""
    low, high = min(p[0] for p in points), max(p[0] for p in points)
    low, high = math.floor(math.log2(low)), math.ceil(math.log2(high) + 1e-9)
    high = max(high, low + 1)
    least, most = min(p[1] for p in points), max(p[1] for p in points)
    if lower_is_better:
        least = 0.0
    step = next(s for e in range(-4, 4) for s in (10.0 ** e, 2 * 10.0 ** e, 5 * 10.0 ** e)
                if (most - least) / s <= 8)
    least, most = math.floor(least / step) * step, math.ceil(most / step + 1e-9) * step
    width, height, left, top = 520, 300, 60, 30

    def x(percent):
        return left + (math.log2(percent) - low) / (high - low) * (width - left - 20)

    def y(value):
        return top + (most - value) / (most - least) * (height - top - 45)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
           'font-family="sans-serif" font-size="11">',
           f'<rect width="{width}" height="{height}" fill="white"/>',
           f'<text x="{left}" y="16" font-size="13">{html.escape(title)}</text>',
           f'<text x="{width / 2}" y="{height - 6}" text-anchor="middle">bytes, % of the field</text>',
           f'<text x="12" y="{height / 2}" text-anchor="middle" '
           f'transform="rotate(-90 12 {height / 2})">{unit}</text>']
    for power in range(low, high + 1):
        at = x(2.0 ** power)
        out.append(f'<path d="M{at:.1f} {top}V{height - 45}" stroke="#ddd"/>'
                   f'<text x="{at:.1f}" y="{height - 30}" text-anchor="middle">{2.0 ** power:g}'
                   '</text>')
    for i in range(round((most - least) / step) + 1):
        value = least + i * step
        out.append(f'<path d="M{left} {y(value):.1f}H{width - 20}" stroke="#ddd"/>'
                   f'<text x="{left - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>')
    for row, (tier, line) in enumerate(series.items()):
        color = COLORS[tier]
        inside = [p for p in sorted(line) if math.isfinite(p[1])]
        best = frontier(inside, lower_is_better)
        if len(best) > 1:
            path = "L".join(f"{x(p[0]):.1f} {y(p[1]):.1f}" for p in best)
            out.append(f'<path d="M{path}" fill="none" stroke="{color}" stroke-width="1.5"/>')
        out += [f'<circle cx="{x(p[0]):.1f}" cy="{y(p[1]):.1f}" r="3" stroke="{color}" '
                f'fill="{color if p in best else "white"}"><title>{html.escape(p[2])}</title></circle>'
                for p in inside]
        legend = top + 12 + 14 * row if lower_is_better else height - 60 - 14 * row
        out.append(f'<circle cx="{width - 160}" cy="{legend - 4}" r="3" fill="{color}"/>'
                   f'<text x="{width - 150}" y="{legend}">{NAMES[tier]}</text>')
    out.append("</svg>\n")
    return "\n".join(out)


def frontier(points, lower_is_better):
    """Of (bytes, figure, setting), those that no other beats in both."""
    best, kept = None, []
    for point in sorted(points):
        if best is None or (point[1] < best if lower_is_better else point[1] > best):
            best = point[1]
            kept.append(point)
    return kept


def winners(curves, figure, lower_is_better):
    """For each budget the tier and setting that is best within it."""
    cells = []
    for budget in BUDGETS:
        within = [c for c in curves if c.percent <= budget and math.isfinite(getattr(c, figure))]
        if not within:
            cells.append("-")
            continue
        best = (min if lower_is_better else max)(within, key=lambda c: getattr(c, figure))
        value = getattr(best, figure)
        cells.append(f"{best.name}: " +
                     (f"{value:.3f}" if lower_is_better else f"{value:.1f}"))
    return cells


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows] + [""]


def measured(figures, name, form):
    if name not in figures or math.isnan(figures[name][0]):
        return "-"
    value, _, goal, outcome = figures[name]
    text = form.format(value)
    return f"**{text}** ({goal} missed)" if goal != "-" and outcome == "miss" else text


def spelled(name):
    tier, _, setting = name.partition("_")
    return NAMES[tier] + (f", {setting}" if setting else "")


def edit_rows(figures):
    pattern = f"edit_psnr_{SCENE}_((?:sliced|field)[a-z0-9_]*?)_mean(\\w*)"
    found = [m.groups() for m in (re.fullmatch(pattern, n) for n in figures) if m]
    rows = []
    for scene, name, suffix in found:
        size = re.search(r"_L\d+$", suffix)
        rows.append([scene, spelled(name), suffix.strip("_").replace("_", ", ") or "constant",
                     measured(figures, f"edit_psnr_{scene}_{name}_mean{suffix}", "{:.1f}"),
                     measured(figures, f"edit_psnr_{scene}_{name}_min{suffix}", "{:.1f}"),
                     measured(figures, f"edit_bytes_percent_{scene}_{name}" +
                              (size[0] if size else ""), "{:.2f}")])
    return rows


def novel_rows(figures):
    pattern = f"novel_view_dssim_{SCENE}_((?:layered|sliced|field)\\w*?)_(\\d+)"
    found = dict.fromkeys(m.groups()[:2] for m in (re.fullmatch(pattern, n) for n in figures)
                          if m and not SWEEP.search(m[2]))
    angles = (5, 10, 15, 30, 45, 60, 90)
    return [[scene, spelled(name)] +
            [measured(figures, f"novel_view_dssim_{scene}_{name}_{a}", "{:.4f}") for a in angles]
            for scene, name in found]


def other_rows(figures):
    skip = re.compile(r"edit_psnr_\w+_(sliced|field)|edit_bytes_|novel_view_dssim_\w+_\d+$"
                      r"|learned_error_|ao_|enhance_|flat_storage_")
    return [[f"`{name}`", f"{value:.4g}", unit, goal, outcome]
            for name, (value, unit, goal, outcome) in figures.items()
            if not skip.match(name) and not math.isnan(value)]


def learned_section(figures):
    scenes = dict.fromkeys(m[1] for m in (re.match(r"learned_error_([a-z]+)_", n) for n in figures)
                           if m)
    if not scenes:
        return []
    columns = ("K1", "K8", "K24", "K48", "T1", "T2", "T3", "function")
    rows = [[scene] + [measured(figures, f"learned_error_{scene}_{c}", "{:.2e}") for c in columns]
            for scene in scenes]
    return ["## Learned colours", "",
            "Mean squared error of lit pictures (headlight) under opacities that no training picture had:",
            "four groups of values, each at a random share of its opacity. `K`: clusters, from three",
            "training pictures; `T`: training pictures, 24 clusters; `function`: the transfer function's",
            "own colours, without light. Attenuation is recomposed from lengths; 256², 16 intervals.", "",
            *table(["scene", *columns], rows)]


def effects_section(figures):
    rows = []
    for what, ours, theirs in (("ao", "proxy", "mask"), ("enhance", "attenuation", "image")):
        for scene in dict.fromkeys(m[1] for m in (re.match(what + r"_([a-z]+)_", n)
                                                  for n in figures) if m):
            rows.append([{"ao": "ambient occlusion", "enhance": "enhancement"}[what], scene] +
                        [measured(figures, f"{what}_{scene}_{way}", "{:.3f}")
                         for way in (ours, theirs)])
    if not rows:
        return []
    return ["## What stands in for light", "",
            "Correlation with the raw field's own light: ambient occlusion from depth layers, and the best",
            "isotropic unsharp mask of depth, with the share of the hemisphere that the isosurface covers;",
            "depth-aware enhancement (gradients of attenuation), and the gradient of the picture, with how",
            "much a headlight darkens a pixel.", "",
            *table(["effect", "scene", "from the proxy", "from the picture"], rows)]


def write(docs, figures, seeds, lines):
    """`figures` {name: (value, unit, goal, outcome)}; `lines`: how many there would be."""
    settings = settings_of(figures)
    images = docs / "images"
    images.mkdir(exist_ok=True)
    text = ["# Fidelity", "",
            "```sh", "scripts/bench fidelity        # measures everything on this page and writes it",
            "```", "",
            "Every figure compares with the raw field rendered on the CPU (`tests/support`), linear RGB",
            "over black inside the box's projection, as [method.md](method.md) defines PSNR and DSSIM =",
            f"(1 - SSIM) / 2. Random transfer functions, seeds {seeds}. Bytes are files on disk as a share",
            "of the field in its own type. A goal that is missed is set in bold.",
            f"{sum(not math.isnan(f[0]) for f in figures.values())} of {lines} lines were measured for this version.", ""]
    text += ["## Edited pictures at the stored view", "",
             "PSNR in dB. `constant`: transfer functions that are constant on each interval;",
             "`continuous`: the same bumps as functions of the value.", ""]
    text += table(["scene", "tier", "functions", "mean", "min", "bytes, %"], edit_rows(figures))
    text += ["## Novel views", "", "DSSIM by degrees from the stored view.", ""]
    text += table(["scene", "tier", "5", "10", "15", "30", "45", "60", "90"], novel_rows(figures))
    text += learned_section(figures) + effects_section(figures)
    text += storage_plot.section(figures, images)
    if others := other_rows(figures):
        text += ["## Other figures", ""]
        text += table(["line", "value", "unit", "goal", ""], others)
    if settings:
        text += ["## Rate and distortion", "",
                 "Each point is one setting of a tier (hover for it); lines join those that no other",
                 "setting of the tier beats, the rest is hollow. Edits: mean PSNR at the stored view; `flat` in pictures of",
                 "512² or 256² pixels. Novel views: mean DSSIM at 45 degrees; a single stack is seen from",
                 "its side there, three stacks and the field serve the whole sphere. Layers hold one",
                 "look of their own (`tests/bench/layered_scenes.h`), the others any of the random ones.",
                 "`sliced_S12_q16`: 12 slabs, 16 levels; without a suffix 20 and 32. `field`: within 1/16",
                 "of the range, `loose` 1/8, `tight` 1/128, `half` and `quarter` downsampled. The lines of",
                 "`smooth512` are of 512³ samples and 256² pixels.", ""]
    for scene in dict.fromkeys(c.scene for c in settings):
        mine = [c for c in settings if c.scene == scene]
        text += [f"### {scene}", ""]
        for what, figure, unit, lower in (("edits", "mean", "PSNR, dB", False),
                                          ("novel views", "far", "DSSIM at 45°", True)):
            series = {}
            for c in mine:
                value = getattr(c, figure)
                if math.isfinite(value) and math.isfinite(c.percent):
                    series.setdefault(c.tier, []).append((c.percent, value, c.name))
            if svg := plot(f"{scene}: {what}", unit, series, lower):
                name = f"fidelity_{scene}_{figure}.svg"
                (images / name).write_text(svg)
                text.append(f"![{scene}: {what}](images/{name})")
        text += ["", "Every setting:", ""]
        text += table(["setting", "bytes, %", "edits: mean, dB", "min, dB", "10°, DSSIM",
                       "45°, DSSIM"],
                      [[c.name] + ["-" if math.isnan(v) else f"{v:.{digits}f}" for v, digits in
                                   ((c.percent, 2), (c.mean, 1), (c.least, 1), (c.near, 4),
                                    (c.far, 4))]
                       for c in sorted(mine, key=lambda c: c.percent)
                       if not math.isnan(c.percent)])
        text += ["The best within a budget of bytes:", ""]
        text += table(["bytes, %"] + [f"{b:g}" for b in BUDGETS],
                      [["edits, dB"] + winners(mine, "mean", False),
                       ["10°, DSSIM"] + winners(mine, "near", True),
                       ["45°, DSSIM"] + winners(mine, "far", True)])
    (docs / "fidelity.md").write_text("\n".join(text).rstrip() + "\n")
