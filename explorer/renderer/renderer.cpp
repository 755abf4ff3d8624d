// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/renderer.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "explorer/annotation/annotate.h"
#include "explorer/annotation/draw_seeds.h"
#include "explorer/annotation/ticks.h"
#include "explorer/picture/look_units.h"
#include "explorer/renderer/look_warnings.h"
#include "explorer/renderer/renderer_impl.h"
#include "explorer/stacks/stack_segments.h"
#include "explorer/volume/surface_palette.h"
#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"
#include "proxy/format/image/length_unit.h"

namespace vestige {
namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

std::string chosen(const std::string& wanted, const std::vector<std::string>& there,
                   const Archive& archive, const char* what) {
  const std::string name = "archive " + archive.directory().string();
  if (there.empty()) throw Error(ErrorCode::NotFound, name + " holds no step yet");
  if (wanted.empty()) return there.front();
  const auto found = std::find(there.begin(), there.end(), wanted);
  if (found == there.end()) {
    throw Error(ErrorCode::NotFound, name + " has no " + what + " '" + wanted + "'" +
                                         didYouMean(wanted, there) +
                                         "; there are: " + listed(there));
  }
  return *found;
}

}  // namespace

std::unique_ptr<Classifier> classifierOf(const Look& look) {
  if (look.classifier.empty()) return nullptr;
  return classifierFromJson(nlohmann::json::parse(look.classifier), "classifier");
}

/// Whether a look's classifier is a function of one value, which any proxy can be drawn with.
/// Light on surfaces of a density [Drebin 1988] is more than that.
bool isTransferFunction(const Classifier& classifier, const Look& look) {
  const bool lit = look.isLit() && !classifier.densities().empty();
  return classifier.fields().size() == 1 && !classifier.needsGradient() && !classifier.maximum() &&
         !lit;
}

/// A classifier of one value as a transfer function: opacity and colour at equal places over
/// [low, high], linear between them.
TransferFunction functionOf(const Classifier& classifier, double low, double high,
                            double referenceLength) {
  constexpr int kPlaces = 4096;
  const std::vector<ChannelOptics> optics = classifier.optics(referenceLength);
  std::vector<double> weights(optics.size());
  std::vector<OpacityPoint> points;
  std::vector<glm::dvec3> colors;
  for (int i = 0; i <= kPlaces; ++i) {
    FieldSample sample;
    sample.values[0] = low + (high - low) * i / kPlaces;
    classifier.weights(sample, sample, weights);
    ChannelOptics sum;
    for (std::size_t k = 0; k < optics.size(); ++k) {
      sum.extinction += weights[k] * optics[k].extinction;
      sum.emission += weights[k] * optics[k].emission;
    }
    points.push_back({sample.values[0], -std::expm1(-sum.extinction * referenceLength)});
    // What cannot be seen keeps its neighbour's colour, so that none is mixed in.
    const glm::dvec3 color = sum.extinction > 0.0 ? sum.emission / sum.extinction
                             : colors.empty()     ? glm::dvec3(0.0)
                                                  : linearFromSrgb(colors.back());
    colors.push_back(glm::clamp(srgbFromLinear(color), 0.0, 1.0));
  }
  return {std::move(points), referenceLength, Colormap::fromSrgb("classifier", std::move(colors)),
          low, high};
}

TransferFunction functionOf(const Look& look, const ProxyHeader& header,
                            const IntervalPartition* partition) {
  const double low = partition ? partition->low() : header.statistics.low;
  const double high = partition ? partition->high() : header.statistics.high;
  TransferFunction function =
      header.base
          ? *header.base
          : TransferFunction::ramp(low, high, std::max(header.domain.diagonal(), 1e-300) / 100.0);
  if (look.referenceLength) {
    function = TransferFunction(function.opacityPoints(), *look.referenceLength,
                                function.colormap(), function.colorLow(), function.colorHigh());
  }
  if (const auto classifier = classifierOf(look)) {
    const FieldDomain domain = fieldDomain(
        partition ? *partition : IntervalPartition::uniform(low, high, 1), header.statistics);
    const auto resolved = classifier->resolved({&domain, 1}, function.referenceLength());
    resolved->edit(look.features);
    // Values may lie beyond the partition.
    const double least = std::min(domain.low, header.statistics.low);
    const double most = std::max(domain.high, header.statistics.high);
    return functionOf(*resolved, least, most, function.referenceLength());
  }
  if (look.opacity) function.setOpacity(*look.opacity);
  if (!look.colormap.empty()) function.setColormap(Colormap::named(look.colormap));
  if (look.colorRange) function.setColorRange(look.colorRange->first, look.colorRange->second);
  if (!look.factors.empty()) {
    if (!partition || look.factors.size() != std::size_t(partition->intervals())) {
      throw Error(ErrorCode::Config,
                  "look key 'factors' holds " + std::to_string(look.factors.size()) +
                      " numbers, field '" + header.field + "' has " +
                      std::to_string(partition ? partition->intervals() : 0) + " intervals");
    }
    function.setFactors(look.factors);
  }
  return function;
}

