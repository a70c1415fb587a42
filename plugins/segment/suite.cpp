// SPDX-License-Identifier: Apache-2.0
// Checks for segmentation on a hollow bone that is broken in two: a tube of cortical bone around marrow, in soft
// tissue, with an oblique cut of 1.2 mm. It is sampled on the grid of a CT, with blur and noise.
#include <marrow/plugin.hpp>
#include <random>

namespace {

using namespace marrow;
using namespace marrow::conformance;

constexpr double kOuter_mm = 12.4, kInner_mm = 7.2, kGap_mm = 1.2, kBlur_mm = 0.5, kNoise_hu = 30;
constexpr double kCortex_hu = 1300, kMarrow_hu = -40, kTissue_hu = 45;

/// The tube with its own coordinates: z runs along the tube, the cut goes through the origin.
struct Tube {
  Grid grid;
  RigidTransform tube_from_ct{"tube", "ct"};

  Eigen::Vector3d in_tube(const Eigen::Vector3d& index) const { return tube_from_ct * grid.point_from_index(index); }
};

Tube tube(bool turned) {
  Tube tube;
  tube.grid.size = {44, 44, 64};
  tube.grid.spacing_mm = {0.8, 0.8, 1.0};
  tube.grid.origin_mm = {-17, 40, 300};
  if (turned) tube.grid.direction = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, -1, 2).normalized()).toRotationMatrix();
  const Eigen::Vector3d middle = tube.grid.point_from_index({21.6, 21.3, 31.5});
  tube.tube_from_ct.rotation = tube.grid.direction.transpose();
  tube.tube_from_ct.translation_mm = -(tube.tube_from_ct.rotation * middle);
  return tube;
}

/// Height above the cut, along its normal. The fragments start at half the gap on each side.
double over_cut_mm(const Eigen::Vector3d& p) { return p.dot(Eigen::Vector3d(0.35, 0.1, 1).normalized()); }

/// A blurred step: 1 on the negative side, 0 on the positive side.
double inside(double distance_mm) { return 0.5 * std::erfc(distance_mm / (kBlur_mm * std::sqrt(2.0))); }

double hu_at(const Eigen::Vector3d& p) {
  const double radius = p.head<2>().norm(), solid = inside(radius - kOuter_mm), canal = inside(radius - kInner_mm);
  const double bone = kTissue_hu + (kCortex_hu - kTissue_hu) * solid + (kMarrow_hu - kCortex_hu) * canal;
  const double gap = inside(std::abs(over_cut_mm(p)) - 0.5 * kGap_mm);
  return bone + (kTissue_hu - bone) * gap;
}

Volume volume_of(const Tube& tube) {
  std::mt19937 random(11);
  Volume volume;
  volume.grid = tube.grid;
  for (int z = 0; z < tube.grid.size[2]; ++z)
    for (int y = 0; y < tube.grid.size[1]; ++y)
      for (int x = 0; x < tube.grid.size[0]; ++x) {
        double sum = 0;  // nearly normal: the sum of twelve uniform numbers
        for (int i = 0; i < 12; ++i) sum += double(random()) / 4294967296.0;
        volume.values.push_back(float(hu_at(tube.in_tube({double(x), double(y), double(z)})) + kNoise_hu * (sum - 6)));
      }
  return volume;
}

Value seeds_of(const Tube& tube) {
  const RigidTransform ct_from_tube = inverse(tube.tube_from_ct);
  List<Seeds> list;
  const double middle = 0.5 * (kOuter_mm + kInner_mm);
  for (const auto& [name, z] : {std::pair<std::string, double>{"proximal", 16}, {"distal", -16}}) {
    Seeds seeds{name, {}, true};
    for (const double angle : {0.3, 2.4, 4.5})
      seeds.points_mm.push_back(ct_from_tube * Eigen::Vector3d(middle * std::cos(angle), middle * std::sin(angle), z));
    list.add(name, seeds);
  }
  return Value::of<Seeds>(list, "fragment");
}

