// SPDX-License-Identifier: Apache-2.0
#pragma once
// The nodes of a simulation as functions.
#include <marrow/domain/case.hpp>

#include "marrow/toolbox/phantom/phantom.hpp"
#include "shipped.hpp"

namespace simulated {

inline marrow::phantom::Bone femur(const shipped::Options& options, std::uint64_t seed = 0) {
  return shipped::call("simulate.femur", {}, options, marrow::Context(seed)).at("bone").as<marrow::phantom::Bone>();
}

inline marrow::phantom::Phantom fracture(const marrow::phantom::Bone& bone, const shipped::Options& options) {
  return shipped::call("simulate.fracture", {{"bone", shipped::item(bone)}}, options)
      .at("phantom")
      .as<marrow::phantom::Phantom>();
}

inline marrow::Volume ct(const marrow::phantom::Phantom& phantom, const shipped::Options& options,
                         std::uint64_t seed = 0) {
  return shipped::call("simulate.ct", {{"phantom", shipped::item(phantom)}}, options, marrow::Context(seed))
      .at("volume")
      .as<marrow::Volume>();
}

inline marrow::List<marrow::View> fluoroscopy(const marrow::phantom::Phantom& phantom,
                                              const marrow::List<marrow::Camera>& cameras, std::uint64_t seed) {
  return shipped::call("simulate.fluoroscopy",
                       {{"phantom", shipped::item(phantom)}, {"cameras", shipped::list(cameras, "view")}}, {},
                       marrow::Context(seed))
      .at("views")
      .as_list<marrow::View>();
}

}  // namespace simulated
