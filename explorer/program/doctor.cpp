// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/program/doctor.h"

#include <fmt/format.h>
#include <ft2build.h>

#include <cmath>
#include <cstdlib>
#include <optional>
#include <thread>
#include FT_FREETYPE_H

#include "explorer/annotation/text.h"
#include "explorer/export/subprocess.h"
#include "explorer/recomposition/edit_pass.h"
#include "proxy/base/error.h"
#include "proxy/gl/device.h"
#include "proxy/version.h"

namespace vestige {
namespace {

/// Recomposes one picture of two known layers; returns the largest difference from the formula.
double selfTest(gl::Device& device) {
  constexpr int kSide = 8;
  SegmentLists lists;
  lists.size = {kSide, kSide};
  for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
    lists.first.push_back(2 * i);
    lists.entries.push_back(amountBits(0.5f));
    lists.entries.push_back(amountBits(float(i) / 32.0f) | 1u << 16 | SegmentLists::kLast);
  }
  const ChannelTable table{{1.0, 2.0}, {glm::dvec3(1.0, 0.0, 0.0), glm::dvec3(0.0, 1.0, 0.5)}};
  Picture picture;
  device.run([&] {
    EditPass pass;
    picture = pass.render(SegmentTextures(lists), table);
  });
  double worst = 0.0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double front = 1.0 - std::exp(-0.5), back = 1.0 - std::exp(-2.0 * i / 32.0);
    const double expected[4] = {front, (1.0 - front) * back, 0.5 * (1.0 - front) * back,
                                1.0 - (1.0 - front) * (1.0 - back)};
    for (int c = 0; c < 4; ++c) {
      worst = std::max(worst, std::abs(expected[c] - double(picture.rgba[std::size_t(4 * i + c)])));
    }
  }
  return worst;
}

Diagnosis diagnoseBackend(const std::string& backend) {
  Diagnosis diagnosis;
  diagnosis.name = backend == "osmesa" ? "OSMesa" : "EGL";
  try {
    const auto device = backend == "osmesa" ? gl::Device::createOSMesa() : gl::Device::createEgl();
    const gl::DeviceInfo& info = device->info();
    const double worst = selfTest(*device);
    diagnosis.works = worst < 1e-3;
    diagnosis.finding = fmt::format(
        "{}, OpenGL {}, {} threads, self-test picture {} (largest error {:.1e})", info.renderer,
        info.version, info.threads > 0 ? fmt::format("{}", info.threads) : std::string("unknown"),
        diagnosis.works ? "right" : "WRONG", worst);
    if (!diagnosis.works) diagnosis.mend = "use the other backend (VESTIGE_GL) or another Mesa";
  } catch (const Error& error) {
    diagnosis.finding = error.what();
    diagnosis.mend = backend == "osmesa" ? "apt-get install libosmesa6"
                                         : "apt-get install libegl1 libgl1-mesa-dri";
  }
  return diagnosis;
}

Diagnosis diagnoseFont() {
  Diagnosis diagnosis{"font", false, false, "", ""};
  try {
    const double width = Font(16).width("0.5");
    diagnosis.works = width > 0.0;
    diagnosis.finding = fmt::format("{}, FreeType {}.{}.{}", findFont().string(), FREETYPE_MAJOR,
                                    FREETYPE_MINOR, FREETYPE_PATCH);
  } catch (const Error& error) {
    diagnosis.finding = error.what();
  }
  if (!diagnosis.works) diagnosis.mend = "apt-get install fonts-dejavu-core";
  return diagnosis;
}

Diagnosis diagnoseFfmpeg() {
  Diagnosis diagnosis{"ffmpeg", false, false, "", ""};
  try {
    const std::string text = Subprocess({"ffmpeg", "-nostdin", "-version"}).finish();
    diagnosis.works = true;
    diagnosis.finding = text.substr(0, text.find(" Copyright"));
    if (text.find("--enable-libx264") == std::string::npos) {
      diagnosis.finding += ", without libx264: .mp4 will fail, .webm may work";
    }
  } catch (const Error& error) {
    diagnosis.finding = error.what();
    diagnosis.mend = "apt-get install ffmpeg (movies only)";
  }
  return diagnosis;
}

}  // namespace

std::vector<Diagnosis> diagnose() {
  std::vector<Diagnosis> all;
  const char* choice = std::getenv("VESTIGE_GL");
  all.push_back({"vestige", true, false,
                 fmt::format("{}, VESTIGE_GL {}", kVersion,
                             choice && *choice ? fmt::format("'{}'", choice) : "not set"),
                 ""});
  all.push_back(
      {"threads", true, false, fmt::format("{}", std::thread::hardware_concurrency()), ""});
  Diagnosis osmesa = diagnoseBackend("osmesa"), egl = diagnoseBackend("egl");
  osmesa.needed = !egl.works;
  egl.needed = !osmesa.works;
  all.push_back(std::move(osmesa));
  all.push_back(std::move(egl));
  all.push_back(diagnoseFont());
  all.push_back(diagnoseFfmpeg());
  return all;
}

}  // namespace vestige
