// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/insitu.h"

#include <set>
#include <string_view>
#include <type_traits>

#include "adaptor/include/vestige.h"

namespace minisim {

template <typename Real>
struct InSitu<Real>::Session {
  Options options;
  double height = 1.0;
  vestige_session* vestige = nullptr;
  Fields<Real> fields;
  std::set<std::string> said;
  bool dryRun = false;

  void say(const std::string& sentence) {
    if (options.report && said.insert(sentence).second) options.report(sentence);
  }
  bool fine(int code) {
    if (code == VESTIGE_OK) return true;
    say(std::string("vestige: ") + vestige_last_error(vestige) + " (" + vestige_code_name(code) +
        ")");
    return false;
  }
  void scale(std::vector<Real>& values, double factor) {
    for (Real& value : values) value *= Real(factor);
  }
};

template <typename Real>
InSitu<Real>::InSitu(const LatticeSettings& lattice, const Options& options)
    : session_(std::make_unique<Session>()) {
  Session& s = *session_;
  s.options = options;
  s.height = lattice.size[2];

  vestige_options open = VESTIGE_OPTIONS_INIT;
  open.config = options.config.empty() ? nullptr : options.config.c_str();
  open.output = options.output.empty() ? nullptr : options.output.c_str();
  open.log_data = &s;
  open.log = [](int level, const char* sentence, void* self) {
    // Errors come as codes; of what is only said, the figures of a dry run are its result.
    Session& session = *static_cast<Session*>(self);
    const std::string_view text(sentence);
    const bool info = level == VESTIGE_INFO;
    if (info && text.find(" writes nothing (dry run) ") != text.npos) session.dryRun = true;
    if (level == VESTIGE_WARNING || (info && text.starts_with("dry run")))
      session.say(std::string("vestige: ") + sentence);
  };
  if (!s.fine(vestige_open(&open, &s.vestige))) return;

  // The box is 1 high and stands on z = 0; values live in its cells.
  vestige_grid grid = VESTIGE_GRID_INIT;
  for (int axis = 0; axis < 3; ++axis) {
    grid.points[axis] = lattice.size[axis] + 1;
    grid.spacing[axis] = 1.0 / s.height;
    grid.origin[axis] = axis == 2 ? 0.0 : -0.5 * lattice.size[axis] / s.height;
  }
  s.fine(vestige_block(s.vestige, 0, &grid));
}

template <typename Real>
InSitu<Real>::~InSitu() {
  vestige_close(session_->vestige);
}

template <typename Real>
bool InSitu<Real>::offer(const ThermalLattice<Real>& lattice) {
  Session& s = *session_;
  const double timePerStep = s.options.freeFallSpeed / s.height;
  const long cycle = lattice.stepsDone();
  const double time = cycle * timePerStep;
  if (!vestige_wants(s.vestige, cycle, time)) return false;

  lattice.gather(s.options.fields, s.fields);
  for (auto& component : s.fields.velocity) s.scale(component, 1.0 / s.options.freeFallSpeed);
  s.scale(s.fields.vorticity, 1.0 / timePerStep);

  constexpr int type = std::is_same_v<Real, float> ? VESTIGE_FLOAT32 : VESTIGE_FLOAT64;
  const auto share = [&](const char* name, const std::vector<Real>& values) {
    return values.empty() || s.fine(vestige_share_field(s.vestige, 0, name, type, VESTIGE_CELL, 1,
                                                        values.data(), nullptr));
  };
  const void* velocity[] = {s.fields.velocity[0].data(), s.fields.velocity[1].data(),
                            s.fields.velocity[2].data()};
  const bool shared = share("temperature", s.fields.temperature) &&
                      share("density", s.fields.density) &&
                      share("vorticity", s.fields.vorticity) &&
                      (!(s.options.fields & kVelocity) ||
                       s.fine(vestige_share_components(s.vestige, 0, "velocity", type, VESTIGE_CELL,
                                                       3, velocity, nullptr)));
  if (!shared) return false;
  const long before = storedSteps();
  return s.fine(vestige_execute(s.vestige, cycle, time)) && storedSteps() > before;
}

template <typename Real>
long InSitu<Real>::storedSteps() const {
  return long(vestige_stored_steps(session_->vestige));
}

template <typename Real>
bool InSitu<Real>::dryRun() const {
  return session_->dryRun;
}

template class InSitu<float>;
template class InSitu<double>;

}  // namespace minisim