namespace {

/// The least and the greatest time of an archive's steps, of which there is one at least.
std::pair<double, double> timesOf(const Archive& archive) {
  const std::vector<long> cycles = archive.cycles();
  const auto [first, last] = std::minmax_element(cycles.begin(), cycles.end(), [&](long a, long b) {
    return archive.timeOf(a) < archive.timeOf(b);
  });
  return {archive.timeOf(*first), archive.timeOf(*last)};
}

}  // namespace

long cycleOf(const Look& look, const Archive& archive) {
  const std::vector<long> cycles = archive.cycles();
  if (cycles.empty()) {
    throw Error(ErrorCode::NotFound, "archive " + archive.directory().string() + " holds no step");
  }
  if (look.time) {
    // Far beyond all steps every distance is the same.
    const auto [first, last] = timesOf(archive);
    const double time = std::clamp(*look.time, first, last);
    return *std::min_element(cycles.begin(), cycles.end(), [&](long a, long b) {
      return std::abs(archive.timeOf(a) - time) < std::abs(archive.timeOf(b) - time);
    });
  }
  if (!look.cycle) return cycles.back();
  if (std::find(cycles.begin(), cycles.end(), *look.cycle) != cycles.end()) return *look.cycle;
  std::string there;
  const std::size_t shown = std::min<std::size_t>(cycles.size(), 12);
  for (std::size_t i = 0; i < shown; ++i) there += (i ? ", " : "") + std::to_string(cycles[i]);
  if (shown < cycles.size()) there += ", ... " + std::to_string(cycles.back());
  throw Error(ErrorCode::NotFound, "archive " + archive.directory().string() + " has no cycle " +
                                       std::to_string(*look.cycle) + "; there are: " + there);
}

namespace {

/// The archive, read in a unit of length in which its domain fits single precision.
std::shared_ptr<const Archive> inFittingUnit(std::shared_ptr<const Archive> archive) {
  if (archive->rows().empty()) return archive;
  double unit = 1.0;
  try {
    unit = lengthUnitFor(archive->open(archive->rows().back()).header().domain);
  } catch (const Error&) {  // who needs that file will say so
  }
  if (unit == archive->lengthUnit()) return archive;
  auto scaled = std::make_shared<Archive>(*archive);
  scaled->setLengthUnit(unit);
  return scaled;
}

}  // namespace

Renderer::Renderer(std::shared_ptr<gl::Device> device, std::shared_ptr<const Archive> archive)
    : impl_(std::make_unique<Impl>()) {
  impl_->device = std::move(device);
  impl_->archive = inFittingUnit(std::move(archive));
  impl_->device->run([&] {
    impl_->views = std::make_unique<ViewCache>(*impl_->archive);
    impl_->edit = std::make_unique<EditPass>();
    impl_->layer = std::make_unique<DepthLayerPass>();
    impl_->layered = std::make_unique<AnalyticLayerPass>();
    impl_->virtualRays = std::make_unique<VirtualPass>();
    impl_->learned = std::make_unique<LearnedPass>();
  });
}

Renderer::~Renderer() {
  impl_->device->run([&] {
    impl_->features.reset();
    impl_->classified.reset();
    impl_->stacks.reset();
    impl_->custom.reset();
    impl_->learned.reset();
    impl_->virtualRays.reset();
    impl_->layered.reset();
    impl_->layer.reset();
    impl_->edit.reset();
    impl_->views.reset();
  });
}

namespace {

/// What the run's own picture is finished with: that the look names the run's values once more is
/// not in vain.
Look withoutTransferFunction(Look look) {
  look.opacity.reset();
  look.referenceLength.reset();
  look.colorRange.reset();
  look.colormap.clear();
  look.factors.clear();
  return look;
}

}  // namespace

