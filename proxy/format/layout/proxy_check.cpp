// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/proxy_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "proxy/base/error.h"
#include "proxy/format/layout/analytic_layers_layout.h"
#include "proxy/format/layout/feature_layout.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/learned_layout.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige {
namespace {

/// A relative allowance for what the rays computed in float before anything was stored.
constexpr double kComputed = 1e-4;

/// The values that a channel may hold: low .. high, or the one called `also`.
struct Rule {
  const char* wanted;
  double low, high;
  std::optional<float> also;
  bool whole = false;
};

Rule ruleFor(const ProxyHeader& header, const ProxyPart& part, const std::string& channel) {
  const std::string& kind = header.kind;
  const double fraction = 1.0 + part.error + kComputed;
  if (kind == kind::kAttenuation || part.name == "attenuation" || part.name == "transmittance")
    return {"a fraction of light", 0.0, fraction, {}};
  if (part.name == "length" || part.name == "integral") {
    const double longest = header.domain.diagonal() * (1.0 + kComputed) + part.error;
    return {"a length within the domain", 0.0, longest, {}};
  }
  if (part.name == "runs") return {"a whole number 0 .. 2047", 0.0, 2047.0, {}, true};
  if (part.name == "ends") {
    const int channels = header.partition ? header.partition->channels() : 0;
    return {"1 + a channel, or 0", 0.0, double(channels), {}, true};
  }
  if (part.name == "depth" || channel == "Z") {
    const DepthRange range = depthRange(header.camera, header.domain);
    const double slack = part.error + kComputed * (range.high - range.low);
    const double low = range.low - slack, high = range.high + slack;
    if (channel == "Z") return {"a depth within the domain or +infinity", low, high, HUGE_VALF};
    return {"a depth within the domain or 0", low, high, 0.0f};
  }
  if (kind == kind::kDepth) return {"a component of a unit vector", -1.02, 1.02, {}};
  if (kind == kind::kMip) {
    const FieldStatistics& s = header.statistics;
    const double slack = kComputed * std::max({s.high - s.low, std::abs(s.low), std::abs(s.high)});
    return {"within the field's range, or NaN", (s.low - slack - part.zero) / part.unit,
            (s.high + slack - part.zero) / part.unit, NAN};
  }
  if (part.name == "boundaries") {
    const DepthRange range = depthRange(header.camera, header.domain);
    const double slack = part.error + kComputed * (range.high - range.low);
    return {"a depth within the domain or 0", range.low - slack, range.high + slack, 0.0f};
  }
  if (kind == kind::kLearned) return {"finite and at most 1e6", -1e6, 1e6, {}};
  if (channel == "byte") return {"a byte", 0.0, 255.0, {}, true};
  if (part.name == "tau") return {"an optical depth 0 .. 64", 0.0, 64.0, {}};
  if (part.name == "state") return {"0, 1 or 2", 0.0, 2.0, {}, true};
  if (channel == "A") return {"an opacity", 0.0, fraction, {}};
  return {"light >= 0", 0.0, std::numeric_limits<float>::max(), {}};
}

/// The first value that breaks the rule, or the number of values.
std::size_t firstOutOfRange(const std::vector<float>& values, const Rule& rule) {
  constexpr double kMost = std::numeric_limits<float>::max();
  const float low = float(std::clamp(rule.low, -kMost, kMost)),
              high = float(std::clamp(rule.high, -kMost, kMost)), also = rule.also.value_or(low);
  const bool nanToo = std::isnan(also), whole = rule.whole;
  const auto breaks = [=](float v) {
    return !((v >= low && v <= high && !(whole && v != std::floor(v))) || v == also ||
             (nanToo && v != v));
  };
  // In blocks without a branch: this runs whenever a picture is decoded.
  constexpr std::size_t kBlock = 64;
  std::size_t i = 0;
  for (; i + kBlock <= values.size(); i += kBlock) {
    const float* v = values.data() + i;
    unsigned bad = 0;
    for (std::size_t j = 0; j < kBlock; ++j)
      bad |= unsigned(!(v[j] >= low) | !(v[j] <= high)) & unsigned(v[j] != also);
    if (!bad && whole)  // in range, so they fit an int
      for (std::size_t j = 0; j < kBlock; ++j) bad |= unsigned(v[j] != float(int(v[j])));
    if (bad && std::any_of(v, v + kBlock, breaks)) break;
  }
  while (i < values.size() && !breaks(values[i])) ++i;
  return i;
}

std::string sentence(const ProxyHeader& header, const ProxyPart& part, const Channel& channel,
                     std::size_t pixel, const char* wanted) {
  const std::size_t width = std::size_t(header.size.width);
  return fmt::format("channel '{}' of part '{}' is {} at pixel ({}, {}); it must be {}",
                     channel.name, part.name, channel.values[pixel], pixel % width, pixel / width,
                     wanted);
}

class Checker {
 public:
  explicit Checker(const ProxyImage& image) : image_(image) {}

