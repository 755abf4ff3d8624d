// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "explorer/features/classified_source.h"
#include "explorer/features/feature_source.h"
#include "explorer/renderer/framing.h"
#include "explorer/renderer/learned_pass.h"
#include "explorer/renderer/renderer.h"
#include "explorer/renderer/stated_error.h"
#include "explorer/renderer/view_data.h"
#include "explorer/stacks/stack_source.h"

// The inside of Renderer: renderer.cpp resolves a look and finishes the picture,
// renderer_choice.cpp finds the proxy that answers, renderer_draw.cpp draws with it. All of it runs
// in Device::run.

namespace vestige {

struct Renderer::Impl {
  std::shared_ptr<gl::Device> device;
  std::shared_ptr<const Archive> archive;
  std::unique_ptr<ViewCache> views;
  std::unique_ptr<EditPass> edit;
  std::unique_ptr<DepthLayerPass> layer;
  std::unique_ptr<AnalyticLayerPass> layered;
  std::unique_ptr<VirtualPass> virtualRays;
  std::unique_ptr<LearnedPass> learned;
  // What was asked for last. Who draws with it holds it, whatever is asked for meanwhile.
  std::shared_ptr<StackSource> stacks;
  std::shared_ptr<ClassifiedSource> classified;
  std::shared_ptr<FeatureSource> features;
  std::shared_ptr<const CustomTextures> custom;  ///< of layers

  /// Finds who answers a look without a classifier, draws and finishes.
  void answer(const Look& look, long cycle, const std::string& field,
              const std::shared_ptr<ViewData>& base, Rendered& out);
  /// Trust, size, annotations and background of a picture that is drawn. `viewSize`: what
  /// out.camera was made for; `function`: for the colour bar, may be null; `shown`: features
  /// for a legend in its place.
  void finish(const Look& look, const ProxyHeader& header, ImageSize viewSize,
              const TransferFunction* function, Rendered& out,
              std::span<const Feature> shown = {}) const;
  /// The viewer of a look. Multi-perspective views are looked at without their distortion, so that
  /// nothing jumps when they are turned, unless the look asks for what is stored as it is, or
  /// nothing else is.
  Camera cameraOf(const Look& look, const ViewData& base) const;
  /// A look that turns until nobody sees a difference from a stored view: as a look at that view
  /// without a turn, which sets `base` and `target`. Pictures that share a frame, as those of
  /// movies and eyes, stay turned, lest one among them be drawn another way.
  Look withoutTurn(const Look& look, long cycle, const std::string& field,
                   std::shared_ptr<ViewData>& base, Camera& target, Rendered& out);
  /// Whether a camera of pictures of `viewSize` shows no more than the stored picture does.
  static bool isStored(const Look& look, const ProxyHeader& header, const Camera& camera);
  /// The camera to draw a picture of `size` with; it is the picture's from then on.
  static Camera castCamera(ImageSize viewSize, ImageSize size, Rendered& out);
  /// The view that answers: of those that store what the look's source needs, the one that looks
  /// most nearly along the target's direction.
  std::shared_ptr<ViewData> sourceFor(const Look& look, long cycle, const std::string& field,
                                      const std::shared_ptr<ViewData>& base, const Camera& target,
                                      Rendered& out);
  /// Whether the run's own picture of the view answers: nothing that the look asks for differs from
  /// what it shows.
  bool ownPictureAnswers(const Look& look, long cycle, const std::string& field,
                         const ViewData& base, const Camera& target) const;
  void drawVolume(const Look& look, ViewData& view, const TransferFunction& function, Via via,
                  Rendered& out);
  void drawLayers(const Look& look, ViewData& view, const TransferFunction& function,
                  Rendered& out);
  void drawLearned(const Look& look, ViewData& view, const TransferFunction& function,
                   Rendered& out);
  void drawLayered(const Look& look, ViewData& view, Rendered& out);
  void drawVirtual(const Look& look, ViewData& view, const TransferFunction& function,
                   Rendered& out);
  void drawField(const Look& look, ViewData& stored, ImageSize viewSize, Rendered& out);
  /// What stacks of the step have to do with a look: nothing, the one of the view is recomposed, or
  /// they are drawn as a grid.
  enum class Stacks { None, Segments, Grid };
  Stacks stacksAnswer(const Look& look, long cycle, const std::string& field, const ViewData& base,
                      const Camera& target, Rendered& out) const;
  /// A proxy that may answer, by its name in archives, and what it states.
  struct Candidate {
    std::string_view proxy;
    StatedError error;
  };
  std::optional<StatedError> errorOf(std::string_view proxy, long cycle, const std::string& view,
                                     const std::string& field, const Asked& asked) const;
  std::optional<Candidate> otherThanField(const Look& look, long cycle, const std::string& field,
                                          const ViewData& base, Stacks sliced,
                                          const Asked& asked) const;
  /// Whether the stored field answers rather than stacks or the view's own proxies: where its
  /// stated error is less. `stated`: what of the error is known, in a sentence; may stay empty.
  bool fieldAnswers(const Look& look, long cycle, const std::string& field, const ViewData& base,
                    const Camera& target, Stacks sliced, std::string& stated) const;
  std::shared_ptr<StackSource> stacksOf(long cycle, const std::string& field);
  /// The features that a look with a classifier can be drawn from: those that it names as its
  /// field, or those that its classifier finds. Null: none of them.
  std::shared_ptr<FeatureSource> featuresOf(const Look& look, const Classifier* classifier,
                                            long cycle);
  /// Draws features as the run integrated them; `classifier` has the looks.
  void drawFeatures(const Look& look, FeatureSource& source, const Classifier* classifier,
                    long cycle, Rendered& out);
  /// Draws fields, classified anew. `base` is a view of the first of them.
  void drawClassified(const Look& look, const Classifier& classifier, long cycle, ViewData& base,
                      Rendered& out);
  std::shared_ptr<ClassifiedSource> classifiedOf(long cycle,
                                                 const std::vector<std::string>& fields);
  void drawStackSegments(const Look& look, ViewData& view, const TransferFunction& function,
                         Rendered& out);
  void drawStackGrid(const Look& look, StackSource& source, const TransferFunction& function,
                     ImageSize viewSize, Rendered& out);
  /// Of a look that customises, over the domain of layers; notes what is baked into them.
  std::shared_ptr<const CustomTextures> customOf(const Look& look, const ProxyHeader& header,
                                                 Rendered& out);
  /// The light of the view's depth layers, if the look wants any.
  std::optional<gl::Texture> lightOf(const Look& look, ViewData& view, const Rendered& out);
  void draw(const Look& look, ViewData& view, const TransferFunction& function, Rendered& out);
  /// The picture of the run's own renderer.
  static void drawReference(const ViewData& view, Rendered& out);
  ChannelTable tableOf(Via via, ViewData& view, const TransferFunction& function) const;
  Via viaOf(const Look& look, ViewData& view, Rendered& out) const;
};

/// The classifier of a look, or null.
std::unique_ptr<Classifier> classifierOf(const Look& look);
/// Throws Config naming a key that says once more what the look's classifier does.
void refuseOtherClassification(const Look& look);
/// Whether a look asks for other opacity, colour or light than the run's base, which is that of
/// the view; what it gives in the run's own numbers is no edit.
bool isEdited(const Look& look, const ViewData& view);
/// The run's base transfer function with what the look changes, or its classifier of one value.
TransferFunction functionOf(const Look& look, const ProxyHeader& header,
                            const IntervalPartition* partition);
Picture referencePicture(const ProxyImage& image);

}  // namespace vestige
