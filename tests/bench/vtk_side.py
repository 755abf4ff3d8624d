# SPDX-License-Identifier: BSD-3-Clause
"""What VTK needs for the same work: the other side of the benches' ratios.

Run under xvfb-run as `vtk_side.py SCENE.json`. Reads commands from standard input, one a line, and
answers each with one line of figures separated by tabs:
  render   one picture of the scene after an edit of its opacity (seconds)
  fresh    the same when the data are new to the mapper, as in situ (seconds)
  write F  the field as F.vti by vtkXMLImageDataWriter with zlib (seconds, bytes)
  save F   the last picture as a PNG file F (no figure)
  fine N F red of the lit picture in steps of 1/N of its 8 bits, as F of float32 from the top (mean)
The mapper is vtkFixedPointVolumeRayCastMapper: shading off, one sample a voxel, linear
interpolation, every pixel, `threads` threads. With `light` it is vtkGPUVolumeRayCastMapper, whose
gradients are not of few bits: shading on, without gloss, four samples a voxel, no jitter.

SCENE.json: volume (file of float32, x fastest), size, spacing, origin (of the first sample), image
[w, h], camera {position, forward, up, viewHeight, nearDepth, farDepth} (orthographic), opacity
[[value, opacity per referenceLength]], colors [[value, r, g, b]], referenceLength, threads; if it
is lit, light {ambient, diffuse, toward}, `toward` the light in eye space (x right, y up).
"""
import json
import os
import sys
import time

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkLight, vtkRenderer,
                                         vtkRenderWindow, vtkVolume, vtkVolumeProperty,
                                         vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolume import (vtkFixedPointVolumeRayCastMapper,
                                           vtkGPUVolumeRayCastMapper)
import vtkmodules.vtkInteractionStyle  # noqa: F401  (registers factories)
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401


def image_data(scene):
    values = numpy.fromfile(scene["volume"], dtype=numpy.float32)
    if values.size != numpy.prod(scene["size"]):
        sys.exit(f"{scene['volume']} has {values.size} values, the scene says {scene['size']}")
    image = vtkImageData()
    image.SetDimensions(*scene["size"])
    image.SetSpacing(*scene["spacing"])
    image.SetOrigin(*scene["origin"])
    array = numpy_to_vtk(values, deep=False)
    array.SetName("field")
    image.GetPointData().SetScalars(array)
    return image, values  # numpy's memory must live as long as VTK looks at it


def volume_property(scene):
    color = vtkColorTransferFunction()
    for value, r, g, b in scene["colors"]:
        color.AddRGBPoint(value, r, g, b)
    result = vtkVolumeProperty()
    result.SetColor(color)
    result.SetScalarOpacityUnitDistance(scene["referenceLength"])
    result.SetInterpolationTypeToLinear()
    result.ShadeOff()
    if "light" in scene:
        result.ShadeOn()
        result.SetAmbient(scene["light"]["ambient"])
        result.SetDiffuse(scene["light"]["diffuse"])
        result.SetSpecular(0.0)
    return result


def set_opacity(property_, scene, factor):
    opacity = vtkPiecewiseFunction()
    for value, alpha in scene["opacity"]:
        opacity.AddPoint(value, min(1.0, factor * alpha))
    property_.SetScalarOpacity(opacity)


def volume_mapper(scene):
    voxel = min(scene["spacing"])
    if "light" in scene:
        mapper = vtkGPUVolumeRayCastMapper()
        mapper.UseJitteringOff()
        mapper.SetSampleDistance(0.25 * voxel)
    else:
        mapper = vtkFixedPointVolumeRayCastMapper()
        mapper.IntermixIntersectingGeometryOff()
        mapper.SetSampleDistance(voxel)
        mapper.SetNumberOfThreads(scene["threads"])
    mapper.SetBlendModeToComposite()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.SetImageSampleDistance(1.0)
    return mapper


def shine(renderer, toward):
    light = vtkLight()
    light.SetLightTypeToCameraLight()
    light.SetPosition(*toward)
    light.SetFocalPoint(0.0, 0.0, 0.0)
    light.SetAmbientColor(1.0, 1.0, 1.0)  # black unless told so: no ambient light
    renderer.AutomaticLightCreationOff()
    renderer.AddLight(light)


def render_window(scene, image, property_):
    mapper = volume_mapper(scene)
    mapper.SetInputData(image)
    volume = vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(property_)
    renderer = vtkRenderer()
    renderer.SetBackground(0.0, 0.0, 0.0)
    renderer.AddVolume(volume)
    if "light" in scene:
        shine(renderer, scene["light"]["toward"])
    stored, camera = scene["camera"], renderer.GetActiveCamera()
    position, forward = numpy.array(stored["position"]), numpy.array(stored["forward"])
    camera.ParallelProjectionOn()
    camera.SetPosition(*position)
    camera.SetFocalPoint(*(position + forward * stored["farDepth"]))
    camera.SetViewUp(*stored["up"])
    camera.SetParallelScale(0.5 * stored["viewHeight"])
    camera.SetClippingRange(max(stored["nearDepth"], 1e-3 * stored["farDepth"]),
                            stored["farDepth"])
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*scene["image"])
    window.AddRenderer(renderer)
    return window


def timed(action):
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def write_vti(image, path):
    writer = vtkXMLImageDataWriter()
    writer.SetInputData(image)
    writer.SetFileName(path)
    writer.SetCompressorTypeToZLib()
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    if writer.Write() != 1:
        raise OSError(f"VTK could not write {path}")
    descriptor = os.open(path, os.O_RDONLY)
    os.fsync(descriptor)
    os.close(descriptor)


def window_image(window):
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    return grab


def write_fine(window, property_, scene, steps, path):
    """The mean of pictures under a little more ambient light each, which are rounded elsewhere."""
    width, height = scene["image"]
    total = numpy.zeros((height, width))
    for step in range(steps):
        more = ((step + 0.5) / steps - 0.5) / 255
        property_.SetAmbient(scene["light"]["ambient"] + more)
        window.Render()
        grab = window_image(window)
        grab.Update()
        colors = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        total += colors[:, 0].reshape(height, width)[::-1]
    mean = (total / (255 * steps)).astype(numpy.float32)
    mean.tofile(path)
    return mean.mean()


def save_png(window, path):
    grab = window_image(window)
    writer = vtkPNGWriter()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(path)
    writer.Write()


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        scene = json.load(file)
    image, _values = image_data(scene)
    property_ = volume_property(scene)
    set_opacity(property_, scene, 1.0)
    window = render_window(scene, image, property_)
    window.Render()  # opens the window and compiles its programs; no figure includes it
    edits = 0
    print("ready", flush=True)
    for line in sys.stdin:
        command, _, argument = line.strip().partition(" ")
        if command == "render":
            edits += 1
            set_opacity(property_, scene, 1.0 - 1e-3 * (edits % 2))
            print(timed(window.Render), flush=True)
        elif command == "fresh":
            image.GetPointData().GetScalars().Modified()
            image.Modified()
            print(timed(window.Render), flush=True)
        elif command == "write":
            seconds = timed(lambda: write_vti(image, argument))
            print(seconds, os.path.getsize(argument), sep="\t", flush=True)
        elif command == "save":
            save_png(window, argument)
            print("saved", flush=True)
        elif command == "fine":
            steps, path = argument.split(" ", 1)
            print(write_fine(window, property_, scene, int(steps), path), flush=True)
        else:
            sys.exit(f"unknown command {line!r}")


if __name__ == "__main__":
    main()