  std::vector<std::string> run() {
    const std::string& kind = image_.header.kind;
    if (image_.header.customization && kind != kind::kAttenuation && kind != kind::kReference &&
        kind != kind::kLayered && kind != kind::kMip) {
      report("it is customised by position, which a {} proxy cannot be", kind);
    }
    if (kind == kind::kAttenuation)
      checkAttenuation();
    else if (kind == kind::kLength)
      checkLength();
    else if (kind == kind::kDepth)
      checkDepth();
    else if (kind == kind::kMip)
      checkSingle("mip", {"value"});
    else if (kind == kind::kReference)
      checkSingle("reference", {"R", "G", "B", "A"});
    else if (kind == kind::kTraining)
      checkTraining();
    else if (kind == kind::kLearned)
      checkLearned();
    else if (kind == kind::kLayered)
      checkLayered();
    else if (kind == kind::kField)
      checkField();
    else if (kind == kind::kFeatures)
      checkFeatures();
    else
      report("its kind '{}' is unknown", kind);
    return std::move(problems_);
  }

 private:
  template <typename... Args>
  void report(fmt::format_string<Args...> text, Args&&... args) {
    problems_.push_back(fmt::format(text, std::forward<Args>(args)...));
  }

  /// The part, if it is there with exactly these channels in this order.
  const ProxyPart* partWith(const std::string& name, const std::vector<std::string>& channels) {
    const ProxyPart* part = image_.find(name);
    if (!part) {
      report("part '{}' is missing", name);
      return nullptr;
    }
    bool same = part->channels.size() == channels.size();
    for (std::size_t i = 0; same && i < channels.size(); ++i)
      same = part->channels[i].name == channels[i];
    if (!same) report("part '{}' does not have the channels that it should have", name);
    return same ? part : nullptr;
  }

  void requireParts(std::size_t count) {
    if (image_.parts.size() != count)
      report("it has {} parts, a {} proxy has {}", image_.parts.size(), image_.header.kind, count);
  }

  /// Reports the first pixel of a channel that fails a test.
  template <typename Test>
  void each(const ProxyPart& part, const Channel& channel, const char* wanted, const Test& ok) {
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      if (ok(channel.values[i], i)) continue;
      problems_.push_back(sentence(image_.header, part, channel, i, wanted));
      return;
    }
  }

  std::vector<std::string> intervalNames() {
    std::vector<std::string> names;
    if (!image_.header.partition)
      report("it has no interval bounds");
    else
      for (int k = 0; k < image_.header.partition->channels(); ++k)
        names.push_back(image_.header.partition->channelName(k));
    return names;
  }

  double diagonal() const { return image_.header.domain.diagonal(); }

