// SPDX-License-Identifier: Apache-2.0
// Checks for volumes. A CT of a bone in soft tissue must stay what it is: the same grid, and the same Hounsfield units
// inside and outside, however its grid lies. A surface must become a volume of its own size, at its own place.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/analytic/body.hpp"

namespace {

using namespace marrow;
using namespace marrow::conformance;

constexpr double kBone_hu = 1200, kTissue_hu = 40, kMetal_hu = 4000;

analytic::Body bone() { return {{{1, -2, 3}, {12, 9, 17}}}; }

/// How the grid of a CT lies.
struct Place {
  std::string prefix, text;
  std::array<int, 3> size;
  Eigen::Vector3d spacing_mm;
  Eigen::Matrix3d direction;
  Eigen::Vector3d shift_mm;
};

std::vector<Place> places() {
  const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d mirrored = same;
  mirrored(0, 0) = mirrored(1, 1) = -1;
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -1, 2).normalized();
  return {{"", "voxels of 1 mm", {40, 36, 48}, {1, 1, 1}, same, {0, 0, 0}},
          {"moved_", "a grid that is moved by 300 mm", {40, 36, 48}, {1, 1, 1}, same, {-120, 40, 270}},
          {"mirrored_", "a grid with two reversed axes", {40, 36, 48}, {1, 1, 1}, mirrored, {0, 0, 0}},
          {"flat_", "voxels of 0.8 x 0.8 x 2 mm", {50, 45, 24}, {0.8, 0.8, 2}, same, {0, 0, 0}},
          {"turned_",
           "a grid with rotated axes",
           {48, 48, 52},
           {1, 1, 1},
           Eigen::AngleAxisd(0.6, axis).matrix(),
           {0, 0, 0}}};
}

analytic::Body moved(analytic::Body body, const Eigen::Vector3d& shift_mm) {
  for (analytic::Ellipsoid& part : body) part.centre_mm += shift_mm;
  return body;
}

Volume ct_at(const Place& place) {
  Grid grid = analytic::grid_of(place.size, place.spacing_mm, place.direction);
  grid.origin_mm += place.shift_mm;
  return analytic::volume_of(moved(bone(), place.shift_mm), grid, kBone_hu, kTissue_hu);
}

/// A surface that is turned and moved, in the frame of an implant.
Mesh surface(double angle_rad, const Eigen::Vector3d& shift_mm) {
  analytic::Body body{
      {shift_mm, {6, 4, 20}, Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 1, 0).normalized()).matrix()}};
  Mesh mesh = analytic::mesh_of(body);
  mesh.frame = "implant";
  return mesh;
}

Inputs inputs_of(const Volume& volume) { return {{"volume", item(volume)}, {"mesh", item(surface(0.4, {3, 5, -8}))}}; }
Inputs sample() { return inputs_of(ct_at(places()[0])); }

bool takes(const Subject& subject, const std::string& input) {
  const std::vector<PortInfo>& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [&](const PortInfo& port) { return port.name == input; });
}
void needs(const Subject& subject, const std::string& input) {
  if (!takes(subject, input)) throw NotApplicable("it takes no " + input);
}

/// The frame tells whether the node took the CT or the surface.
void validate(const Inputs& inputs, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  expect(outputs.size() == 1 && outputs[0].data, "it gives no volume");
  const Volume& volume = outputs[0].as<Volume>();
  try {
    check_volume(volume, "its volume");
  } catch (const Error& fault) {
    throw Failure(fault.what());
  }
  const Volume& ct = inputs.at("volume").as<Volume>();
  const Mesh& mesh = inputs.at("mesh").as<Mesh>();
  if (volume.grid.frame == mesh.frame) return;
  expect(volume.grid.frame == ct.grid.frame,
         "its volume is in the frame '" + volume.grid.frame + "', which is that of no input");
  expect(volume.grid.size == ct.grid.size && volume.grid.spacing_mm == ct.grid.spacing_mm &&
             volume.grid.origin_mm == ct.grid.origin_mm && volume.grid.direction == ct.grid.direction,
         "its volume lies on another grid than the CT");
}

