// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proxy/camera/box.h"
#include "proxy/customization/natural_neighbours.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// A transfer function to blend to, keys as in looks; what is left out is the base function's.
struct BlendFunction {
  std::optional<std::vector<OpacityPoint>> opacity;
  std::optional<double> referenceLength;
  std::string colormap;
  std::optional<std::pair<double, double>> colorRange;
  TransferFunction over(const TransferFunction& base) const;
  friend bool operator==(const BlendFunction&, const BlendFunction&) = default;
};

/// What a seed changes of the classification around it ([Brix 2015, §3],
/// step 1). The defaults change nothing.
struct SeedParameters {
  double opacity = 1.0;   ///< factor of the extinction, [0, 1000]
  double gamma = 1.0;     ///< normalised values f in [0, 1] become f^gamma; [0.01, 100]
  glm::dvec3 shift{0.0};  ///< added to the linear colour, which is clamped; [-1, 1]
  double blend = 0.0;     ///< share of `function`, [0, 1]
  std::optional<BlendFunction> function;
  friend bool operator==(const SeedParameters&, const SeedParameters&) = default;
};

/// A primitive: a point, line, rectangle or cuboid of 1, 2, 4 or 8 seeds of equal parameters (§6).
struct SeedPrimitive {
  std::string name;
  glm::dvec3 position{0.0};  ///< world, its centre
  glm::dvec3 extent{0.0};    ///< world, its sides; a seed stands at each of its corners
  bool enabled = true;
  SeedParameters parameters;
  friend bool operator==(const SeedPrimitive&, const SeedPrimitive&) = default;
};

/// A seed of a primitive, or of a corner of the domain's box.
struct SeedPoint {
  glm::dvec3 position{0.0};  ///< world, within the box
  int primitive = -1;        ///< index; -1: a corner
  SeedParameters parameters;
};

/// Position-dependent classification [Brix 2015]: parameters of the transfer function at seeds,
/// interpolated over the domain between them and the eight corners of its box. JSON in looks and
/// TOML in situ have the same keys: docs/classification.md "Position-dependent customisation".
struct Customization {
  static constexpr std::size_t kMaxPrimitives = 256;
  static constexpr std::size_t kMaxFunctions = 3;  ///< different ones

  int resolution = 64;  ///< nodes along the longest side of the domain, 32 .. 128
  SeedMetric metric = SeedMetric::Euclidean;
  std::vector<SeedPrimitive> seeds;
  std::array<SeedParameters, 8> corners{};  ///< as Box::corner

  /// Nothing changes anywhere: no need for a volume.
  bool isNeutral() const;
  /// Values themselves are changed somewhere.
  bool hasGamma() const;
  /// The different functions of enabled seeds and of corners.
  std::vector<BlendFunction> functions() const;
  /// Corners, then the seeds of enabled primitives. Throws InvalidArgument naming a primitive whose
  /// centre is outside the box; its seeds are moved into the box.
  std::vector<SeedPoint> points(const Box& box) const;
  /// The same on the coarsest grid: for as long as a seed is dragged (§5.4).
  Customization coarse() const;
  friend bool operator==(const Customization&, const Customization&) = default;
};

nlohmann::json toJson(const Customization& customization);
/// Throws KeyError naming the key below `path` that is unknown, of a wrong type or out of range;
/// `owner` is what it belongs to ("look").
Customization customizationFromJson(const nlohmann::json& json,
                                    const std::string& path = "customization",
                                    const std::string& owner = "look");

/// Seeds on the nodes of a grid over a box, faces included: what naturalNeighbours takes. Nodes are
/// as nearly cubic as whole counts allow.
struct SeedGrid {
  glm::ivec3 nodes{1};
  std::vector<GridSeed> seeds;
  std::vector<NodeValues> rows;  ///< opacity, shift r g b; gamma, shares of the functions
  SeedMetric metric = SeedMetric::Euclidean;
};
/// Where two seeds meet on a node, the later one counts. Throws InvalidArgument for a box without
/// volume, and as Customization::points.
SeedGrid seedGrid(const Customization& customization, const Box& box);

/// What holds at a place.
struct LocalParameters {
  float opacity = 1.0f;
  glm::vec3 shift{0.0f};
  float gamma = 1.0f;
  glm::vec3 shares{0.0f};  ///< of Customization::functions
};

/// Parameters on nodes of a box, x fastest, in two parts, because many customisations need only the
/// first.
struct CustomVolume {
  Box box;
  glm::ivec3 nodes{1};
  std::vector<glm::vec4> optics;  ///< opacity, shift
  std::vector<glm::vec4> values;  ///< gamma, shares of up to three functions

  CustomVolume(const Box& box_, const SeedGrid& grid, const std::vector<NodeValues>& nodeValues);
  /// Trilinear; clamped to the box.
  LocalParameters at(glm::dvec3 world) const;
};

/// §5.2 on the CPU. Throws as seedGrid.
CustomVolume customVolume(const Customization& customization, const Box& box, int threads = 0);

}  // namespace vestige
