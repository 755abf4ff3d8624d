// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "explorer/program/cli.h"
#include "explorer/renderer/learned_pass.h"
#include "explorer/renderer/renderer.h"
#include "explorer/training/training.h"
#include "proxy/base/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, backend = "auto";
  std::optional<long> cycle;
  bool everyStep = false;
  TrainingRequest request;
};

std::vector<TrainingRequest> requestsOf(const Options& options, const Archive& archive) {
  Look look;
  look.cycle = options.cycle;
  const std::vector<long> cycles =
      options.everyStep ? archive.cycles() : std::vector<long>{cycleOf(look, archive)};
  TrainingRequest request = options.request;
  if (request.field.empty()) request.field = archive.fields().front();
  std::vector<TrainingRequest> requests;
  for (const long cycle : cycles) {
    request.cycle = cycle;
    std::vector<std::string> views = trainableViews(archive, cycle, request.field);
    if (!options.request.view.empty()) views = {options.request.view};
    for (const std::string& view : views) {
      request.view = view;
      requests.push_back(request);
    }
  }
  if (requests.empty())
    throw Error(ErrorCode::NotFound,
                "archive " + options.archive + " has no picture of field '" + request.field +
                    "' to learn from; [image] proxies of the run name \"training\" or "
                    "\"reference\"");
  return requests;
}

void run(const Options& options) {
  Archive(options.archive);  // a writer would make one where there is none
  // The lock first: who trains and then finds that a run is writing has waited for nothing.
  ArchiveWriter writer(options.archive, ExistingArchive::Append);
  const Archive archive(options.archive);
  const auto device = gl::Device::create(options.backend);
  for (const TrainingRequest& request : requestsOf(options, archive)) {
    const ProxyImage table = trainColors(*device, archive, request);
    const EncodedProxy proxy = encodeProxy(table);
    writer.addToStep(proxy);
    const ProxyHeader& header = table.header;
    fmt::print("learned colours of '{}' in view '{}', cycle {}: {}; {} bytes\n", header.field,
               header.view, header.cycle, learnedNote(header), proxy.exr.size());
  }
}

}  // namespace

void addTrain(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "train", "Learns colours from a run's own pictures and stores them in the archive");
  auto options = std::make_shared<Options>();
  TrainingRequest& request = options->request;
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  auto* step =
      command->add_option("--step", options->cycle, "Cycle of the step (default: the last)");
  command->add_flag("--every-step", options->everyStep, "All steps")->excludes(step);
  command->add_option("--field", request.field, "Field (default: the first)");
  command->add_option("--view", request.view, "Stored view (default: all that have pictures)");
  command->add_option("-k,--clusters", request.clusters, "Clusters of attenuation")
      ->check(CLI::Range(1, kMostClusters))
      ->capture_default_str();
  command->add_option("--pictures", request.pictures, "Training pictures of a view, at most")
      ->check(CLI::Range(1, kMostTrainingPictures))
      ->capture_default_str();
  command->add_option("--from", request.from, "Recompose from (default: the truest stored)")
      ->check(CLI::IsMember({"sliced", "length", "attenuation"}));
  command->add_option("--gl", options->backend, "auto, osmesa, egl")->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