Volume volume_from(const Subject& subject, const Inputs& inputs) {
  return subject.output(inputs, "volume").as<Volume>();
}

/// The mean absolute change of the voxels inside the bone or outside of it, at least 2 mm from its surface.
double change_hu(const Subject& subject, const Place& place, bool inside) {
  needs(subject, "volume");
  const Volume ct = ct_at(place), changed = volume_from(subject, inputs_of(ct));
  const analytic::Body body = moved(bone(), place.shift_mm);
  double sum = 0, count = 0;
  for (int z = 0; z < place.size[2]; ++z)
    for (int y = 0; y < place.size[1]; ++y)
      for (int x = 0; x < place.size[0]; ++x) {
        const double distance =
            analytic::signed_distance_mm(body, ct.grid.point_from_index({double(x), double(y), double(z)}), 5);
        if (inside ? distance > -2 : distance < 2) continue;
        sum += std::abs(double(changed.at(x, y, z)) - (inside ? kBone_hu : kTissue_hu));
        ++count;
      }
  return sum / count;
}

/// How far the size of the bone above the middle between bone and tissue is off, in percent.
double size_off_percent(const Subject& subject, const Place& place) {
  needs(subject, "volume");
  const Volume changed = volume_from(subject, inputs_of(ct_at(place)));
  double voxels = 0;
  for (const float value : changed.values)
    voxels += std::clamp((double(value) - kTissue_hu) / (kBone_hu - kTissue_hu), 0.0, 1.0);
  const Eigen::Vector3d radii = bone()[0].radii_mm;
  return 100 * std::abs(voxels * place.spacing_mm.prod() / (4 * M_PI / 3 * radii.prod()) - 1);
}

/// The bone with a screw of metal across it, in two slices.
double metal_left(const Subject& subject) {
  needs(subject, "volume");
  if (!subject.has_trait("removes_metal")) throw NotApplicable("it does not say that it removes metal");
  Volume ct = ct_at(places()[0]);
  for (const int z : {25, 26})
    for (int y = 16; y < 20; ++y)
      for (int x = 8; x < 32; ++x) ct.values[ct.grid.offset(x, y, z)] = float(kMetal_hu);
  const Volume changed = volume_from(subject, inputs_of(ct));
  return double(
      std::count_if(changed.values.begin(), changed.values.end(), [](float value) { return value > 2 * kBone_hu; }));
}

/// A surface as a volume: for each voxel the part of it that is inside.
struct Filled {
  double volume_mm3 = 0;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
};

Filled filled(const Subject& subject, const Mesh& mesh) {
  needs(subject, "mesh");
  Inputs inputs = sample();
  inputs.set("mesh", item(mesh));
  const Volume volume = volume_from(subject, inputs);
  const auto [low, high] = std::minmax_element(volume.values.begin(), volume.values.end());
  expect(*low < *high, "its volume has one value everywhere");
  Filled filled;
  double parts = 0;
  for (int z = 0; z < volume.grid.size[2]; ++z)
    for (int y = 0; y < volume.grid.size[1]; ++y)
      for (int x = 0; x < volume.grid.size[0]; ++x) {
        const double part = double(volume.at(x, y, z) - *low) / double(*high - *low);
        parts += part;
        filled.centre_mm += part * volume.grid.point_from_index({double(x), double(y), double(z)});
      }
  filled.centre_mm /= parts;
  filled.volume_mm3 = parts * volume.grid.spacing_mm.prod();
  return filled;
}

double filled_off_percent(const Subject& subject, double angle_rad, const Eigen::Vector3d& at_mm) {
  const Mesh mesh = surface(angle_rad, at_mm);
  return 100 * std::abs(filled(subject, mesh).volume_mm3 / enclosed_volume_mm3(mesh) - 1);
}