void Renderer::Impl::answer(const Look& look, long cycle, const std::string& field,
                            const std::shared_ptr<ViewData>& baseView, Rendered& out) {
  if (!look.classifier.empty()) refuseOtherClassification(look);
  ViewData& base = *baseView;
  const bool learns = look.color == Coloring::Learned;
  const bool own = ownPictureAnswers(look, cycle, field, base, out.camera);
  const bool asStored = learns || own;
  Stacks answers =
      asStored ? Stacks::None : stacksAnswer(look, cycle, field, base, out.camera, out);
  std::string stated;
  const bool fromField =
      !asStored && fieldAnswers(look, cycle, field, base, out.camera, answers, stated);
  if (fromField) answers = Stacks::None;
  const std::shared_ptr<ViewData> source =
      fromField                        ? views->get(cycle, kFieldView, field)
      : own || answers != Stacks::None ? baseView
                                       : sourceFor(look, cycle, field, baseView, out.camera, out);
  ViewData& view = *source;
  const std::shared_ptr<StackSource> grid =
      answers == Stacks::Grid ? stacksOf(cycle, field) : nullptr;
  const ProxyHeader& header = grid ? grid->header() : view.header();
  const TransferFunction function =
      functionOf(look, header, grid ? &*header.partition : view.partition());
  const ProxyHeader& viewed = (fromField ? base : view).header();
  const ImageSize viewSize = squarePixels(viewed.size, viewed.camera.pixelAspect);
  if (learns) {
    drawLearned(look, view, function, out);
  } else if (own) {
    drawReference(view, out);
    out.notes.push_back(
        "it is exact: the look changes nothing of the run's opacity, colour and light");
  } else if (grid) {
    drawStackGrid(look, *grid, function, viewSize, out);
  } else if (answers == Stacks::Segments) {
    drawStackSegments(look, view, function, out);
  } else if (fromField) {
    drawField(look, view, viewSize, out);
  } else {
    draw(look, view, function, out);
  }
  if (!stated.empty()) out.notes.push_back(std::move(stated));
  const auto classifier = classifierOf(look);
  if (own) return finish(withoutTransferFunction(look), header, viewSize, &function, out);
  if (!classifier) return finish(look, header, viewSize, &function, out);
  classifier->edit(look.features);
  finish(look, header, viewSize, nullptr, out, classifier->features());
}

namespace {

/// The features that can be seen, or the surfaces that have colours of their own.
std::vector<LegendEntry> legendOf(const Look& look, const ProxyHeader& header,
                                  const TransferFunction* function,
                                  std::span<const Feature> features) {
  std::vector<LegendEntry> legend;
  for (const Feature& feature : features) {
    if (feature.enabled && feature.opacity > 0.0) legend.push_back({feature.name, feature.color});
  }
  if (look.draw != Draw::Isosurface || !function) return legend;
  const bool mapped = std::all_of(look.isosurfaces.begin(), look.isosurfaces.end(),
                                  [](const SurfaceLook& each) { return each.color == "map"; });
  if (mapped && !look.isosurfaces.empty()) return legend;
  for (const Isosurface& surface : surfacesOf(look, *function)) {
    legend.push_back({numberText(surface.value) + (header.units.empty() ? "" : " " + header.units),
                      surface.color, surface.opacity});
  }
  return legend;
}

/// Of what the look asks for in vain; of an empty picture where nothing else tells why. All is in
/// units of the archive, and told in the world's.
void warn(const Look& unitLook, const ProxyHeader& unitHeader, const TransferFunction* function,
          double unit, Rendered& out) {
  const Look look = withScaledLengths(unitLook, unit);
  ProxyHeader header = unitHeader;
  scaleLengths(header, unit);
  Camera camera = out.camera;
  scaleLengths(camera, unit);
  auto& warnings = out.warnings;
  for (const Warning& each : keysInVain(look, out.answer)) warnings.push_back(each);
  for (const Warning& each :
       valuesOutside(look, out.answer, header, function, camera, out.picture.size)) {
    const bool known = std::any_of(warnings.begin(), warnings.end(),
                                   [&](const Warning& other) { return other.key == each.key; });
    if (!known) warnings.push_back(each);
  }
  if (!warnings.empty()) return;
  const auto& rgba = out.picture.rgba;
  for (std::size_t i = 3; i < rgba.size(); i += 4)
    if (rgba[i] > 0.0f) return;
  warnings.push_back(nothingSeen(header, function));
}

/// The step that answers a time outside of all.
void warnOfTime(const Look& look, const Archive& archive, long cycle, Rendered& out) {
  if (!look.time) return;
  const auto [first, last] = timesOf(archive);
  if (*look.time >= first && *look.time <= last) return;
  out.warnings.push_back({"time", "no step is stored at time " + numberText(*look.time) +
                                      ", only " + numberText(first) + " .. " + numberText(last) +
                                      ": cycle " + std::to_string(cycle) + " is used"});
}

/// The part of a stored picture that the camera shows, in square pixels of the look's size.
void takeWindow(const Look& look, const ProxyHeader& header, ImageSize viewSize, Rendered& out) {
  const bool asStored = out.camera == header.camera;
  const double pixelAspect = std::exchange(out.camera.pixelAspect, 1.0);
  const ImageSize size = look.size.value_or(viewSize);
  out.camera = fittedCamera(out.camera, viewSize, size);
  const auto window =
      asStored ? std::nullopt : windowOf(header.camera, out.picture.size, out.camera, size);
  out.picture = window ? windowed(out.picture, window->low, window->high, size)
                       : fitted(out.picture, size, pixelAspect);
}

}  // namespace

