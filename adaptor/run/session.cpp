// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "adaptor/common/adaptor_error.h"
#include "adaptor/common/stopwatch.h"
#include "adaptor/plan/feature_fit.h"
#include "adaptor/plan/views.h"
#include "adaptor/run/dry_run.h"
#include "adaptor/step/timings.h"
#include "proxy/base/error.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/gl/environment.h"
#include "proxy/version.h"

namespace vestige {

namespace {

/// Lengths and depths of rays are single precision.
void requireSizeThatFloatsHold(const Box& domain) {
  constexpr double kLeast = 1e-30, kMost = 1e30;
  const glm::dvec3 size = domain.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest <= 0.0 || (longest >= kLeast && longest <= kMost)) return;
  throw AdaptorError(VESTIGE_ERROR_GRID,
                     fmt::format("the domain is {} long, domains of {} to {} are taken: share "
                                 "coordinates in another unit",
                                 longest, kLeast, kMost));
}

}  // namespace

Session::Session(const Config& config, const std::string& configText,
                 const std::string& recordDirectory, Log& log, Budget::Clock clock)
    : config_(config),
      log_(log),
      threads_(config.threads > 0 ? config.threads : gl::allowedProcessors()),
      trigger_(config.trigger),
      budget_(
          config.budget, config.fixed.cadence,
          clock ? std::move(clock) : [watch = Stopwatch()] { return watch.seconds(); }) {
  budget_.begin();
  // The archive last: overwriting takes the old one away, so nothing may fail after that.
  device_ = gl::Device::create(config_.glBackend, config_.threads);
  marcher_ = std::make_unique<StepMarcher>(config_, device_);
  features_ = std::make_unique<FeatureStep>(config_, device_);
  ensureExrThreads(config_.threads);
  startRecording(configText, recordDirectory);
  launch_ = launchOf([](const char* name) { return std::getenv(name); });
  if (!config_.dryRun) openArchive();
  const auto& info = device_->info();
  log_.info(fmt::format("vestige {} writes {} with {} ({})", kVersion,
                        config_.dryRun ? "nothing (dry run)" : "'" + config_.output + "'",
                        info.renderer, info.backend));
  budget_.end();
}

void Session::openArchive() {
  try {
    writer_ = std::make_unique<ArchiveWriter>(config_.output, config_.existing);
  } catch (const Error& error) {
    if (!launch_ || error.code() != ErrorCode::Exists) throw;
    throw Error(ErrorCode::Exists,
                fmt::format("{}; this is {}, and each process needs an archive of its own",
                            error.what(), launchNote(*launch_)));
  }
  if (launch_) {
    log_.warning(fmt::format(
        "{} says that several processes run, but no communicator is given: '{}' will hold what "
        "this one shares ({}), and nothing of the others. Gather fields in one process, or give "
        "each an archive of its own",
        launch_->variable, config_.output, launchNote(*launch_)));
  }
  if (config_.existing == ExistingArchive::Append) adoptEarlier();
}

Session::~Session() {
  if (config_.dryRun) {
    log_.info(fmt::format("dry run: {} steps would have been stored, {} bytes in all", storedSteps_,
                          std::uint64_t(storedSteps_) * rehearsedBytes_));
  }
}

void Session::startRecording(const std::string& configText, const std::string& directory) {
  if (directory.empty()) return;
  // The run matters more than its recording.
  try {
    recorder_ = std::make_unique<Recorder>(directory, configText, config_.output);
    if (recorder_->directory() != std::filesystem::path(directory)) {
      log_.warning(fmt::format("'{}' already holds a recording: this run is recorded in '{}'",
                               directory, recorder_->directory().string()));
    }
  } catch (const std::exception& error) {
    log_.warning(fmt::format("nothing is recorded: {}", error.what()));
  }
}

bool Session::wantsField(const std::string& name) const {
  if (recorder_ || config_.fields.empty()) return true;
  const auto names = [&](const std::vector<std::string>& list) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  return std::any_of(config_.fields.begin(), config_.fields.end(),
                     [&](const FieldConfig& field) {
                       return field.source == name || names(field.gradientNorm);
                     }) ||
         std::any_of(config_.classifiers.begin(), config_.classifiers.end(),
                     [&](const ClassifierConfig& each) { return names(each.fields); });
}