/// The outer surface of the unbroken tube, for nodes that need a template.
Mesh template_of(const Tube& tube) {
  const RigidTransform ct_from_tube = inverse(tube.tube_from_ct);
  constexpr int kAround = 64, kRings = 33;
  Mesh mesh;
  const auto add = [&](double radius, double angle, double z) {
    mesh.vertices_mm.push_back(ct_from_tube * Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), z));
  };
  for (int ring = 0; ring < kRings; ++ring)
    for (int i = 0; i < kAround; ++i) add(kOuter_mm, 2 * M_PI * i / kAround, -32 + 2.0 * ring);
  add(0, 0, -32);
  add(0, 0, 32);
  const auto at = [](int ring, int i) { return std::uint32_t(ring * kAround + i % kAround); };
  const auto low = std::uint32_t(kRings * kAround), high = low + 1;
  for (int i = 0; i < kAround; ++i) {
    for (int ring = 0; ring + 1 < kRings; ++ring) {
      mesh.triangles.push_back({at(ring, i), at(ring, i + 1), at(ring + 1, i)});
      mesh.triangles.push_back({at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i)});
    }
    mesh.triangles.push_back({at(0, i + 1), at(0, i), low});
    mesh.triangles.push_back({at(kRings - 1, i), at(kRings - 1, i + 1), high});
  }
  return mesh;
}

/// The voxels of each fragment, as another program would mark them.
Value labels_of(const Tube& tube) {
  List<Volume> masks;
  for (const auto& [name, side] : {std::pair<std::string, double>{"proximal", 1}, {"distal", -1}}) {
    Volume mask{tube.grid, {}};
    for (int z = 0; z < tube.grid.size[2]; ++z)
      for (int y = 0; y < tube.grid.size[1]; ++y)
        for (int x = 0; x < tube.grid.size[0]; ++x) {
          const Eigen::Vector3d p = tube.in_tube({double(x), double(y), double(z)});
          mask.values.push_back(p.head<2>().norm() < kOuter_mm && side * over_cut_mm(p) > 0.5 * kGap_mm);
        }
    masks.add(name, mask);
  }
  return Value::of<Volume>(masks, "fragment");
}

Inputs inputs_of(const Tube& tube) {
  return {{"volume", item(volume_of(tube))},
          {"seeds", seeds_of(tube)},
          {"template", item(template_of(tube))},
          {"label", labels_of(tube)}};
}

/// Throws NotApplicable for nodes that need a template. A template is an unbroken bone, so they cannot find the
/// fracture.
void needs_the_fracture(const Subject& subject) {
  for (const PortInfo& port : subject.info().inputs)
    if (port.name == "template" && !port.optional)
      throw NotApplicable("a template knows no fracture, and such a node cannot find one");
}

void validate(const Inputs& inputs, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  const Volume& volume = inputs.at("volume").as<Volume>();
  expect(outputs.size() == 1 && outputs[0].is_list(), "it gives no list of fields");
  for (const Value& output : outputs[0].items) {
    const SignedField& field = output.as<SignedField>();
    expect(field.grid.size == volume.grid.size && field.grid.direction == volume.grid.direction &&
               field.values_mm.size() == volume.grid.count(),
           "a field lies on another grid than the CT");
    const auto [low, high] = std::minmax_element(field.values_mm.begin(), field.values_mm.end());
    expect(
        std::all_of(field.values_mm.begin(), field.values_mm.end(), [](float value) { return std::isfinite(value); }),
        "a field is not finite");
    expect(*low < 0 && *high > 0, "a field has no inside or no outside");
  }
  const Value& wanted = inputs.at("seeds");
  if (!wanted.is_list()) return;
  expect(outputs[0].names == wanted.names, "the fields are not named and ordered as the seeds");
}

List<SignedField> fields_of(const Subject& subject, const Tube& tube) {
  const Value fields = subject.output(inputs_of(tube), "field");
  expect(fields.items.size() == 2, formatted("it gives {} fields for 2 fragments", fields.items.size()));
  return fields.as_list<SignedField>();
}

