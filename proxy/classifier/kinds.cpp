// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/kinds.h"

#include <array>

namespace vestige {

std::span<const ClassifierKind> classifierKinds() {
  static constexpr std::array kKinds{ClassifierKind{"gaussian", 1, 4, readGaussian},
                                     ClassifierKind{"materials", 1, 1, readMaterials},
                                     ClassifierKind{"boundaries", 1, 1, readBoundaries},
                                     ClassifierKind{"color", 3, 3, readColor},
                                     ClassifierKind{"maximum", 1, 1, readMaximum}};
  return kKinds;
}

}  // namespace vestige