void Session::adoptEarlier() {
  // A restart goes on with the intervals of the run that it continues.
  try {
    settled_.adopt(Archive(config_.output));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::NotFound) {
      log_.warning(fmt::format("the earlier run's intervals are not taken over: {}", error.what()));
    }
  }
}

void Session::record(std::int64_t cycle, double time) {
  if (!recorder_) return;
  try {
    recorder_->execute(cycle, time, blocks_, units_);
  } catch (const std::exception& error) {
    log_.warning(fmt::format("recording ends before cycle {}: {}", cycle, error.what()));
    recorder_.reset();
  }
}

bool Session::wants(std::int64_t cycle, double time) {
  if (!trigger_.mayFire(cycle, time)) return false;
  if (budget_.hasTime()) return true;
  // Whether rules that look at fields would have fired is not known.
  if (trigger_.byCadence(cycle, time)) budget_.skip(cycle);
  say();
  return false;
}

void Session::say() {
  for (auto& [lost, sentence] : budget_.takeNews()) {
    lost ? log_.warning(std::move(sentence)) : log_.info(std::move(sentence));
  }
}

void Session::execute(std::int64_t cycle, double time) {
  struct Forget {
    BlockSet& blocks;
    ~Forget() { blocks.forgetShared(); }
  } const forget{blocks_};
  struct Spend {
    Budget& budget;
    explicit Spend(Budget& b) : budget(b) { budget.begin(); }
    ~Spend() { budget.end(); }
  } const spend(budget_);
  if (!std::isfinite(time)) {
    throw AdaptorError(VESTIGE_ERROR_CYCLE, fmt::format("the time of cycle {} is {}", cycle, time));
  }
  if (lastCycle_ && cycle <= *lastCycle_) {
    throw AdaptorError(
        VESTIGE_ERROR_CYCLE,
        fmt::format("cycle {} is not after the last stored one, {}", cycle, *lastCycle_));
  }
  record(cycle, time);
  blocks_.validate();
  requireSizeThatFloatsHold(blocks_.domain());
  StepTimes times;
  Fields fields{planFields(config_, blocks_, units_), {}, {}};
  fields.classifiers = planClassifiers(config_, fields.plans, blocks_, units_);
  const auto statistics = [&](const std::string& name) {
    return statisticsOf(fields, name, times);
  };
  if (!trigger_.fires(cycle, time, statistics)) return;
  if (!budget_.hasTime()) {
    budget_.skip(cycle);
    return say();
  }
  // The next cycles are compared with this step: a field that is not there must fail before it is
  // stored, not after.
  if (config_.trigger.change) statistics(config_.trigger.change->field);

  const StepFrame frame{cycle,    time,
                        &blocks_, resolveViews(config_, blocks_.domain()),
                        {},       TextureLimits{device_->info().maxTexture3D}};
  // One step tells a dry run what the others would cost.
  const bool kept = (config_.dryRun && storedSteps_ > 0) || store(frame, fields, times);
  // For triggers a step that is too large counts as well: the next cycle would be no smaller.
  trigger_.stored(cycle, time, statistics);
  if (!kept) return;
  lastCycle_ = cycle;
  ++storedSteps_;
}

std::vector<StepClassifier> Session::classifiersOf(Fields& fields, double referenceLength,
                                                   StepTimes& times) {
  std::vector<StepClassifier> ready;
  for (const PlannedClassifier& planned : fields.classifiers) {
    StepClassifier classifier{planned, {}};
    for (PlannedField& field : classifier.plan.fields) completeNorm(fields, field, times);
    const FeatureOrigin* settled = settled_.featuresOf(planned.config.name);
    if (settled && planned.config.sameShape(*settled->classifier)) {
      classifier.origin = *settled;
    } else {
      if (settled) {
        log_.warning(
            fmt::format("[[classifier]] '{}' has other fields or features than in the "
                        "earlier run, which is not gone on with",
                        planned.config.name));
        settled_.forgetFeatures(planned.config.name);
      }
      std::vector<FieldDomain> domains;
      bool allVary = true;
      for (const PlannedField& field : classifier.plan.fields) {
        domains.push_back(domainOf(fields, field, times));
        allVary = allVary && varies(fields.statistics.at(field.name), field.config.intervals);
      }
      classifier.origin = originOf(classifier.plan, std::move(domains), referenceLength, blocks_);
      classifier.origin.settled = allVary;
    }
    ready.push_back(std::move(classifier));
  }
  return ready;
}

