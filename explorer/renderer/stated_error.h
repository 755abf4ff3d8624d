// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// What a look asks of a proxy.
struct Asked {
  bool turned = false;  ///< another camera than the stored one
  bool edited = false;  ///< other opacity, colour or light than the run's base
};

/// How far a picture of a proxy may be from the run's field, by what is stored alone: the explorer
/// answers with the tier whose stated error is least. Shares: 0 = exact, 1 = anything.
struct StatedError {
  bool bounded = true;  ///< else something of the field may be missing altogether
  double value = 0.0;   ///< of a value, as a share of the field's range at the step
  double place = 0.0;   ///< of where along the view a value lies, as a share of the domain's depth

  double sum() const { return value + place; }
  /// Bounded ones first, then by sum.
  bool truerThan(const StatedError& other) const {
    return bounded != other.bounded ? bounded : sum() < other.sum();
  }
  /// "values within 6.25 % of the range, places within 5 % of the depth"
  std::string text() const;
};

/// From the header of any kind of proxy:
///   field      the tolerance, in its place; averaged samples: unbounded, as what is
///              smaller than they are is gone
///   sliced     the widest interval that any value lies in; a slab's thickness, whatever the
///              distance of the run's samples: what turns more than twice in a slab may lie
///              anywhere in it
///   length     the same interval; the order along the ray is not stored: place = 1. Turned:
///              unbounded, as what the layers hide is not stored
///   attenuation, depth, mip   unbounded
///   layered    exact unedited and unturned; turned: unbounded, nothing behind saturated rays;
///              edited: unbounded, opacity and colour are baked in
///   reference  exact unedited and unturned, else unbounded
StatedError statedError(const ProxyHeader& header, const Asked& asked);

/// How far a sample of about `value` may be from the run's, in the field's units, and why: the
/// tolerance of a field, the width of the interval of a stack.
struct SampleError {
  double error = 0.0;
  std::string why;  ///< "its interval in the stacks, 280 to 290.6"
};
SampleError sampleError(const ProxyHeader& header, double value);

}  // namespace vestige