/// Calls visit(point in the tube, value of the proximal field, value of the distal field) for each voxel outside the
/// canal and away from the volume's ends.
template <class Visit>
void for_voxels(const Subject& subject, const Tube& tube, const Visit& visit) {
  const List<SignedField> fields = fields_of(subject, tube);
  for (int z = 3; z < tube.grid.size[2] - 3; ++z)
    for (int y = 0; y < tube.grid.size[1]; ++y)
      for (int x = 0; x < tube.grid.size[0]; ++x) {
        const Eigen::Vector3d p = tube.in_tube({double(x), double(y), double(z)});
        if (p.head<2>().norm() > kInner_mm) visit(p, fields[0].at(x, y, z), fields[1].at(x, y, z));
      }
}

/// 100 (1 - Dice) of the worse fragment, without the canal.
double dice_error(const Subject& subject, const Tube& tube) {
  needs_the_fracture(subject);
  long both[2] = {0, 0}, sum[2] = {0, 0};
  for_voxels(subject, tube, [&](const Eigen::Vector3d& p, float proximal, float distal) {
    const bool solid = p.head<2>().norm() < kOuter_mm;
    const bool truth[2] = {solid && over_cut_mm(p) > 0.5 * kGap_mm, solid && over_cut_mm(p) < -0.5 * kGap_mm},
               found[2] = {proximal < 0, distal < 0};
    for (int f = 0; f < 2; ++f) {
      both[f] += truth[f] && found[f];
      sum[f] += truth[f] + found[f];
    }
  });
  return 100 * (1 - std::min(2.0 * double(both[0]) / double(sum[0]), 2.0 * double(both[1]) / double(sum[1])));
}

double overlap(const Subject& subject, const Tube& tube) {
  long both = 0;
  for_voxels(subject, tube,
             [&](const Eigen::Vector3d&, float proximal, float distal) { both += proximal < 0 && distal < 0; });
  return double(both);
}

/// Percentage of the bone that the field of the other fragment contains, away from the cut.
double leak_percent(const Subject& subject, const Tube& tube) {
  needs_the_fracture(subject);
  long leaked = 0, all = 0;
  for_voxels(subject, tube, [&](const Eigen::Vector3d& p, float proximal, float distal) {
    const double height = over_cut_mm(p);
    if (p.head<2>().norm() > kOuter_mm || std::abs(height) < 1.5) return;
    ++all;
    leaked += height > 0 ? distal < 0 : proximal < 0;
  });
  return 100.0 * double(leaked) / double(all);
}

/// Distances from the true wall to the points where the fields cross zero along the grid's x axis, at least 4 mm from
/// the cut. Positive: the found bone is too thick.
std::vector<double> wall_distances(const Subject& subject, const Tube& tube) {
  const List<SignedField> fields = fields_of(subject, tube);
  std::vector<double> distances;
  for (int z = 3; z < tube.grid.size[2] - 3; ++z)
    for (int y = 0; y < tube.grid.size[1]; ++y)
      for (int x = 0; x + 1 < tube.grid.size[0]; ++x) {
        const Eigen::Vector3d p = tube.in_tube({double(x), double(y), double(z)});
        // Only where the wall is nearly perpendicular to the x axis.
        if (std::abs(over_cut_mm(p)) < 4 || std::abs(p.y()) > 6) continue;
        const SignedField& field = fields[over_cut_mm(p) > 0 ? 0 : 1];
        const double a = field.at(x, y, z), b = field.at(x + 1, y, z);
        if ((a < 0) == (b < 0)) continue;
        const double radius = tube.in_tube({x + a / (a - b), double(y), double(z)}).head<2>().norm();
        if (radius > 0.5 * (kInner_mm + kOuter_mm)) distances.push_back(radius - kOuter_mm);
      }
  expect(distances.size() > 300,
         formatted("its surface crosses the wall {} times, some 1000 expected", distances.size()));
  return distances;
}

double wall_bias(const Subject& subject, const Tube& tube) {
  const std::vector<double> distances = wall_distances(subject, tube);
  double sum = 0;
  for (const double distance : distances) sum += distance;
  return std::abs(sum / double(distances.size()));
}