TierBytes Session::featureBytes(const StepFrame& frame,
                                const std::vector<PlannedClassifier>& classifiers) const {
  // Of a pixel and channel, and of a slab in it: the plume of docs/classification.md.
  constexpr double kFlat = 4.0, kSlab = 0.5;
  TierBytes bytes{};
  for (const PlannedClassifier& each : classifiers) {
    const double channels =
        double(classifierFromJson(each.config.json, "", "classifier")->channels().size());
    if (config_.features) {
      bytes[std::size_t(Tier::Pictures)] +=
          kFlat * channels * double(config_.size.pixels() * frame.views.size());
    }
    if (!config_.slicedFeatures) continue;
    for (const StackView& stack : stackViews(*config_.slicedFeatures, config_.size, frame.views,
                                             blocks_, each.fields.front().location)) {
      bytes[std::size_t(Tier::Sliced)] +=
          kSlab * channels * double(stack.size.pixels()) * config_.slicedFeatures->slabs;
    }
  }
  return bytes;
}

void Session::findLadder(const StepFrame& frame, const Fields& fields) {
  if (!levels_.empty()) return;
  StepExtent extent;
  extent.fields = std::max(1, int(fields.plans.size()));
  extent.views = int(frame.views.size());
  for (const auto& [index, block] : blocks_.blocks()) {
    if (!block.grid.empty())
      extent.samples += double(block.grid.points[0]) * block.grid.points[1] * block.grid.points[2];
  }
  const Location location = fields.plans.empty() ? Location::Point : fields.plans.front().location;
  extent.stackPixels = [&, location](const Config& config) {
    double pixels = 0.0;
    if (!config.sliced) return pixels;
    for (const StackView& stack :
         stackViews(*config.sliced, config.size, frame.views, blocks_, location)) {
      pixels += double(stack.size.pixels());
    }
    return pixels;
  };
  extent.features = featureBytes(frame, fields.classifiers);
  levels_ = qualityLevelsOf(config_, extent);
  budget_.setLevels({levels_.begin(), levels_.end()});
}

std::vector<EncodedProxy> Session::make(StepFrame& frame, const std::vector<StepField>& fields,
                                        const std::vector<StepClassifier>& classifiers,
                                        StepTimes& times) {
  const Level& level = levels_[std::size_t(budget_.level())];
  frame.views = resolveViews(level.config, blocks_.domain());
  frame.provenance = fmt::format("vestige {}; {}", kVersion, device_->info().renderer);
  if (launch_) frame.provenance += "; " + launchNote(*launch_);
  if (config_.budget.any()) {
    const auto& [bytes, share] = config_.budget;
    frame.provenance += fmt::format(
        "; budget{}{}: {}", bytes ? fmt::format(" of {} bytes a step", *bytes) : "",
        share ? fmt::format(" of {} of the time", *share) : "", budget_.place(budget_.level()));
  }
  marcher_->configure(level.config);
  features_->configure(level.config);
  std::vector<EncodedProxy> proxies;
  for (const StepField& field : fields) {
    auto made = marcher_->march(frame, field, threads_, times);
    std::move(made.begin(), made.end(), std::back_inserter(proxies));
  }
  for (const StepClassifier& classifier : classifiers) {
    auto made = features_->march(frame, classifier, threads_, times);
    std::move(made.begin(), made.end(), std::back_inserter(proxies));
  }
  return proxies;
}