double filled_off_mm(const Subject& subject, double angle_rad, const Eigen::Vector3d& at_mm) {
  return (filled(subject, surface(angle_rad, at_mm)).centre_mm - at_mm).norm();
}

std::vector<Trial> trials() {
  const auto with_volume = [](const std::function<void(Volume&)>& change) {
    return [change] {
      Volume volume = ct_at(places()[0]);
      change(volume);
      return inputs_of(volume);
    };
  };
  const auto with_mesh = [](const std::function<void(Mesh&)>& change) {
    return [change] {
      Inputs inputs = sample();
      Mesh mesh = inputs.at("mesh").as<Mesh>();
      change(mesh);
      inputs.set("mesh", item(mesh));
      return inputs;
    };
  };
  const auto constant = [&](int size, float value) {
    return with_volume([=](Volume& volume) {
      volume.grid.size = {size, size, size};
      volume.values.assign(volume.grid.count(), value);
    });
  };
  return {{"empty_volume", constant(0, 0)},
          {"one_voxel", constant(1, 1000)},
          {"constant_air", constant(20, -1000)},
          {"constant_metal", constant(20, 5000)},
          {"nan_voxel", with_volume([](Volume& volume) { volume.values[1234] = std::nanf(""); })},
          {"too_few_values", with_volume([](Volume& volume) { volume.values.pop_back(); })},
          {"no_spacing", with_volume([](Volume& volume) { volume.grid.spacing_mm.z() = 0; })},
          {"no_surface", with_mesh([](Mesh& mesh) { mesh.vertices_mm.clear(), mesh.triangles.clear(); })},
          {"open_surface", with_mesh([](Mesh& mesh) { mesh.triangles.resize(mesh.triangles.size() / 2); })},
          {"nan_vertex", with_mesh([](Mesh& mesh) { mesh.vertices_mm[0].x() = std::nan(""); })},
          {"far_vertex", with_mesh([](Mesh& mesh) { mesh.vertices_mm[0].x() = 1e9; })}};
}

Suite suite_of_kind() {
  Suite suite{sample, validate, trials(), {}};
  for (const Place& place : places()) {
    const auto add = [&](const std::string& name, const std::string& what, double limit, const std::string& unit,
                         const std::function<double(const Subject&, const Place&)>& measure) {
      suite.add(place.prefix + name, "bone in soft tissue, " + place.text + ": " + what, limit, unit,
                [=](const Subject& subject) { return measure(subject, place); });
    };
    add("inside", "mean change of the bone, 2 mm and more inside", 25, "HU",
        [](const Subject& subject, const Place& at) { return change_hu(subject, at, true); });
    add("outside", "mean change of the tissue, 2 mm and more outside", 25, "HU",
        [](const Subject& subject, const Place& at) { return change_hu(subject, at, false); });
    add("size", "how far the size of the bone is off", 2, "%", size_off_percent);
  }
  suite.add("metal", "voxels of a screw across a bone that are left", 0, "voxels", metal_left);
  const std::tuple<std::string, double, Eigen::Vector3d> surfaces[] = {
      {"", 0, {0, 0, 0}}, {"turned_", 0.7, {0, 0, 0}}, {"moved_", 0.7, {150, -80, 40}}};
  for (const auto& [prefix, angle_rad, at_mm] : surfaces) {
    suite.add(prefix + "surface_volume", "how far the volume of a closed surface is off", 1, "%",
              [a = angle_rad, at = at_mm](const Subject& s) { return filled_off_percent(s, a, at); });
    suite.add(prefix + "surface_place", "from its middle to that of the surface", 0.05, "mm",
              [a = angle_rad, at = at_mm](const Subject& s) { return filled_off_mm(s, a, at); });
  }
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("volume", suite_of_kind()); }
