// SPDX-License-Identifier: Apache-2.0
// A cost of the images together with what is known about bones beside each other: they cannot lie in one another, and
// the gap of a joint may be known.
#include <algorithm>
#include <cmath>
#include <marrow/base/names.hpp>
#include <marrow/plugin.hpp>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "cost_noise.hpp"
#include "marrow/toolbox/field/interior.hpp"
#include "marrow/toolbox/match/bones_together.hpp"

namespace {

using namespace marrow;
using namespace similarity;

/// See the help texts of similarity.with_contact.
struct ContactOptions {
  double penetration_deviation_mm = 0.2;
  std::vector<std::string> joint;
  double joint_width_mm = 0;
  double joint_deviation_mm = 0.5;
};

/// Another bone: its signed field, which must outlive this, and where it is.
struct Neighbour {
  std::string name;
  const SignedField* bone = nullptr;
  RigidTransform world_from_bone;
  bool is_joined = false;  ///< whether the gap to it is known
};

/// A bone's surface among its neighbours.
class Contact {
 public:
  Contact(std::vector<Eigen::Vector3d> surface_mm, std::vector<Neighbour> neighbours, const ContactOptions& options)
      : surface_mm_(std::make_shared<const std::vector<Eigen::Vector3d>>(std::move(surface_mm))),
        neighbours_(std::move(neighbours)),
        options_(options) {}

  /// For each neighbour the penetration, and for a joined one the gap minus the joint's width, both in units of their
  /// deviations. Half the sum of their squares is minus the logarithm of a normal density, without a constant.
  std::vector<double> residuals(const RigidTransform& world_from_model) const;
  /// The same with the neighbours in other poses; one that is not in the list stays where it is.
  Contact with_others(const List<RigidTransform>& world_from_others) const;

 private:
  std::shared_ptr<const std::vector<Eigen::Vector3d>> surface_mm_;
  std::vector<Neighbour> neighbours_;
  ContactOptions options_;
};

std::vector<double> Contact::residuals(const RigidTransform& world_from_model) const {
  std::vector<double> residuals;
  for (const Neighbour& one : neighbours_) {
    const RigidTransform bone_from_model = inverse(one.world_from_bone) * world_from_model;
    residuals.push_back(field::penetration_mm(*surface_mm_, *one.bone, bone_from_model) /
                        options_.penetration_deviation_mm);
    if (one.is_joined)
      residuals.push_back((field::gap_mm(*surface_mm_, *one.bone, bone_from_model) - options_.joint_width_mm) /
                          options_.joint_deviation_mm);
  }
  return residuals;
}

Contact Contact::with_others(const List<RigidTransform>& world_from_others) const {
  Contact contact = *this;
  for (Neighbour& one : contact.neighbours_)
    if (const RigidTransform* pose = world_from_others.find(one.name)) one.world_from_bone = *pose;
  return contact;
}

struct Options : ContactOptions {
  double noise_times = 2;
};

/// The contact counts the same at each level of the cost.
class WithContact : public Cost, public match::CostAmongOthers {
 public:
  /// `noise`: the weight of a unit of the contact's negative log-likelihood. `noise_times`: how many times larger the
  /// images' noise is than their blocks show. `owner`, or the runtime, keeps `images`.
  WithContact(Contact contact, double noise, double noise_times, const Cost& images, std::shared_ptr<const Cost> owner)
      : contact_(std::move(contact)),
        noise_(noise),
        noise_times_(noise_times),
        images_(images),
        owner_(std::move(owner)) {}

  double value(const RigidTransform& pose) const override { return images_.value(pose) + term(pose); }
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    const std::shared_ptr<const Cost> images = images_.at_level(level);
    return std::make_shared<WithContact>(contact_, noise_, noise_times_, *images, images);
  }
  std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const override {
    const std::shared_ptr<const Cost> images = match::among_others(images_, world_from_others);
    return std::make_shared<WithContact>(contact_.with_others(world_from_others), noise_, noise_times_,
                                         images ? *images : images_, images ? images : owner_);
  }

  /// What the images alone say: contact says something about every pose.
  std::string nothing_compared(const RigidTransform& pose) const override { return images_.nothing_compared(pose); }
  std::vector<std::string> silent_views(const RigidTransform& pose) const override {
    return images_.silent_views(pose);
  }

  /// The blocks of the images, and the residuals of the contact, each with its expected size, as with a prior
  /// (with_prior.cpp).
  std::vector<double> without_each_block(const RigidTransform& pose) const override {
    std::vector<double> without = images_.without_each_block(pose);
    if (without.empty()) return without;
    const double images = images_.value(pose), whole = images + term(pose);
    for (double& value : without) value = whole + std::sqrt(noise_times_) * (value - images);
    for (const double residual : contact_.residuals(pose)) without.push_back(whole + noise_ * residual);
    return without;
  }