bool Session::store(StepFrame frame, Fields& fields, StepTimes& times) {
  const double referenceLength =
      config_.referenceLength > 0.0 ? config_.referenceLength : blocks_.domain().diagonal() / 100.0;
  if (const double coverage = blocks_.coverage();
      coverage < 0.999 && warned_.insert("coverage").second) {
    log_.warning(fmt::format("the blocks cover {:.1f} % of the domain; the rest is empty space",
                             100.0 * coverage));
  }
  leaveOutTooWide(fields, frame.cycle, times);
  std::vector<StepField> ready;
  for (auto& plan : config_.makesFields() ? fields.plans : std::vector<PlannedField>{}) {
    ready.push_back(readyOf(fields, plan, frame, referenceLength, times));
  }
  const auto classifiers = classifiersOf(fields, referenceLength, times);
  for (const auto& [name, statistics] : fields.statistics)
    if (const PlannedField* plan = fields.find(name))
      warnings_.ofSamples(*plan, statistics, blocks_, threads_);
  findLadder(frame, fields);
  std::vector<EncodedProxy> proxies;
  for (auto verdict = Budget::Verdict::Again; verdict != Budget::Verdict::Keep;) {
    proxies = make(frame, ready, classifiers, times);
    TierBytes bytes{};
    for (const auto& proxy : proxies) {
      bytes[std::size_t(tierOf(proxy.kind))] += double(proxy.exr.size() + proxy.png.size());
    }
    verdict = budget_.judge(frame.cycle, bytes);
    say();
    if (verdict == Budget::Verdict::Drop) return false;
  }
  finishStep(frame, proxies, times);
  budget_.stored(frame.cycle);
  say();
  if (config_.dryRun && config_.budget.timeShare) {
    log_.info(fmt::format("dry run: [budget] time_share = {} allows such a step every {:.3g} s",
                          *config_.budget.timeShare, budget_.secondsNeeded()));
  }
  settle(fields, classifiers);
  return true;
}

StepField Session::readyOf(Fields& fields, PlannedField& plan, const StepFrame& frame,
                           double referenceLength, StepTimes& times) {
  completeNorm(fields, plan, times);
  const auto& statistics = statisticsOf(fields, plan.name, times);
  const auto before = settled_.endsOf(plan);
  StepField ready{plan, statistics, settled_.classificationOf(plan, statistics, referenceLength)};
  const IntervalPartition& intervals = ready.classification.partition;
  warnings_.ofIntervals(plan, statistics, before, intervals, frame.cycle);
  // Widened intervals hold all that there is.
  if (before != Settled::Ends{intervals.low(), intervals.high()})
    ready.statistics.below = ready.statistics.above = 0;
  return ready;
}

void Session::settle(const Fields& fields, const std::vector<StepClassifier>& classifiers) {
  for (const auto& [name, statistics] : fields.statistics) {
    const PlannedField* plan = fields.find(name);
    if (plan && std::isfinite(statistics.high - statistics.low)) settled_.keep(*plan, statistics);
  }
  for (const StepClassifier& classifier : classifiers) settled_.keep(classifier);
}

std::uint64_t Session::write(const StepFrame& frame, const std::vector<EncodedProxy>& proxies,
                             StepTimes& times) {
  const Stopwatch watch;
  writer_->writeStep(proxies);
  times.write += watch.seconds();
  std::uint64_t bytes = 0;
  for (const auto& proxy : proxies) bytes += proxy.exr.size() + proxy.png.size();
  try {
    appendTimings(writer_->directory() / kTimingsFile,
                  timingsLine(frame.cycle, frame.time, times, peakMemory(), bytes));
  } catch (const std::exception& error) {
    // The step itself is safe on disk.
    log_.warning(fmt::format("cycle {} has no line in timings.csv: {}", frame.cycle, error.what()));
  }
  return bytes;
}

void Session::finishStep(const StepFrame& frame, const std::vector<EncodedProxy>& proxies,
                         StepTimes& times) {
  if (config_.dryRun) {
    auto report = dryRunReport(frame, proxies, times);
    rehearsedBytes_ = report.bytes;
    for (auto& sentence : report.sentences) log_.info(std::move(sentence));
    if (config_.budget.any()) {
      log_.info(fmt::format("dry run: [budget] takes {}", budget_.place(budget_.level())));
    }
    return;
  }
  const auto bytes = write(frame, proxies, times);
  const int passed = budget_.passedOver();
  log_.info(fmt::format("cycle {} stored: {} proxies, {:.2f} MB, {:.2f} s{}", frame.cycle,
                        proxies.size(), double(bytes) * 1e-6, times.sum(),
                        passed > 0 ? fmt::format(", {} steps skipped before", passed) : ""));
}

}  // namespace vestige
