// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "mini-sim/thermal_lattice.h"

namespace minisim {

/// Offers a running lattice to Vestige. insitu.cpp is the one place where solver and adaptor meet:
/// neither this header nor the rest of the solver knows of the adaptor.
template <typename Real>
class InSitu {
 public:
  struct Options {
    std::string config;  ///< path; "" = defaults
    std::string output;  ///< archive; "" = what the configuration says
    unsigned fields = kAllFields;
    double freeFallSpeed = 0.22;  ///< cells per step: makes units of the box
    /// Receives every sentence of the adaptor, each different one once. Whatever goes wrong, the
    /// simulation goes on.
    std::function<void(const std::string&)> report;
  };
  InSitu(const LatticeSettings& lattice, const Options& options);
  ~InSitu();

  /// True when this call stored the step.
  bool offer(const ThermalLattice<Real>& lattice);
  long storedSteps() const;
  /// Whether the configuration asks for figures only: no step is stored, whatever is counted.
  bool dryRun() const;

 private:
  struct Session;
  std::unique_ptr<Session> session_;
};

}  // namespace minisim
