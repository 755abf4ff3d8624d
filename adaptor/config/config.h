// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "adaptor/config/classifier_config.h"
#include "adaptor/ingest/field_view.h"
#include "proxy/archive/archive.h"
#include "proxy/camera/camera.h"
#include "proxy/customization/customization.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// [[field]]: a scalar to be stored (docs/for-simulation-developers.md has every key).
struct FieldConfig {
  enum class Range { FirstStep, EachStep, Fixed };
  enum class Isovalues { Automatic, Peaks, Bounds, Even, Explicit };

  std::string name;    ///< in the archive; "" = made of source and derivation
  std::string source;  ///< as published
  std::optional<int> component;
  bool magnitude = false;  ///< neither: the scalar, or the magnitude of a vector
  bool gradient = false;
  /// Not empty: no source; the multi-field gradient norm of these fields (FieldSample::gradient).
  std::vector<std::string> gradientNorm;
  std::optional<std::string> units;

  Range range = Range::FirstStep;
  double low = 0.0, high = 0.0;  ///< Range::Fixed
  int intervals = 16;
  std::vector<double> bounds;  ///< empty: from range and intervals
  bool quantiles = false;
  std::vector<ValueRange> noData;  ///< values that stand for no data

  std::vector<OpacityPoint> opacity;  ///< empty: the default ramp
  std::string colormap = "viridis";
  std::optional<std::pair<double, double>> colorRange;  ///< default: the partition's

  Isovalues isovalueRule = Isovalues::Automatic;
  std::vector<double> isovalues;  ///< Isovalues::Explicit
  int isovalueCount = 4;          ///< Isovalues::Even
};

/// [[view]]: a set by name, or one camera.
struct ViewConfig {
  std::string set;   ///< of viewSet(); "" = explicit
  std::string name;  ///< of an explicit camera
  Projection projection = Projection::Orthographic;
  double fieldOfView = 0.5;  ///< radians
  double convergence = 1.0;  ///< κ of multi-perspective views
  std::optional<glm::dvec3> position, target, direction, up;
  std::optional<double> height, nearDepth, farDepth;
};

/// [trigger]: any one that fires stores the step; none at all stores every step.
struct TriggerConfig {
  enum class Measure { Mean, Deviation, Low, High, Histogram };
  struct Change {
    std::string field;  ///< of the archive
    Measure measure = Measure::Mean;
    double threshold = 0.0;
    long everyCycles = 1;  ///< how often to look
  };
  long everyCycles = 0;    ///< 0: not set
  double everyTime = 0.0;  ///< 0: not set
  std::optional<Change> change;
};

/// [sliced]: stacks of depth slabs (method §5).
struct SlicedConfig {
  std::string stacks = "axes";  ///< "views", or a set of viewSet(); opposite views count once
  int pixels = 512;             ///< most along a side of a stack of a set
  int slabs = 20;
  int levels = 32;  ///< of a ray's stretch in a slab
};

/// Keys that the configuration gives: [budget] leaves them as they are.
struct FixedKeys {
  bool proxies = false, size = false, layers = false;
  bool stacks = false, pixels = false, slabs = false, levels = false;
  bool reduction = false, tolerance = false;
  bool cadence = false;  ///< [trigger]
};

/// [training]: pictures that the explorer learns colours from [Tikhonova 2010, §6.2].
struct TrainingConfig {
  int pictures = 3;           ///< of each view: the base function's, and under changed opacities
  double scale = 0.1;         ///< of the opacities that are changed
  std::optional<bool> light;  ///< lit; empty: as the reference picture
};

/// [budget]
struct BudgetConfig {
  std::optional<std::uint64_t> bytesPerStep;  ///< of the EXRs and previews of a stored step
  std::optional<double> timeShare;            ///< of the run's wall time, 0 < share <= 1
  bool any() const { return bytesPerStep || timeShare; }
};

/// What to make of a run.
struct Config {
  /// Of a step, in all views: 4096 pictures of 512 x 512, or four of the largest size. That is an
  /// hour of marching and tens of gigabytes of proxies; more is a slip of the pen.
  static constexpr int kMostViews = 4096;
  static constexpr std::uint64_t kMostPixels = std::uint64_t(1) << 30;

  std::string output = "vestige.cdb";
  ExistingArchive existing = ExistingArchive::Refuse;
  glm::dvec3 background{0.0};  ///< of previews, sRGB
  bool transparentBackground = false;
  bool previews = true;
  std::string note, owner;  ///< free texts of every proxy

  std::string glBackend = "auto";
  int threads = 0;  ///< 0: all processors

  ImageSize size;
  bool attenuation = true, length = true, depth = true, mip = true, reference = true;
  bool layered = false;
  int layers = 4;                        ///< of the layered proxy
  std::optional<glm::dvec3> layerLight;  ///< direction of a light that casts shadows in its colours
  bool field = false;                    ///< the reduced field
  int fieldReduction = 1;                ///< samples averaged along each axis
  double fieldTolerance = 1e-2;          ///< as a share of the field's range at each step ...
  std::optional<double> fieldAbsoluteError;  ///< ... or in the field's units
  bool phong = false;
  double stepLength = 0.0;       ///< world; 0 = the smallest spacing
  double referenceLength = 0.0;  ///< world; 0 = the domain's diagonal / 100 (method §1)

  std::optional<SlicedConfig> sliced;
  bool features = false;                       ///< of each classifier, flat
  std::optional<SlicedConfig> slicedFeatures;  ///< and in stacks of slabs
  BudgetConfig budget;
  FixedKeys fixed;
  std::optional<TrainingConfig> training;
  /// By position, of what the base function and MIP make; none where it would change nothing.
  std::optional<Customization> customization;

  TriggerConfig trigger;
  std::vector<ViewConfig> views;    ///< empty: front
  std::vector<FieldConfig> fields;  ///< empty: every published field
  std::vector<ClassifierConfig> classifiers;
  bool dryRun = false;

  /// Whether anything is made of single fields.
  bool makesFields() const {
    return attenuation || length || depth || mip || reference || layered || field || sliced ||
           training;
  }
};

/// Parses TOML; `origin` names it in errors ("run.toml"). Throws Config: "run.toml:12: ...", with
/// the nearest known key where a key is unknown.
Config configFromText(const std::string& text, const std::string& origin);
/// Reads a whole text file; throws NotFound or Io.
std::string readTextFile(const std::string& path);

}  // namespace vestige
