// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/proxy_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "proxy/proxy_layout.h"

namespace vestige {
namespace {

/// A relative allowance for what the rays computed in float before anything was stored.
constexpr double kComputed = 1e-4;

class Checker {
 public:
  explicit Checker(const ProxyImage& image) : image_(image) {}

  std::vector<std::string> run() {
    const std::string& kind = image_.header.kind;
    if (kind == kind::kAttenuation)
      checkAttenuation();
    else if (kind == kind::kLength)
      checkLength();
    else if (kind == kind::kDepth)
      checkDepth();
    else if (kind == kind::kMip)
      checkMip();
    else if (kind == kind::kReference)
      checkReference();
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
      const std::size_t width = std::size_t(image_.header.size.width);
      report("channel '{}' of part '{}' is {} at pixel ({}, {}); it must be {}", channel.name,
             part.name, channel.values[i], i % width, i / width, wanted);
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

  void checkAttenuation() {
    requireParts(1);
    std::vector<std::string> names = intervalNames();
    names.push_back("T");
    const ProxyPart* part = partWith("attenuation", names);
    if (!part) return;
    const double most = 1.0 + part->error + kComputed;
    for (const Channel& c : part->channels)
      each(*part, c, "a fraction of light", [&](float v, auto) { return v >= 0.0f && v <= most; });
    sums(*part, 1.0, 1.0, "add up to 1");
  }

  void checkLength() {
    requireParts(image_.find("ends") ? 4 : 3);
    const std::vector<std::string> names = intervalNames();
    if (const ProxyPart* ends = image_.find("ends") ? partWith("ends", {"first", "last"}) : nullptr)
      for (const Channel& c : ends->channels)
        each(*ends, c, "1 + a channel, or 0", [&](float v, auto) {
          return v >= 0.0f && v <= float(names.size()) && v == std::floor(v);
        });
    const ProxyPart* length = partWith("length", names);
    const ProxyPart* depth = partWith("depth", names);
    const ProxyPart* runs = partWith("runs", names);
    if (!length || !depth || !runs) return;
    const double longest = diagonal() * (1.0 + kComputed) + length->error;
    const DepthRange range = depthRange(image_.header.camera, image_.header.domain);
    const double slack = depth->error + kComputed * (range.high - range.low);
    for (std::size_t k = 0; k < names.size(); ++k) {
      const std::vector<float>& l = length->channels[k].values;
      each(*length, length->channels[k], "a length within the domain",
           [&](float v, auto) { return v >= 0.0f && v <= longest; });
      each(*depth, depth->channels[k], "a depth within the domain, or 0 where the length is 0",
           [&](float v, std::size_t i) {
             return l[i] > 0.0f ? v >= range.low - slack && v <= range.high + slack : v == 0.0f;
           });
      each(*runs, runs->channels[k], "a whole number >= 1, or 0 where the length is 0",
           [&](float v, std::size_t i) {
             return l[i] > 0.0f ? v >= 1.0f && v == std::floor(v) : v == 0.0f;
           });
    }
    sums(*length, 0.0, diagonal(), "stay within the domain");
  }

  void checkDepth() {
    const std::size_t layers = image_.header.isovalues.size();
    requireParts(layers);
    const DepthRange range = depthRange(image_.header.camera, image_.header.domain);
    for (std::size_t layer = 0; layer < layers; ++layer) {
      const ProxyPart* part = partWith(fmt::format("layer{:02d}", layer), {"Z", "nx", "ny", "nz"});
      if (!part) continue;
      const double slack = part->error + kComputed * (range.high - range.low);
      const auto& [z, nx, ny, nz] = std::tie(part->channels[0].values, part->channels[1].values,
                                             part->channels[2].values, part->channels[3].values);
      each(*part, part->channels[0], "a depth within the domain or +infinity", [&](float v, auto) {
        return v == HUGE_VALF || (v >= range.low - slack && v <= range.high + slack);
      });
      each(*part, part->channels[3],
           "the last component of a unit vector turned to the viewer where there is a hit, else 0",
           [&, &depth = z, &x = nx, &y = ny](float v, std::size_t i) {
             if (depth[i] == HUGE_VALF) return v == 0.0f && x[i] == 0.0f && y[i] == 0.0f;
             const double norm = std::hypot(double(x[i]), double(y[i]), double(v));
             return norm == 0.0 || std::abs(norm - 1.0) <= 0.02;
           });
    }
  }

  void checkMip() {
    requireParts(1);
    const ProxyPart* part = partWith("mip", {"value"});
    if (!part) return;
    const FieldStatistics& s = image_.header.statistics;
    const double slack = kComputed * std::max({s.high - s.low, std::abs(s.low), std::abs(s.high)});
    each(*part, part->channels[0], "within the field's range, or NaN", [&](float v, auto) {
      return std::isnan(v) || (v >= s.low - slack && v <= s.high + slack);
    });
  }

  void checkReference() {
    requireParts(1);
    const ProxyPart* part = partWith("reference", {"R", "G", "B", "A"});
    if (!part) return;
    for (const Channel& c : part->channels)
      each(*part, c, c.name == "A" ? "an opacity" : "light >= 0", [&](float v, auto) {
        return v >= 0.0f && std::isfinite(v) &&
               (c.name != "A" || v <= 1.0 + part->error + kComputed);
      });
  }

  const ProxyImage& image_;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> problemsOf(const ProxyImage& image) { return Checker(image).run(); }

}  // namespace vestige