double wall_distance(const Subject& subject, const Tube& tube) {
  const std::vector<double> distances = wall_distances(subject, tube);
  double sum = 0;
  for (const double distance : distances) sum += std::abs(distance);
  return sum / double(distances.size());
}

Inputs changed(const std::function<void(Volume&, List<Seeds>&)>& change) {
  const Tube bone = tube(false);
  Volume volume = volume_of(bone);
  List<Seeds> seeds = seeds_of(bone).as_list<Seeds>();
  change(volume, seeds);
  return {
      {"volume", item(volume)}, {"seeds", Value::of<Seeds>(seeds, "fragment")}, {"template", item(template_of(bone))}};
}

std::vector<Trial> trials() {
  const auto filled = [](int size, float hu) {
    return [=] {
      return changed([=](Volume& volume, List<Seeds>&) {
        volume.grid.size = {size, size, size};
        volume.values.assign(volume.grid.count(), hu);
      });
    };
  };
  const auto seeds_at = [](const Eigen::Vector3d& point) {
    return [=] {
      return changed([=](Volume&, List<Seeds>& seeds) {
        seeds = {};
        seeds.add("distal", Seeds{"distal", {point}, true});
      });
    };
  };
  return {
      {"empty_volume", filled(0, 0)},
      {"one_voxel", filled(1, 1000)},
      {"constant_air", filled(40, -1000)},
      {"constant_bone", filled(40, 1000)},
      {"nan_voxel", [] { return changed([](Volume& volume, List<Seeds>&) { volume.values[12345] = std::nanf(""); }); }},
      {"too_few_values", [] { return changed([](Volume& volume, List<Seeds>&) { volume.values.pop_back(); }); }},
      {"no_seeds", [] { return changed([](Volume&, List<Seeds>& seeds) { seeds = {}; }); }},
      {"no_points",
       [] {
         return changed([](Volume&, List<Seeds>& seeds) {
           seeds = {};
           seeds.add("distal", Seeds{"distal", {}, true});
         });
       }},
      {"seed_outside", seeds_at({1e4, 0, 0})},
      {"nan_seed", seeds_at({std::nan(""), 0, 0})},
      {"seed_in_tissue",
       [] {
         return changed([](Volume& volume, List<Seeds>& seeds) {
           seeds = {};
           seeds.add("distal", Seeds{"distal", {volume.grid.point_from_index({2, 2, 20})}, true});
         });
       }},
      {"cut_by_the_border", [] {
         return changed([](Volume& volume, List<Seeds>&) {
           const Volume whole = volume;
           volume.grid.size[0] = 22;  // half a tube
           volume.values.clear();
           for (int z = 0; z < 64; ++z)
             for (int y = 0; y < 44; ++y)
               for (int x = 0; x < 22; ++x) volume.values.push_back(whole.at(x, y, z));
         });
       }}};
}

Suite suite_of_kind() {
  Suite suite{[] { return inputs_of(tube(false)); }, validate, trials(), {}};
  // The limits are wide enough for a single global threshold, which cannot be right for cortical and spongy bone at
  // once.
  const std::string ct = "broken tube, voxels of 0.8 x 0.8 x 1 mm, noise of 30 HU";
  for (const bool turned : {false, true}) {
    const std::string prefix = turned ? "turned_" : "", of = ct + (turned ? ", rotated axes: " : ": ");
    const auto add = [&](const std::string& name, const std::string& what, double limit, const std::string& unit,
                         double (*measure)(const Subject&, const Tube&)) {
      suite.add(prefix + name, of + what, limit, unit,
                [=](const Subject& subject) { return measure(subject, tube(turned)); });
    };
    add("dice", "100 (1 - Dice) of the worse fragment", 12, "%", dice_error);
    add("wall_bias", "absolute value of the mean signed distance to the outer wall", 0.6, "mm", wall_bias);
    add("wall_distance", "mean distance to the outer wall", 0.6, "mm", wall_distance);
    add("overlap", "voxels that belong to both fragments", 0, "voxels", overlap);
    add("leak", "part of the bone that the other fragment contains", 2.5, "%", leak_percent);
  }
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("segment", suite_of_kind()); }
