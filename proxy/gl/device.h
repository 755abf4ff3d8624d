// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace vestige::gl {

/// What a device is, for `doctor`, timings and provenance.
struct DeviceInfo {
  std::string backend;  ///< "osmesa" or "egl"
  std::string vendor, renderer, version;
  int threads = 0;       ///< of the software rasteriser; 0 = not known
  int maxTexture3D = 0;  ///< voxels a side, as a 3-D texture and as layers of 2-D ones

  /// Whether it draws on the processor's own cores.
  bool isSoftware() const;
};

/// A headless OpenGL 4.3+ core context on a thread of its own (docs/architecture.md, "Choices"):
/// every GL call is made inside `run`, with a clean floating-point environment, default affinity
/// and all signals blocked, so a host's floating-point traps, signal handlers, affinity and its own
/// current context neither touch us nor are touched.
class Device {
 public:
  /// OSMesa, opened at run time with dlopen. threads: of Mesa's software rasteriser, which keeps
  /// one pool per process and backend, so the first device decides; 0 = the environment's
  /// LP_NUM_THREADS, else one per processor. Throws NoGl with the reason and how to mend it.
  static std::shared_ptr<Device> createOSMesa(int threads = 0);
  /// EGL on the surfaceless platform (Mesa's software rasteriser, or a GPU).
  static std::shared_ptr<Device> createEgl(int threads = 0);
  /// "osmesa", "egl" or "auto" (the environment's VESTIGE_GL, else OSMesa, else EGL).
  static std::shared_ptr<Device> create(const std::string& backend = "auto", int threads = 0);

  virtual ~Device() = default;
  /// Runs `work` on the GL thread with the context current and waits for it; exceptions pass to
  /// the caller. Calls from several threads are served one after the other. Callable from the GL
  /// thread itself (runs at once).
  virtual void run(const std::function<void()>& work) = 0;
  virtual const DeviceInfo& info() const = 0;
};

}  // namespace vestige::gl