 private:
  double term(const RigidTransform& pose) const {
    const std::vector<double> r = contact_.residuals(pose);
    return 0.5 * noise_ * std::inner_product(r.begin(), r.end(), r.begin(), 0.0);
  }

  Contact contact_;
  double noise_, noise_times_;
  const Cost& images_;
  std::shared_ptr<const Cost> owner_;
};

/// Throws Error unless the joint is none, or two of the bones, with a width that the field of the other one can tell.
void check_joint(const Options& options, const std::vector<std::string>& bones) {
  if (options.joint.empty()) return;
  if (options.joint.size() != 2)
    throw Error(formatted("joint names {} bones; name the two whose gap is known, or none", options.joint.size()));
  for (const std::string& name : options.joint)
    if (std::find(bones.begin(), bones.end(), name) == bones.end())
      throw Error("joint: there is no bone '" + name + "'; " + suggestion(name, bones));
}

void check_reach(const Neighbour& one, double width_mm) {
  const double known_mm = double(*std::max_element(one.bone->values_mm.begin(), one.bone->values_mm.end()));
  if (known_mm <= width_mm)
    throw Error(
        formatted("joint_width_mm is {:g}, but the field of '{}' knows distances up to {:g} mm only; raise band_mm of "
                  "its segmentation",
                  width_mm, one.name, known_mm));
}

std::vector<Neighbour> neighbours_of(const SignedField& bone, const List<Pose>& poses,
                                     const List<SignedField>& other_bones, const Options& options) {
  std::vector<Neighbour> neighbours;
  std::string own;
  for (std::size_t i = 0; i < other_bones.size(); ++i)
    if (&other_bones[i] == &bone) own = other_bones.name(i);
  for (std::size_t i = 0; i < other_bones.size(); ++i) {
    const std::string& name = other_bones.name(i);
    if (name == own) continue;
    const Pose* pose = poses.find(name);
    if (!pose)
      throw Error("other_bones has '" + name + "', but poses has none of it; give the poses of the same fragments");
    check_pose(*pose, "the pose of '" + name + "'");
    if (other_bones[i].grid.frame != pose->world_from_model.source)
      throw Error("other_bones: '" + name + "' is in frame '" + other_bones[i].grid.frame + "', but its pose takes '" +
                  pose->world_from_model.source + "'; give the field of the bone that was registered");
    const auto is_in_joint = [&](const std::string& one) {
      return std::find(options.joint.begin(), options.joint.end(), one) != options.joint.end();
    };
    neighbours.push_back({name, &other_bones[i], pose->world_from_model, is_in_joint(own) && is_in_joint(name)});
    if (neighbours.back().is_joined) check_reach(neighbours.back(), options.joint_width_mm);
  }
  return neighbours;
}

std::shared_ptr<const Cost> with_contact(const Cost& cost, const Pose& found, const Mesh& model,
                                         const SignedField& bone, const List<Pose>& poses,
                                         const List<SignedField>& other_bones, const Options& options) {
  constexpr std::size_t kPoints = 2000;
  similarity::check_found(found);
  check_mesh(model, "the surface of the bone");
  check_joint(options, other_bones.names());
  return std::make_shared<WithContact>(
      Contact(sample_surface(model, kPoints), neighbours_of(bone, poses, other_bones, options), options),
      options.noise_times * similarity::noise_of(cost, found), options.noise_times, cost, nullptr);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.with_contact", with_contact)
      .summary(
          "A cost together with contact: bones do not lie in one another, and the gap of a joint may be known. For "
          "register.together")
      .in("cost", "cost of the images alone")
      .in("found",
          "pose found by the same cost alone, with its covariance: how much the cost rises there within a standard "
          "deviation says what contact counts")
      .in("model", "surface of the bone")
      .in("field", "signed field of the bone; it identifies the bone in other_bones")
      .in("poses", "poses of all bones", over("fragment"))
      .in("other_bones", "signed fields of the other bones, and maybe of this one", over("fragment"))
      .out("cost", "the cost, plus minus the logarithm of the contact's density in units of the cost's likelihood")
      .option(
          "penetration_deviation_mm", &Options::penetration_deviation_mm,
          "how deep two segmented bones may lie in one another by the errors of their surfaces: a standard deviation",
          at_least(0.001), at_most(100))
      .option("joint", &Options::joint, "names of two bones the gap between which is known; none: no joint")
      .relation(distinct("joint"))
      .option("joint_width_mm", &Options::joint_width_mm, "the gap between them, where they are nearest", at_least(0),
              at_most(50))
      .option("joint_deviation_mm", &Options::joint_deviation_mm, "standard deviation of this gap", at_least(0.001),
              at_most(100))
      .option("noise_times", &Options::noise_times,
              "how many times larger the noise of the images' cost is than the deviations of the pose found say: these "
              "come from blocks of the images, and do not see an error that is common to several blocks",
              at_least(0.01), at_most(1000));
}
