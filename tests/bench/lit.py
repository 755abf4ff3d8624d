# SPDX-License-Identifier: BSD-3-Clause
"""lit_stripes_over_vtk_{0,oblique}: stripes on a lit smooth field, ours over VTK's.

Both draw the same matt ball under the same light (bench_lit, vtk_side.py), 5.3 pixels a cell. What
is wrong with the light of single cells repeats with the cells. So each picture is freed of what is
wider than a cell (a Gaussian of sigma one cell is subtracted), faded out by cos^2 from the middle
to 0.8 radii of the ball, and Fourier-transformed; power is summed over both image axes where the
frequency is 0.5 to 1.5 cycles a cell. The figure is the ratio of powers. Pictures are linear, in
steps of 1/8 of an 8-bit one, so that rounding does not hide what is compared.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy

from speed import HERE, Side, report

ANGLES = {"0": (0, 0), "oblique": (25, 20)}  # azimuth, elevation from +y, along the cells
STEPS = 8  # of a step of 8 bits


def smoothed(picture, sigma):
    """By a Gaussian; the picture goes on periodically, which the fading hides."""
    y, x = (numpy.fft.fftfreq(n) for n in picture.shape)
    keep = numpy.exp(-2 * (numpy.pi * sigma) ** 2 * (x[None, :] ** 2 + y[:, None] ** 2))
    return numpy.fft.ifft2(numpy.fft.fft2(picture) * keep).real


def middle(picture):
    height, width = picture.shape
    return picture[3 * height // 8:5 * height // 8, 3 * width // 8:5 * width // 8]


def stripes(picture, cell, radius):
    """Mean square of the stripes in the faded disk, in steps of 8 bits."""
    y, x = (numpy.arange(n) - 0.5 * (n - 1) for n in picture.shape)
    along = numpy.minimum(1, numpy.hypot(x[None, :], y[:, None]) / (0.8 * radius))
    fade = numpy.cos(0.5 * numpy.pi * along) ** 2
    spectrum = numpy.fft.fft2((picture - smoothed(picture, cell)) * fade)
    fy, fx = (numpy.fft.fftfreq(n) for n in picture.shape)
    cycles = cell * numpy.hypot(fx[None, :], fy[:, None])
    power = (numpy.abs(spectrum[(cycles >= 0.5) & (cycles <= 1.5)]) ** 2).sum()
    return 255 ** 2 * power / picture.size / (fade ** 2).sum()


def measure(binaries, angles, folder):
    azimuth, elevation = (str(angle) for angle in angles)
    subprocess.run([str(binaries / "bin" / "bench_lit"), str(folder), azimuth, elevation],
                   check=True)
    scene = json.loads((folder / "scene.json").read_text())
    they = Side(["xvfb-run", "-a", "/usr/bin/python3", str(HERE / "vtk_side.py"),
                 str(folder / "scene.json")])
    they.ask(f"fine {STEPS} {folder}/vtk.f32")
    they.close()
    powers, middles = [], []
    for name in ("ours", "vtk"):
        picture = numpy.fromfile(folder / f"{name}.f32", numpy.float32)
        picture = picture.reshape(scene["image"][::-1]).astype(float)
        picture = numpy.round(picture * 255 * STEPS) / (255 * STEPS)
        middles.append(middle(picture).mean())
        powers.append(stripes(picture, scene["pixelsPerCell"], scene["ballRadiusPixels"]))
        print(f"lit.py: {name} at {azimuth}, {elevation} degrees: stripes of "
              f"{powers[-1] ** 0.5:.4f} of 255 rms", file=sys.stderr)
    if abs(middles[0] - middles[1]) > 0.02:
        raise RuntimeError(f"the pictures are not of one light: {middles[0]:.3f}, {middles[1]:.3f}")
    return powers[0] / powers[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", help="not used: nothing here is random")
    parser.add_argument("lines", nargs="+")
    options = parser.parse_args()
    for name, angles in ANGLES.items():
        line = f"lit_stripes_over_vtk_{name}"
        if line in options.lines:
            with tempfile.TemporaryDirectory(prefix="vestige-bench-") as folder:
                report(line, measure(options.bin, angles, pathlib.Path(folder)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
