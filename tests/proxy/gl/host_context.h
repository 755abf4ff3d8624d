// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

namespace vestige::gl {

/// A host program's own OSMesa context (compatibility profile, an 8x8 picture), current on the
/// thread that makes it, as a visualising solver would have one.
class HostOSMesa {
 public:
  HostOSMesa();
  ~HostOSMesa();
  void clear(float r, float g, float b);
  bool isCurrent() const;
  std::vector<float> clearColor() const;
  std::vector<unsigned char> pixel() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The same through EGL: a pbuffer surface on the surfaceless display.
class HostEgl {
 public:
  HostEgl();
  ~HostEgl();
  void clear(float r, float g, float b);
  bool isCurrent() const;
  std::vector<unsigned char> pixel() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vestige::gl
