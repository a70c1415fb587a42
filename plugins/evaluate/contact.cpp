// SPDX-License-Identifier: Apache-2.0
// Bones cannot lie in one another. Where two registered bones do, one of the poses is wrong by as much.
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/field/interior.hpp"

namespace {

using namespace marrow;

template <class T>
const T& of_bone(const List<T>& list, const std::string& name, const std::string& port) {
  const T* one = list.find(name);
  if (!one)
    throw Error("poses has the bone '" + name + "', but " + port + " has not; give all of them for the same fragments");
  return *one;
}

Metrics contact(const List<Pose>& poses, const List<Mesh>& models, const List<SignedField>& fields) {
  constexpr std::size_t kPoints = 5000;
  if (poses.size() < 2)
    throw Error("there are fewer than two bones, so nothing can touch; give the poses of two at least");
  std::vector<std::vector<Eigen::Vector3d>> surfaces_mm;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    check_pose(poses[i], "the pose of '" + poses.name(i) + "'");
    const Mesh& model = of_bone(models, poses.name(i), "models");
    check_mesh(model, "the surface of '" + poses.name(i) + "'");
    surfaces_mm.push_back(sample_surface(model, kPoints));
  }
  Metrics metrics;
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      const SignedField &first = of_bone(fields, poses.name(i), "fields"),
                        &second = of_bone(fields, poses.name(j), "fields");
      const RigidTransform first_from_second = inverse(poses[i].world_from_model) * poses[j].world_from_model,
                           second_from_first = inverse(first_from_second);
      const std::string pair = poses.name(i) + "." + poses.name(j) + ".";
      metrics.items.push_back({pair + "penetration_mm",
                               std::max(field::deepest_mm(surfaces_mm[i], second, second_from_first),
                                        field::deepest_mm(surfaces_mm[j], first, first_from_second)),
                               "mm"});
      metrics.items.push_back({pair + "gap_mm",
                               std::min(field::gap_mm(surfaces_mm[i], second, second_from_first),
                                        field::gap_mm(surfaces_mm[j], first, first_from_second)),
                               "mm"});
    }
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.contact", contact)
      .summary(
          "How deep each two bones lie in one another, and how wide the gap between them is where they are nearest")
      .in("poses", "poses of the bones", over("fragment"))
      .in("models", "surfaces of the bones", over("fragment"))
      .in("fields", "signed fields of the bones; a gap wider than their band counts as the band", over("fragment"))
      .out("metrics",
           "for each pair of bones: the largest depth of a surface inside the other bone, and the gap; the gap is "
           "negative where they lie in one another")
      .figures({"*.penetration_mm", "*.gap_mm"});
}
