// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "adaptor/common/log.h"
#include "adaptor/common/stopwatch.h"
#include "adaptor/config/config.h"
#include "adaptor/ingest/block_set.h"
#include "adaptor/plan/classification.h"
#include "adaptor/run/field_warnings.h"
#include "adaptor/run/quality_levels.h"
#include "adaptor/run/record.h"
#include "adaptor/run/settled.h"
#include "adaptor/run/trigger.h"
#include "adaptor/step/feature_step.h"
#include "adaptor/step/step.h"
#include "proxy/archive/archive.h"
#include "proxy/base/launch.h"
#include "proxy/gl/device.h"

namespace vestige {

/// One run of a simulation: fields in, an archive out. Made, executed and destroyed on a Worker;
/// the rest is cheap and may be called on the host's thread meanwhile idle.
class Session {
 public:
  /// Opens the GL device and the archive. `recordDirectory` may be empty. `clock`: seconds of the
  /// run for [budget] time_share; empty = wall time since this call. Throws.
  Session(const Config& config, const std::string& configText, const std::string& recordDirectory,
          Log& log, Budget::Clock clock = {});
  ~Session();

  BlockSet& blocks() { return blocks_; }
  void setUnits(const std::string& field, const std::string& units) { units_[field] = units; }
  /// Whether a field that is published by this name is stored, or recorded.
  bool wantsField(const std::string& name) const;
  /// Whether execute may store the step: a trigger may fire, and the budget has time.
  bool wants(std::int64_t cycle, double time);
  std::int64_t storedSteps() const { return storedSteps_; }

  /// Stores the step if a trigger fires; shared fields are forgotten in any case. Throws; then the
  /// step is lost and nothing else.
  void execute(std::int64_t cycle, double time);

 private:
  /// What is known of the fields of the step at hand.
  struct Fields {
    std::vector<PlannedField> plans;
    std::vector<PlannedClassifier> classifiers;
    std::map<std::string, FieldStatistics> statistics;
    /// Among the plans, what classifiers take, and what norms are of; nullptr: none has the name.
    const PlannedField* find(const std::string& name) const;
  };
  void startRecording(const std::string& configText, const std::string& directory);
  void openArchive();
  void adoptEarlier();
  void record(std::int64_t cycle, double time);
  const FieldStatistics& statisticsOf(Fields& fields, const std::string& name, StepTimes& times);
  /// Finds the ranges of a gradient norm.
  void completeNorm(Fields& fields, PlannedField& plan, StepTimes& times);
  /// What a classifier knows of a field at this step, or from the first step on.
  FieldDomain domainOf(Fields& fields, const PlannedField& plan, StepTimes& times);
  /// Whether no double says how far a field's values, or those of a norm's terms, are apart.
  bool isTooWide(Fields& fields, const PlannedField& plan, StepTimes& times);
  /// Takes such fields away, and the classifiers that want them, with a warning. Throws
  /// VESTIGE_ERROR_FIELD where nothing is left to store.
  void leaveOutTooWide(Fields& fields, std::int64_t cycle, StepTimes& times);
  std::vector<StepClassifier> classifiersOf(Fields& fields, double referenceLength,
                                            StepTimes& times);
  TierBytes featureBytes(const StepFrame& frame,
                         const std::vector<PlannedClassifier>& classifiers) const;
  void findLadder(const StepFrame& frame, const Fields& fields);
  void say();
  /// Whether the step is stored: it may be too large for the budget.
  bool store(StepFrame frame, Fields& fields, StepTimes& times);
  std::vector<EncodedProxy> make(StepFrame& frame, const std::vector<StepField>& fields,
                                 const std::vector<StepClassifier>& classifiers, StepTimes& times);
  /// The field with its intervals; says what is to be said of it.
  StepField readyOf(Fields& fields, PlannedField& plan, const StepFrame& frame,
                    double referenceLength, StepTimes& times);
  /// Keeps ranges and classifiers for the steps to come.
  void settle(const Fields& fields, const std::vector<StepClassifier>& classifiers);
  std::uint64_t write(const StepFrame& frame, const std::vector<EncodedProxy>& proxies,
                      StepTimes& times);
  void finishStep(const StepFrame& frame, const std::vector<EncodedProxy>& proxies,
                  StepTimes& times);

  Config config_;
  Log& log_;
  int threads_;
  std::shared_ptr<gl::Device> device_;
  std::unique_ptr<StepMarcher> marcher_;
  std::unique_ptr<FeatureStep> features_;
  std::unique_ptr<ArchiveWriter> writer_;
  std::unique_ptr<Recorder> recorder_;
  std::optional<Launch> launch_;  ///< without a communicator, which is all that there is yet

  BlockSet blocks_;
  std::map<std::string, std::string> units_;
  Trigger trigger_;
  Budget budget_;
  std::vector<Level> levels_;  ///< of the first step's grid; empty until then
  Settled settled_;
  FieldWarnings warnings_{log_};
  std::set<std::string> warned_;
  std::optional<std::int64_t> lastCycle_;
  std::int64_t storedSteps_ = 0;
  std::uint64_t rehearsedBytes_ = 0;  ///< of the one step that a dry run makes
};

}  // namespace vestige
