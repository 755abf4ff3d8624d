// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/feature_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "adaptor/common/adaptor_error.h"
#include "proxy/classifier/fit.h"

namespace vestige {
namespace {

/// Whether the node of an axis counts to [low, high]; if that is one place, by the nodes' cells.
bool counts(const std::vector<double>& nodes, int index, double low, double high) {
  const auto i = std::size_t(index);
  if (low < high) return nodes[i] >= low && nodes[i] <= high;
  const double before = i > 0 ? 0.5 * (nodes[i - 1] + nodes[i]) : -HUGE_VAL;
  const double after = i + 1 < nodes.size() ? 0.5 * (nodes[i] + nodes[i + 1]) : HUGE_VAL;
  return before <= low && low < after;
}

nlohmann::json withFit(const nlohmann::json& primitive, const FittedPrimitive& fit,
                       std::size_t fields, bool full) {
  nlohmann::json json = primitive;
  json["center"] = std::vector<double>(fit.primitive.center.begin(),
                                       fit.primitive.center.begin() + std::ptrdiff_t(fields));
  std::vector<double> numbers;
  for (std::size_t i = 0; i < fields; ++i) {
    for (std::size_t j = 0; full && j < fields; ++j) numbers.push_back(fit.primitive.scale[i][j]);
    if (!full) numbers.push_back(1.0 / fit.primitive.scale[i][i]);
  }
  json[full ? "matrix" : "width"] = std::move(numbers);
  return json;
}

}  // namespace

std::vector<FieldSample> samplesIn(const Box& region, std::span<const PlannedField> fields,
                                   const BlockSet& blocks) {
  std::vector<FieldSample> samples;
  const Location location = fields.front().location;
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const auto nodes = block.nodes(location);
    std::vector<FieldReader> readers;
    for (const PlannedField& field : fields) readers.push_back(readerOf(field, block));
    std::vector<std::vector<double>> rows(fields.size(), std::vector<double>(nodes[0].size()));
    for (const SampleRange& own : blocks.ownSamples(index, location)) {
      const auto inside = [&](int axis, int i) {
        return counts(nodes[std::size_t(axis)], i, region.low[axis], region.high[axis]);
      };
      for (int z = own.low[2]; z < own.high[2]; ++z) {
        if (!inside(2, z)) continue;
        for (int y = own.low[1]; y < own.high[1]; ++y) {
          if (!inside(1, y)) continue;
          for (std::size_t f = 0; f < fields.size(); ++f) readers[f].row(y, z, rows[f].data());
          for (int x = own.low[0]; x < own.high[0]; ++x) {
            if (!inside(0, x)) continue;
            FieldSample& sample = samples.emplace_back();
            for (std::size_t f = 0; f < fields.size(); ++f)
              sample.values[f] = rows[f][std::size_t(x)];
          }
        }
      }
    }
  }
  return samples;
}

FeatureOrigin originOf(const PlannedClassifier& planned, std::vector<FieldDomain> domains,
                       double referenceLength, const BlockSet& blocks) {
  nlohmann::json json = planned.config.json;
  for (const PrimitiveFit& fit : planned.config.fits) {
    nlohmann::json& primitive = json["primitives"][fit.primitive];
    const auto samples = samplesIn(fit.region, planned.fields, blocks);
    try {
      const FittedPrimitive fitted = fitPrimitive(samples, domains, fit.full);
      primitive = withFit(primitive, fitted, planned.fields.size(), fit.full);
    } catch (const Error& error) {
      const auto& [low, high] = fit.region;
      throw AdaptorError(
          VESTIGE_ERROR_CONFIG,
          fmt::format("[[classifier]] '{}': primitives[{}] cannot be fitted to the {} samples from "
                      "({}, {}, {}) to ({}, {}, {}): {}",
                      planned.config.name, fit.primitive, samples.size(), low.x, low.y, low.z,
                      high.x, high.y, high.z, error.what()));
    }
  }
  FeatureOrigin origin;
  origin.classifier =
      classifierFromJson(json, "", "classifier")->resolved(domains, referenceLength);
  origin.domains = std::move(domains);
  origin.referenceLength = referenceLength;
  return origin;
}

}  // namespace vestige
