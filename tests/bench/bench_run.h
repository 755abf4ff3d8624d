// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "adaptor/march/marcher.h"
#include "proxy/gl/device.h"
#include "tests/bench/bench_options.h"
#include "tests/support/scenes.h"

namespace vestige::test {

/// Uploads a whole scene as the adaptor does.
inline void uploadScene(Marcher& marcher, const Scene& scene, const IntervalPartition& partition) {
  const double low = partition.low(), range = partition.high() - low;
  const auto plane = std::size_t(scene.size[0]) * std::size_t(scene.size[1]);
  marcher.upload(scene.block(), [&](int z0, int z1, float* out) {
    for (std::size_t i = std::size_t(z0) * plane; i < std::size_t(z1) * plane; ++i) {
      *out++ = float((double(scene.values[i]) - low) / range);
    }
  });
}

/// A whole scene, marched on the GPU as the adaptor does.
inline RayImage marchOnGpu(Marcher& marcher, const Scene& scene, const MarchRequest& request) {
  uploadScene(marcher, scene, request.partition);
  return marcher.march(request);
}

/// The main function of a bench: work(options, device); errors end it with one line and 1.
template <typename Work>
int runBench(const char* name, int argc, char** argv, const Work& work) {
  try {
    const BenchOptions options(argc, argv);
    const std::shared_ptr<gl::Device> device = gl::Device::create("auto");
    work(options, device);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
  return 0;
}

}  // namespace vestige::test
