// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "proxy/camera/camera.h"

namespace vestige {

/// Training pictures of a table of learned colours, at most.
inline constexpr int kMostTrainingPictures = 4;

/// How a table of learned colours came about.
struct LearnedOrigin {
  std::string from;    ///< the proxy that attenuation was made of: length, attenuation or sliced
  ImageSize size;      ///< of the training pictures
  double error = 0.0;  ///< root of the mean squared error of their colours
  friend bool operator==(const LearnedOrigin&, const LearnedOrigin&) = default;
};

/// {"error": e, "from": name, "size": [width, height]}; reading throws Format with the reason.
nlohmann::json toJson(const LearnedOrigin& origin);
LearnedOrigin learnedOriginFromJson(const nlohmann::json& json);

}  // namespace vestige
