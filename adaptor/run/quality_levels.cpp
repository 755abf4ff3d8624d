// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/quality_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "proxy/format/image/proxy_image.h"
#include "proxy/format/layout/field_layout.h"

namespace vestige {
namespace {

/// One setting of one tier.
struct Setting {
  std::string name;
  TierBytes bytes{};
  double worth = 0.0;  ///< dB: mean PSNR of edits - 10 log10 of DSSIM at 45 degrees
  std::function<void(Config&)> apply;
};
using Chain = std::vector<Setting>;

TierBytes only(Tier tier, double bytes) {
  TierBytes all{};
  all[std::size_t(tier)] = bytes;
  return all;
}

// --- the measured frontier -----------------------------------------------------------------------
// Fits to the sweep of docs/fidelity.md over CT, turbulent and smooth (256^3, pixels = voxels),
// within 2 dB of its means; bytes differ by a factor of two either way between scenes, ratios
// within a tier by a tenth.

double bytesOfStacks(const SlicedConfig& sliced, double pixels) {
  return 28.0 * pixels * std::pow(sliced.slabs / 20.0, 0.74) * std::pow(sliced.levels / 32.0, 0.18);
}

double worthOfStacks(const SlicedConfig& sliced) {
  const double levels = sliced.levels < 32    ? -5.1
                        : sliced.levels == 32 ? 0.0
                        : sliced.levels == 64 ? 3.6
                                              : 5.0;
  const double sides = sliced.stacks == "axes" ? 18.2 : 16.7;
  return 54.8 + sides + 34.5 * std::log10(sliced.slabs / 20.0) + levels;
}

/// `bits`: -log2 of the tolerance as a share of the range.
double bytesOfField(int reduction, double bits, double samples) {
  return 0.175 * samples * std::pow(1.35, bits - 4.0) / std::pow(double(reduction), 2.5);
}

double worthOfField(int reduction, double bits) {
  if (reduction == 1) return 79.0 + 6.1 * (bits - 4.0);
  return 53.9 - 11.8 * (std::log2(double(reduction)) - 1.0) + 0.5 * (bits - 6.0);
}

/// Bytes of a pixel of each proxy with its preview, plume and turbulent; of a layer, CT.
double bytesOfPixel(const Config& config) {
  return (config.attenuation ? 2.0 : 0.0) + (config.length ? 11.0 : 0.0) +
         (config.depth ? 5.0 : 0.0) + (config.mip ? 6.0 : 0.0) + (config.reference ? 1.3 : 0.0) +
         (config.training ? 1.3 * config.training->pictures : 0.0) +
         (config.layered ? 1.0 + 1.2 * config.layers : 0.0);
}

// --- chains --------------------------------------------------------------------------------------

/// The first one, and of those that take less the ones that none beats in both.
Chain frontier(Chain settings) {
  const Setting start = settings.front();
  std::stable_sort(settings.begin(), settings.end(), [](const Setting& a, const Setting& b) {
    return sumOf(a.bytes) < sumOf(b.bytes);
  });
  Chain kept;
  for (Setting& setting : settings) {
    if (sumOf(setting.bytes) >= 0.99 * sumOf(start.bytes)) break;
    if (kept.empty() || setting.worth > kept.back().worth) kept.push_back(std::move(setting));
  }
  kept.push_back(start);
  std::reverse(kept.begin(), kept.end());
  return kept;
}

template <class T>
std::vector<T> choices(T own, bool fixed, std::initializer_list<T> others) {
  std::vector<T> all{own};
  for (const T& other : others) {
    if (!fixed && other != own) all.push_back(other);
  }
  return all;
}

Setting stackSetting(const SlicedConfig& sliced, const Config& config, const StepExtent& extent) {
  Config made = config;
  made.sliced = sliced;
  const std::string many = sliced.stacks == "axes"    ? "three stacks"
                           : sliced.stacks == "front" ? "one stack"
                                                      : "stacks of " + sliced.stacks;
  return {fmt::format("{} of {} slabs, {} levels", many, sliced.slabs, sliced.levels),
          only(Tier::Sliced, extent.fields * bytesOfStacks(sliced, extent.stackPixels(made))),
          worthOfStacks(sliced), [sliced](Config& target) { target.sliced = sliced; }};
}

Chain stackSettings(const Config& config, const StepExtent& extent) {
  Chain all;
  const SlicedConfig own = config.sliced.value_or(SlicedConfig{});
  for (const auto& stacks :
       choices(own.stacks, config.fixed.stacks, {std::string("axes"), std::string("front")})) {
    for (const int slabs : choices(own.slabs, config.fixed.slabs, {32, 20, 12, 8})) {
      for (const int levels : choices(own.levels, config.fixed.levels, {16, 32, 64})) {
        SlicedConfig sliced = own;
        sliced.stacks = stacks;
        sliced.slabs = slabs;
        sliced.levels = levels;
        all.push_back(stackSetting(sliced, config, extent));
      }
    }
  }
  return all;
}

/// What is left when the frontier ends: fewer pixels, ever fewer bytes.
void addCoarser(Chain& chain, const Config& config, const StepExtent& extent) {
  if (config.fixed.pixels) return;
  Config last = config;
  chain.back().apply(last);
  if (!last.sliced) last = config, last.sliced.emplace(SlicedConfig{"front", 512, 8, 16});
  if (last.sliced->stacks == "views") return;
  for (const int pixels : {256, 128, 64, 32}) {
    SlicedConfig sliced = *last.sliced;
    sliced.pixels = std::min(pixels, sliced.pixels);
    Setting setting = stackSetting(sliced, config, extent);
    if (sumOf(setting.bytes) > 0.8 * sumOf(chain.back().bytes)) continue;
    setting.name += fmt::format(", at most {} pixels", pixels);
    chain.push_back(std::move(setting));
  }
}

Setting fieldSetting(int reduction, double bits, std::optional<double> tolerance,
                     const StepExtent& extent) {
  std::string name =
      reduction == 1 ? "the field" : fmt::format("the field reduced by {}", reduction);
  if (tolerance) name += fmt::format(" within {:.3g} of its range", *tolerance);
  return {name, only(Tier::Field, extent.fields * bytesOfField(reduction, bits, extent.samples)),
          worthOfField(reduction, bits), [=](Config& target) {
            target.fieldReduction = reduction;
            if (tolerance) target.fieldTolerance = *tolerance;
          }};
}

Chain fieldSettings(const Config& config, const StepExtent& extent) {
  Chain all;
  for (const int reduction : choices(config.fieldReduction, config.fixed.reduction, {2, 4, 8})) {
    if (reduction < config.fieldReduction) continue;
    if (config.fieldAbsoluteError) {
      all.push_back(fieldSetting(reduction, 6.0, std::nullopt, extent));
      continue;
    }
    for (const double tolerance : choices(config.fieldTolerance, config.fixed.tolerance,
                                          {0x1p-7, 0x1p-6, 0x1p-5, 0x1p-4, 0x1p-3})) {
      if (tolerance < config.fieldTolerance) continue;
      all.push_back(fieldSetting(reduction, -std::log2(tolerance), tolerance, extent));
    }
  }
  return all;
}

/// Proxies of views: layers first, then pixels.
Chain pictureChain(const Config& config, const StepExtent& extent) {
  const auto setting = [&](ImageSize size, int layers) {
    Config made = config;
    made.layers = layers;
    const double pixels = double(size.width) * size.height * extent.views * extent.fields;
    std::string name = fmt::format("pictures of {} x {}", size.width, size.height);
    if (config.layered) name += fmt::format(", {} layers", layers);
    return Setting{name, only(Tier::Pictures, pixels * bytesOfPixel(made)), 0.0,
                   [=](Config& target) {
                     target.size = size;
                     target.layers = layers;
                   }};
  };
  Chain chain{setting(config.size, config.layers)};
  int layers = config.layers;
  if (config.layered && !config.fixed.layers && layers > 2) {
    layers = 2;
    chain.push_back(setting(config.size, layers));
  }
  for (const int part : {2, 4}) {
    if (config.fixed.size) break;
    chain.push_back(setting(
        {std::max(1, config.size.width / part), std::max(1, config.size.height / part)}, layers));
  }
  return chain;
}

/// Fields and stacks, where the tier is free.
Chain freeChain(const Config& config, const StepExtent& extent) {
  Chain all;
  Config finest = config;
  finest.fieldTolerance = 0x1p-7;
  const bool nameTaken =
      std::any_of(config.views.begin(), config.views.end(),
                  [](const ViewConfig& view) { return view.name == kFieldView; });
  for (Setting& setting : nameTaken ? Chain{} : fieldSettings(finest, extent)) {
    setting.apply = [apply = setting.apply](Config& target) {
      target.sliced.reset();
      target.field = true;
      apply(target);
    };
    all.push_back(std::move(setting));
  }
  for (Setting& setting : stackSettings(config, extent)) all.push_back(std::move(setting));
  // From the best, whatever it takes.
  std::iter_swap(all.begin(),
                 std::max_element(all.begin(), all.end(), [](const Setting& a, const Setting& b) {
                   return a.worth < b.worth;
                 }));
  Chain chain = frontier(std::move(all));
  addCoarser(chain, config, extent);
  return chain;
}

std::vector<Chain> chainsOf(Config& config, const StepExtent& extent) {
  std::vector<Chain> chains;
  const bool freeTier = !config.fixed.proxies && config.budget.bytesPerStep && config.makesFields();
  if (freeTier) {
    config.attenuation = config.length = config.depth = config.mip = config.layered = false;
    config.reference = true;
    chains.push_back(freeChain(config, extent));
  } else {
    if (config.sliced) {
      chains.push_back(frontier(stackSettings(config, extent)));
      addCoarser(chains.back(), config, extent);
    }
    if (config.field) chains.push_back(frontier(fieldSettings(config, extent)));
  }
  if (bytesOfPixel(config) > 0.0 || config.features) chains.push_back(pictureChain(config, extent));
  return chains;
}

}  // namespace

std::vector<Level> qualityLevelsOf(const Config& given, const StepExtent& extent) {
  if (!given.budget.any()) return {{{}, given}};
  Config config = given;
  const std::vector<Chain> chains = chainsOf(config, extent);
  std::size_t length = 1;
  for (const Chain& chain : chains) length = std::max(length, chain.size());
  std::vector<Level> levels;
  for (std::size_t i = 0; i < length; ++i) {
    Level level{{{}, extent.features}, config};
    for (const Chain& chain : chains) {
      // Shorter chains go down as evenly, to end with the longest.
      const Setting& setting =
          chain[length == 1 ? 0 : (i * (chain.size() - 1) + (length - 1) / 2) / (length - 1)];
      setting.apply(level.config);
      level.name += (level.name.empty() ? "" : "; ") + setting.name;
      for (std::size_t t = 0; t < level.bytes.size(); ++t) level.bytes[t] += setting.bytes[t];
    }
    levels.push_back(std::move(level));
  }
  return levels;
}

Tier tierOf(std::string_view kind) {
  return kind == kind::kSliced || kind == kind::kSlicedFeatures ? Tier::Sliced
         : kind == kind::kField                                 ? Tier::Field
                                                                : Tier::Pictures;
}

}  // namespace vestige