void Renderer::Impl::finish(const Look& look, const ProxyHeader& header, ImageSize viewSize,
                            const TransferFunction* function, Rendered& out,
                            std::span<const Feature> shown) const {
  if (!out.trust.empty()) {
    out.shares = sharesOf(out.trust, out.picture);
    overlayTrust(out.picture, out.trust);
  } else if (look.trust) {
    out.trust.assign(out.picture.size.pixels(), Trust::Data);
  }
  const Stretch stretch(look.scale, header.domain);
  out.worldFromScene = stretch.worldFromScene();
  if (!out.cast) takeWindow(look, header, viewSize, out);
  const ImageSize size = out.picture.size;
  warn(look, header, function, archive->lengthUnit(), out);
  const AnnotationSubject subject{
      out.camera,  header.domain, stretch,
      function,    header.field,  header.units,
      header.time, header.cycle,  legendOf(look, header, function, shown)};
  if (look.annotations.box) {
    Picture behind = Picture::blank(size);
    drawBoxEdges(behind, subject, true, inkOn(look.background));
    placeOver(out.picture, behind);
    drawBoxEdges(out.picture, subject, false, inkOn(look.background));
  }
  if (look.background) placeOver(out.picture, linearFromSrgb(*look.background));
  if (look.customization && look.annotations.seeds != Seeds::None) {
    std::optional<glm::dvec4> plane;
    const glm::dvec3 ahead = out.camera.forward;
    if (look.draw == Draw::Slice) {
      plane = look.slice ? stretch.plane(*look.slice)
                         : glm::dvec4(ahead, glm::dot(ahead, header.domain.center()));
    }
    drawSeeds(out.picture, look.annotations.seeds, *look.customization, subject, plane);
  }
  // What people read is in world units.
  AnnotationSubject world = subject;
  scaleLengths(world.camera, archive->lengthUnit());
  scaleLengths(world.domain, archive->lengthUnit());
  world.stretch = Stretch(look.scale, world.domain);
  annotate(out.picture, look.annotations, world, look.background);
}

Rendered Renderer::render(const Look& worldLook) {
  worldLook.validate();
  Impl& self = *impl_;
  const double unit = self.archive->lengthUnit();
  const Look look = withScaledLengths(worldLook, 1.0 / unit);
  const Archive& archive = *self.archive;
  Rendered out;
  const long cycle = cycleOf(look, archive);
  const std::unique_ptr<Classifier> classifier = classifierOf(look);
  warnOfTime(look, archive, cycle, out);
  self.device->run([&] {
    if (const auto features = self.featuresOf(look, classifier.get(), cycle)) {
      if (look.isCustomized()) {
        throw Error(ErrorCode::Config,
                    "look key 'customization' is not for stored features: take a field");
      }
      self.drawFeatures(look, *features, classifier.get(), cycle, out);
      return;
    }
    if (!look.features.empty() && !classifier) {
      throw Error(
          ErrorCode::Config,
          "look key 'features' changes those of a classifier, but the look has none and its "
          "field is not the name of stored features");
    }
    const std::string wanted =
        look.field.empty() && classifier ? classifier->fields().front() : look.field;
    const std::string field = chosen(wanted, archive.fields(), archive, "field");
    const std::string viewName = chosen(look.view, archive.views(), archive, "view");
    std::shared_ptr<ViewData> base = self.views->get(cycle, viewName, field);
    out.camera = self.cameraOf(look, *base);
    const Look still = self.withoutTurn(look, cycle, field, base, out.camera, out);
    if (classifier && !isTransferFunction(*classifier, look)) {
      self.drawClassified(still, *classifier, cycle, *base, out);
    } else {
      self.answer(still, cycle, field, base, out);
    }
  });
  scaleLengths(out.camera, unit);
  out.worldFromScene[3] = glm::dvec4(glm::dvec3(out.worldFromScene[3]) * unit, 1.0);
  for (float& depth : out.depth) depth = float(double(depth) * unit);
  return out;
}

