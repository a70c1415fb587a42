// SPDX-License-Identifier: Apache-2.0
#include "wrong.hpp"

namespace {

using marrow::Cost;
using marrow::List;
using marrow::RigidTransform;

template <wrong::Fault fault>
class Wrong : public Cost {
 public:
  /// `grey`: of the first image, on which no such cost may depend.
  Wrong(std::shared_ptr<const Cost> right, double grey) : right_(std::move(right)), grey_(grey) {}

  double value(const RigidTransform& world_from_model) const override {
    RigidTransform pose = world_from_model;
    if (fault == "shifted") pose.translation_mm.x() += 2.5;
    if (fault == "flat") pose.rotation = marrow::rotation_from_vector({0.2, -0.15, 0.3});
    if (fault == "careless" && !right_->nothing_compared(pose).empty()) return std::nan("");
    return right_->value(pose) + (fault == "changing" ? 1e-9 * wrong::next_call() : 0) +
           (fault == "moved" ? 1e-6 * grey_ : 0);
  }
  std::vector<double> values(const std::vector<RigidTransform>& poses) const override {
    std::vector<double> all = Cost::values(poses);
    if (fault == "unordered") std::swap(all.front(), all.back());
    return all;
  }
  std::shared_ptr<const Cost> at_level(const marrow::CostLevel& level) const override {
    marrow::CostLevel used = level;
    if (fault == "levels") used.pixel_step = 1000;
    return std::make_shared<Wrong>(right_->at_level(used), grey_);
  }
  std::optional<Expansion> expansion(const RigidTransform& pose, const marrow::FragmentFrame& frame) const override {
    std::optional<Expansion> about = right_->expansion(pose, frame);
    if (fault == "steep" && about) about->gradient.head<3>() *= marrow::radians(1);  // as if motions were degrees
    return about;
  }
  std::string nothing_compared(const RigidTransform& pose) const override { return right_->nothing_compared(pose); }

 private:
  std::shared_ptr<const Cost> right_;
  double grey_;
};

template <wrong::Fault fault>
std::shared_ptr<const Cost> make(const marrow::RadiographProjector& projector, const List<marrow::View>& views,
                                 const List<marrow::Pose>* others,
                                 const List<marrow::RadiographProjector>* other_projectors) {
  List<marrow::View> seen;
  for (marrow::View view : views) {
    if (fault == "unmasked") view.mask = cv::Mat();
    seen.add(view.name, view);
  }
  // The projector lives as long as this node's inputs.
  marrow::node_test::Inputs inputs{
      {"projector", marrow::Value::of<marrow::RadiographProjector>(
                        std::shared_ptr<const marrow::RadiographProjector>(std::shared_ptr<void>(), &projector))},
      {"views", marrow::node_test::list(seen, "view")}};
  if (!(fault == "alone") && others && other_projectors) {
    inputs["others"] = marrow::node_test::list(*others, "fragment");
    inputs["other_projectors"] = marrow::node_test::list(*other_projectors, "fragment");
  }
  const double grey = views.empty() ? 0 : cv::mean(views[0].image.pixels)[0];
  return std::make_shared<Wrong<fault>>(
      wrong::right_function<Cost>("similarity.normalised_cross_correlation", "cost", inputs), grey);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "shifted", "careless", "moved", "changing", "unordered", "unmasked", "flat", "levels",
                 "steep", "alone">(
      plugin, "similarity", []<wrong::Fault fault>() { return &make<fault>; },
      [](auto&& node) {
        node.trait("unmoved_by_gain")
            .trait("derivatives")
            .in("projector", "makes radiographs")
            .in("views", "views", marrow::over("view"))
            .in("others", "poses", marrow::over("fragment"))
            .in("other_projectors", "projectors", marrow::over("fragment"))
            .out("cost", "how badly radiograph and image agree");
      });
}
