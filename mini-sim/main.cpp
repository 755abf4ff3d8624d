// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>

#include "mini-sim/insitu.h"
#include "mini-sim/options.h"
#include "mini-sim/terminal.h"

namespace {

using namespace minisim;

class Stopwatch {
 public:
  template <typename Work>
  auto time(const Work& work) {
    struct Stop {
      double& seconds;
      Clock::time_point start = Clock::now();
      ~Stop() { seconds += std::chrono::duration<double>(Clock::now() - start).count(); }
    } stop{seconds_};
    return work();
  }
  double seconds() const { return seconds_; }

 private:
  using Clock = std::chrono::steady_clock;
  double seconds_ = 0.0;
};

std::string format(const char* pattern, auto... values) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

void summarise(long steps, std::size_t cells, double solver, double adaptor, long stored,
               bool dryRun) {
  const double mlups = solver > 0.0 ? double(steps) * double(cells) / solver * 1e-6 : 0.0;
  const double all = solver + adaptor;
  std::printf("steps            %ld\n", steps);
  std::printf("solver_seconds   %.3f\n", solver);
  std::printf("mlups            %.1f\n", mlups);
  std::printf("adaptor_seconds  %.3f\n", adaptor);
  std::printf("adaptor_percent  %.1f\n", all > 0.0 ? 100.0 * adaptor / all : 0.0);
  std::printf("stored_steps     %ld\n", dryRun ? 0 : stored);
  if (dryRun) std::printf("would_store      %ld\n", stored);
  std::fflush(stdout);
}

template <typename Real>
int simulate(const Options& options) {
  InterruptGuard guard;
  Stopwatch solver, adaptor;
  Progress progress(options.steps, "steps", options.quiet);
  auto plume = makePlume<Real>(options.plume);

  std::optional<InSitu<Real>> insitu;
  const auto offer = [&] {
    if (!insitu || plume.stepsDone() % options.every != 0) return;
    if (adaptor.time([&] { return insitu->offer(plume); }) && options.announce) {
      std::printf(insitu->dryRun() ? "would store %ld\n" : "stored %ld\n", plume.stepsDone());
      std::fflush(stdout);
    }
  };
  if (options.adaptor) {
    adaptor.time([&] {
      insitu.emplace(plume.settings(),
                     typename InSitu<Real>::Options{
                         options.config, options.output, options.fields, options.plume.speed,
                         [&](const std::string& sentence) { progress.say(sentence); }});
    });
  }

  offer();
  bool finite = true;
  while (finite && plume.stepsDone() < options.steps && !guard.interrupted()) {
    solver.time([&] { plume.step(); });
    offer();
    const long done = plume.stepsDone();
    if (done % 100 == 0 || done == options.steps) finite = plume.totals().finite;
    if (progress.due(done)) {
      const double rate = double(done) * double(plume.cells()) / solver.seconds() * 1e-6;
      progress.show(done,
                    format("%.1f MLUPS, adaptor %.1f %%", rate,
                           100.0 * adaptor.seconds() / (solver.seconds() + adaptor.seconds())));
    }
  }
  const long stored = insitu ? insitu->storedSteps() : 0;
  const bool dryRun = insitu && insitu->dryRun();
  adaptor.time([&] { insitu.reset(); });

  if (!finite)
    progress.say(
        format("the flow diverged before step %ld: try a smaller --rayleigh", plume.stepsDone()));
  if (guard.interrupted()) progress.say(format("interrupted after step %ld", plume.stepsDone()));
  summarise(plume.stepsDone(), plume.cells(), solver.seconds(), adaptor.seconds(), stored, dryRun);
  return !finite ? kFailed : guard.interrupted() ? kInterrupted : kDone;
}

}  // namespace

int main(int argc, char** argv) {
  int exitCode = kDone;
  const auto options = parseOptions(argc, argv, exitCode);
  if (!options) return exitCode;
  try {
    return options->doublePrecision ? simulate<double>(*options) : simulate<float>(*options);
  } catch (const std::bad_alloc&) {
    const auto& n = options->plume.size;
    std::fprintf(stderr, "vestige-mini-sim: no memory for %d x %d x %d cells\n", n[0], n[1], n[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vestige-mini-sim: %s\n", error.what());
  }
  return kFailed;
}
