// SPDX-License-Identifier: Apache-2.0
#pragma once
// The nodes of a simulation as functions, and bodies whose path lengths and volumes are known.
#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"
#include "tests/harness/node_test.hpp"
#include "tests/harness/threads.hpp"

namespace marrow::test::simulated {

using phantom::Body, phantom::Bone, phantom::ClutteredPhantom, phantom::Fragment, phantom::Phantom;

inline Bone femur(const Options& options = {}, std::uint64_t seed = 0) {
  return output<Bone>("simulate.femur", "bone", {}, options, Context(seed));
}
inline Phantom fracture(const Bone& bone, const Options& options = {}) {
  return output<Phantom>("simulate.fracture", "phantom", {{"bone", item(bone)}}, options);
}
inline Volume ct(const Phantom& phantom, const Options& options, std::uint64_t seed = 0) {
  return output<Volume>("simulate.ct", "volume", {{"phantom", item(phantom)}}, options, Context(seed));
}
inline ClutteredPhantom cluttered(const Phantom& phantom, const Options& options) {
  return output<ClutteredPhantom>("simulate.clutter", "phantom", {{"phantom", item(phantom)}}, options);
}

/// The standard geometry: source on -y for beta 0, detector 1000 mm away, isocentre at 600 mm.
inline Camera camera(double beta_deg = 0, int size_px = 512) { return c_arm(-beta_deg, size_px); }

inline Mesh sphere(const Vector3d& centre_mm, double radius_mm, double spacing_mm) {
  const Vector3d reach = Vector3d::Constant(radius_mm + 3 * spacing_mm);
  return phantom::polygonise([=](const Vector3d& p) { return (p - centre_mm).norm() - radius_mm; }, centre_mm - reach,
                             centre_mm + reach, spacing_mm, 1);
}

/// A phantom of one whole fragment that does not move, in a thigh if it has a radius.
inline Phantom whole(Mesh outer, Mesh inner = {}, double thigh_radius_mm = 0, double fat_mm = 0) {
  Phantom phantom;
  phantom.bone.outer = std::move(outer);
  phantom.bone.inner = std::move(inner);
  phantom.bone.thigh_radius_mm = thigh_radius_mm;
  phantom.bone.fat_mm = fat_mm;
  phantom.fragments.push_back({});
  phantom.fragments[0].name = "whole";
  return phantom;
}
inline Body body(const std::string& material, const Mesh& surface) {
  return {"thing", material, surface, false, {"ct", "world"}, ""};
}

inline int grey(const View& view, int u, int v) { return view.image.pixels.at<std::uint16_t>(v, u); }
/// The same image, pixel by pixel.
inline bool same(const View& a, const View& b) {
  return a.image.pixels.type() == b.image.pixels.type() && cv::norm(a.image.pixels, b.image.pixels) == 0;
}

}  // namespace marrow::test::simulated
