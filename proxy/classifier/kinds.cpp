// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/kinds.h"

#include <array>

namespace vestige {

std::span<const ClassifierKind> classifierKinds() {
  static constexpr std::array kKinds{ClassifierKind{"gaussian", 1, 4, readGaussian}};
  return kKinds;
}

}  // namespace vestige