  /// Checks that planes add up to between low and high everywhere.
  void sums(const ProxyPart& part, double low, double high, const char* wanted) {
    std::vector<double> sum(image_.header.size.pixels());
    for (const Channel& c : part.channels)
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += c.values[i];
    const double slack = part.error * double(part.channels.size()) + kComputed * high;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      if (sum[i] >= low - slack && sum[i] <= high + slack) continue;
      const std::size_t width = std::size_t(image_.header.size.width);
      report("the channels of part '{}' add up to {} at pixel ({}, {}); they must {}", part.name,
             sum[i], i % width, i / width, wanted);
      return;
    }
  }

  /// Reports the first value of each channel that is out of its range; whether there is none.
  bool inRange(const ProxyPart& part) {
    std::vector<std::string> found = outOfRange(image_.header, part);
    problems_.insert(problems_.end(), found.begin(), found.end());
    return found.empty();
  }

  void checkAttenuation() {
    requireParts(1);
    std::vector<std::string> names = intervalNames();
    names.push_back("T");
    const ProxyPart* part = partWith("attenuation", names);
    if (part && inRange(*part)) sums(*part, 1.0, 1.0, "add up to 1");
  }

  void checkLength() {
    requireParts(image_.find("ends") ? 4 : 3);
    const std::vector<std::string> names = intervalNames();
    if (const ProxyPart* ends = image_.find("ends") ? partWith("ends", {"first", "last"}) : nullptr)
      inRange(*ends);
    const ProxyPart* length = partWith("length", names);
    const ProxyPart* depth = partWith("depth", names);
    const ProxyPart* runs = partWith("runs", names);
    if (!length || !depth || !runs) return;
    if (!inRange(*length) || !inRange(*depth) || !inRange(*runs)) return;
    const Rule depths = ruleFor(image_.header, *depth, names[0]);
    for (std::size_t k = 0; k < names.size(); ++k) {
      const std::vector<float>& l = length->channels[k].values;
      each(*depth, depth->channels[k], "a depth within the domain, or 0 where the length is 0",
           [&](float v, std::size_t i) {
             return l[i] > 0.0f ? v >= depths.low && v <= depths.high : v == 0.0f;
           });
      each(*runs, runs->channels[k], "a whole number >= 1, or 0 where the length is 0",
           [&](float v, std::size_t i) { return (l[i] > 0.0f) == (v >= 1.0f); });
    }
    sums(*length, 0.0, diagonal(), "stay within the domain");
  }

  void checkDepth() {
    const std::size_t layers = image_.header.isovalues.size();
    requireParts(layers);
    for (std::size_t layer = 0; layer < layers; ++layer) {
      const ProxyPart* part = partWith(fmt::format("layer{:02d}", layer), {"Z", "nx", "ny", "nz"});
      if (!part || !inRange(*part)) continue;
      const auto& [z, nx, ny, nz] = std::tie(part->channels[0].values, part->channels[1].values,
                                             part->channels[2].values, part->channels[3].values);
      each(*part, part->channels[3],
           "the last component of a unit vector turned to the viewer where there is a hit, else 0",
           [&, &depth = z, &x = nx, &y = ny](float v, std::size_t i) {
             if (depth[i] == HUGE_VALF) return v == 0.0f && x[i] == 0.0f && y[i] == 0.0f;
             const double norm = std::hypot(double(x[i]), double(y[i]), double(v));
             return norm == 0.0 || std::abs(norm - 1.0) <= 0.02;
           });
    }
  }

  void checkLayered() {
    const int layers = layersOf(image_);
    if (image_.header.camera.projection == Projection::MultiPerspective)
      report("layers cannot be those of a multi-perspective camera");
    if (layers < 1 || layers > kMostLayers) {
      report("it has {} layers, not 1 to {}", layers, kMostLayers);
      return;
    }
    requireParts(std::size_t(layers) + 3);
    std::vector<std::string> taus, depths;
    for (int i = 0; i < layers; ++i) taus.push_back(fmt::format("t{:02d}", i));
    for (int i = 0; i <= layers; ++i) depths.push_back(fmt::format("z{:02d}", i));
    const ProxyPart* tau = partWith("tau", taus);
    const ProxyPart* boundaries = partWith("boundaries", depths);
    const ProxyPart* states = partWith("state", {"state"});
    if (!tau || !boundaries || !states) return;
    if (!inRange(*tau) || !inRange(*boundaries) || !inRange(*states)) return;
    const std::vector<float>& state = states->channels[0].values;
    const auto emptyIsZero = [&](float v, std::size_t i) { return state[i] > 0.0f || v == 0.0f; };
    for (int layer = 0; layer < layers; ++layer) {
      const ProxyPart* color = partWith(fmt::format("layer{:02d}", layer), {"R", "G", "B"});
      if (!color || !inRange(*color)) continue;
      for (const Channel& channel : color->channels)
        each(*color, channel, "0 where the state is 0", emptyIsZero);
      each(*tau, tau->channels[std::size_t(layer)], "0 where the state is 0", emptyIsZero);
    }
    for (std::size_t b = 0; b < depths.size(); ++b)
      each(*boundaries, boundaries->channels[b],
           "deeper than the one before, or 0 where the state is 0", [&](float v, std::size_t i) {
             if (state[i] == 0.0f) return v == 0.0f;
             return b == 0 || v > boundaries->channels[b - 1].values[i];
           });
  }

  void checkField() {
    const bool gaps = image_.find("nodata");
    requireParts(gaps ? 2 : 1);
    if (!partWith("zfp", {"byte"}) || (gaps && !partWith("nodata", {"byte"}))) return;
    try {
      const FieldSamples field = fieldSamples(image_);
      const FieldGrid& grid = *image_.header.grid;
      const double slack = grid.tolerance / (grid.high - grid.low) + kComputed;
      for (const float value : field.values) {
        if (!(value < -slack || value > 1.0 + slack)) continue;
        report("a sample is {}, beyond the field's {} .. {}",
               grid.low + double(value) * (grid.high - grid.low), grid.low, grid.high);
        return;
      }
    } catch (const Error& e) {
      report("{}", e.what());
    }
  }

  void checkFeatures() {
    if (!image_.header.features) {
      report("it has no classifier");
      return;
    }
    requireParts(4);
    const FeatureOrigin& features = *image_.header.features;
    const std::vector<std::string> names = features.classifier->channels();
    const ProxyPart* attenuation = partWith("attenuation", names);
    const ProxyPart* left = partWith("transmittance", {"T"});
    const ProxyPart* integral = partWith("integral", names);
    const ProxyPart* depth = partWith("depth", names);
    if (!attenuation || !left || !integral || !depth) return;
    if (!inRange(*attenuation) || !inRange(*left) || !inRange(*integral) || !inRange(*depth))
      return;
    const Rule depths = ruleFor(image_.header, *depth, "");
    for (std::size_t c = 0; c < names.size(); ++c)
      each(*depth, depth->channels[c], "a depth within the domain, or 0 where the integral is 0",
           [&](float v, std::size_t i) {
             const bool met = integral->channels[c].values[i] > 0.0f;
             return met ? v >= depths.low && v <= depths.high : v == 0.0f;
           });
    // What takes light away, and what is left.
    ProxyPart light{"attenuation", 1.0, 0.0, attenuation->error, left->channels};
    const auto optics = features.classifier->optics(features.referenceLength);
    for (std::size_t c = 0; c < names.size(); ++c)
      if (optics[c].extinction > 0.0) light.channels.push_back(attenuation->channels[c]);
    sums(light, 1.0, 1.0, "add up to 1 with the transmittance");
  }

  void checkTraining() {
    const std::size_t pictures = image_.header.looks.size();
    if (pictures == 0) report("it does not say of which looks its pictures are");
    requireParts(pictures);
    for (std::size_t i = 0; i < pictures; ++i)
      if (const ProxyPart* part = partWith(fmt::format("picture{:02d}", i), {"R", "G", "B", "A"}))
        inRange(*part);
  }

  void checkLearned() {
    checkSingle("table", {"value"});
    try {
      learnedTable(image_);
    } catch (const Error& e) {
      report("{}", e.what());
    }
  }

  /// A kind of one part whose values have ranges and nothing else.
  void checkSingle(const std::string& name, const std::vector<std::string>& channels) {
    requireParts(1);
    if (const ProxyPart* part = partWith(name, channels)) inRange(*part);
  }

  const ProxyImage& image_;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> outOfRange(const ProxyHeader& header, const ProxyPart& part) {
  std::vector<std::string> problems;
  for (const Channel& channel : part.channels) {
    const Rule rule = ruleFor(header, part, channel.name);
    const std::size_t pixel = firstOutOfRange(channel.values, rule);
    if (pixel < channel.values.size())
      problems.push_back(sentence(header, part, channel, pixel, rule.wanted));
  }
  return problems;
}

std::vector<std::string> problemsOf(const ProxyImage& image) { return Checker(image).run(); }

std::vector<std::string> problemsOf(const ExrFile& file) {
  const bool features = file.header().kind == kind::kSlicedFeatures;
  if (!features && file.header().kind != kind::kSliced) return problemsOf(file.image());
  try {
    features ? void(readFeatureStack(file)) : void(readStack(file));
  } catch (const Error& e) {
    if (e.code() != ErrorCode::Format && e.code() != ErrorCode::NotFound) throw;
    return {e.what()};
  }
  return {};
}

}  // namespace vestige
