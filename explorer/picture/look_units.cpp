// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/look_units.h"

#include "proxy/format/image/length_unit.h"

namespace vestige {

Look withScaledLengths(Look look, double factor) {
  if (look.slice) look.slice->w *= factor;
  if (look.clip) scaleLengths(*look.clip, factor);
  if (look.center) *look.center *= factor;
  if (look.referenceLength) *look.referenceLength *= factor;
  if (look.customization) scaleLengths(*look.customization, factor);
  return look;
}

}  // namespace vestige