namespace {

/// A classifier with its defaults filled in from the fields of an archive's step.
std::string resolvedClassifier(const Classifier& classifier, const Archive& archive, long cycle,
                               double referenceLength) {
  std::vector<FieldDomain> domains;
  for (const std::string& field : classifier.fields()) {
    const auto& rows = archive.rows();
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const ArchiveRow& each) {
      return each.cycle == cycle && each.field == field;
    });
    if (row == rows.end()) {
      throw Error(ErrorCode::NotFound, "cycle " + std::to_string(cycle) + " of archive " +
                                           archive.directory().string() + " has no field '" +
                                           field + "'");
    }
    const ProxyHeader header = archive.open(*row).header();
    const FieldStatistics& statistics = header.statistics;
    domains.push_back(fieldDomain(
        header.partition ? *header.partition
                         : IntervalPartition::uniform(statistics.low, statistics.high, 1),
        statistics));
  }
  return classifier.resolved(domains, referenceLength)->json().dump();
}

}  // namespace

Look Renderer::resolved(const Look& look) {
  look.validate();
  Impl& self = *impl_;
  const Archive& archive = *self.archive;
  const auto classifier = classifierOf(look);
  Look result = look;
  result.cycle = cycleOf(look, archive);
  result.time.reset();
  const std::string wanted =
      look.field.empty() && classifier ? classifier->fields().front() : look.field;
  result.field = chosen(wanted, archive.fields(), archive, "field");
  result.view = chosen(look.view, archive.views(), archive, "view");
  if (!classifier && FeatureSource::has(archive, *result.cycle, result.field)) return result;
  self.device->run([&] {
    const auto view = self.views->get(*result.cycle, result.view, result.field);
    const double unit = archive.lengthUnit();
    Look plain = withScaledLengths(look, 1.0 / unit);
    plain.classifier.clear();
    plain.features.clear();
    plain.factors.clear();
    const TransferFunction function = functionOf(plain, view->header(), view->partition());
    result.referenceLength = function.referenceLength() * unit;
    if (classifier) {
      result.classifier =
          resolvedClassifier(*classifier, archive, *result.cycle, *result.referenceLength);
      return;
    }
    result.opacity = function.opacityPoints();
    result.colorRange = {function.colorLow(), function.colorHigh()};
    const auto names = Colormap::names();
    const std::string& name = function.colormap().name();
    if (std::find(names.begin(), names.end(), name) != names.end()) result.colormap = name;
  });
  return result;
}

std::optional<Renderer::OwnLook> Renderer::ownLook(const Look& look) {
  if (!look.classifier.empty() || !look.features.empty()) return std::nullopt;
  Impl& self = *impl_;
  const Archive& archive = *self.archive;
  const long cycle = cycleOf(look, archive);
  const std::string field = chosen(look.field, archive.fields(), archive, "field");
  OwnLook own{chosen(look.view, archive.views(), archive, "view"), {}, {}};
  bool both = false;
  self.device->run([&] {
    if (FeatureSource::has(archive, cycle, field)) return;
    const std::shared_ptr<ViewData> stored = self.views->get(cycle, own.view, field);
    ViewData& view = *stored;
    if (!view.has(kind::kSliced) || !view.has(kind::kReference)) return;
    const ProxyImage reference = view.image(kind::kReference);
    const ProxyHeader& header = view.stack().header;
    if (!reference.header.shading.empty() || reference.header.customization || !header.base ||
        reference.header.camera != header.camera || reference.header.size != header.size) {
      return;
    }
    const FineChannels channels(*header.partition);
    own.stored = referencePicture(reference);
    own.made = self.edit->render(view.stackSegments(channels.parts(), Uncertain::Likely),
                                 channels.table(*header.base));
    both = true;
  });
  return both ? std::optional(std::move(own)) : std::nullopt;
}

}  // namespace vestige
