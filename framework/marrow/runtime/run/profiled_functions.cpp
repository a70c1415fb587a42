// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/profile.hpp"

#include <cxxabi.h>

#include <string_view>
#include <typeinfo>

#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

/// The node that made a function.
struct Maker {
  ProfilePlace place;
  std::string node, item;

  Profile::Bar bar(const char* what) const { return Profile::Bar(place, Profile::Kind::function, node, item, what); }
};

class ProfiledOutlines : public OutlineProjector {
 public:
  ProfiledOutlines(std::shared_ptr<const OutlineProjector> made, Maker maker)
      : made_(std::move(made)), maker_(std::move(maker)) {}

  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                    double spacing_px) const override {
    const Profile::Bar bar = maker_.bar("outline");
    return made_->outline(camera, world_from_model, spacing_px);
  }

 private:
  std::shared_ptr<const OutlineProjector> made_;
  Maker maker_;
};

class ProfiledRadiographs : public RadiographProjector {
 public:
  ProfiledRadiographs(std::shared_ptr<const RadiographProjector> made, Maker maker)
      : made_(std::move(made)), maker_(std::move(maker)) {}

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    const Profile::Bar bar = maker_.bar("radiograph");
    return made_->radiograph(camera, world_from_model, grid);
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    const Profile::Bar bar = maker_.bar("radiograph of single pixels");
    return made_->radiograph(camera, world_from_model, pixels);
  }
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    const Profile::Bar bar = maker_.bar("radiograph with derivatives");
    return made_->expansion(camera, world_from_model, frame, grid);
  }
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    return made_->region(camera, world_from_model);
  }
  std::shared_ptr<const RadiographProjector> smoothed(double sigma_mm) const override {
    const Profile::Bar bar = maker_.bar("smoothed");
    std::shared_ptr<const RadiographProjector> made = made_->smoothed(sigma_mm);
    return made ? std::make_shared<ProfiledRadiographs>(std::move(made), maker_) : nullptr;
  }

 private:
  std::shared_ptr<const RadiographProjector> made_;
  Maker maker_;
};

class ProfiledOptimizer : public Optimizer {
 public:
  ProfiledOptimizer(std::shared_ptr<const Optimizer> made, Maker maker)
      : made_(std::move(made)), maker_(std::move(maker)) {}

  MinimisationResult minimise(const MinimisationProblem& problem) const override {
    const Profile::Bar bar = maker_.bar("minimise");
    MinimisationProblem shown = problem;
    shown.function = [&](const Eigen::VectorXd& x) {
      const Profile::Bar evaluation = maker_.bar("evaluation");
      return problem.function(x);
    };
    if (problem.expansion)
      shown.expansion = [&](const Eigen::VectorXd& x) {
        const Profile::Bar evaluation = maker_.bar("evaluation with derivatives");
        return problem.expansion(x);
      };
    return made_->minimise(shown);
  }

 private:
  std::shared_ptr<const Optimizer> made_;
  Maker maker_;
};

/// Whether no other file can name the class of a function: it is in an unnamed namespace or in a function, and it has
/// no second base.
bool is_hidden(const std::type_info& type) {
  const std::string_view name = type.name();
  return (name.starts_with('Z') || name.find("_GLOBAL__N_") != std::string_view::npos) &&
         dynamic_cast<const abi::__vmi_class_type_info*>(&type) == nullptr;
}

template <class Function, class Profiled>
void replace(Value& value, const Maker& maker) {
  if (value.type != TypeInfo::of<Function>()) return;
  auto made = std::static_pointer_cast<const Function>(value.data);
  const Function& function = *made;
  if (!is_hidden(typeid(function))) return;
  value.data = std::shared_ptr<const Function>(std::make_shared<Profiled>(std::move(made), maker));
}

}  // namespace

void show_calls(Value& value, const ProfilePlace& place, const std::string& node, const std::string& item) {
  for (Value& one : value.items) show_calls(one, place, node, item);
  if (!value.data) return;
  const Maker maker{place, node, item};
  replace<OutlineProjector, ProfiledOutlines>(value, maker);
  replace<RadiographProjector, ProfiledRadiographs>(value, maker);
  replace<Optimizer, ProfiledOptimizer>(value, maker);
}

}  // namespace marrow
