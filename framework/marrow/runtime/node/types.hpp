// SPDX-License-Identifier: Apache-2.0
#pragma once
// The value types that all plugins share. A plugin registers the types of its own namespace itself.
#include "marrow/domain/calibration.hpp"
#include "marrow/domain/case.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/domain/scene.hpp"
#include "marrow/domain/verdict.hpp"
#include "marrow/runtime/node/value.hpp"

// The types of data that all plugins share, each with its id and version, for a macro of three arguments.
#define MARROW_OWN_TYPES(OF)         \
  OF(Image, "image", 1)              \
  OF(Picture, "picture", 1)          \
  OF(Volume, "volume", 1)            \
  OF(SignedField, "signed_field", 1) \
  OF(Seeds, "seeds", 1)              \
  OF(Mesh, "mesh", 1)                \
  OF(Camera, "camera", 1)            \
  OF(View, "view", 1)                \
  OF(EdgeMap, "edge_map", 1)         \
  OF(ShaftLines, "shaft_lines", 2)   \
  OF(Landmarks, "landmarks", 2)      \
  OF(Pose, "pose", 3)                \
  OF(Truth, "truth", 1)              \
  OF(Metrics, "metrics", 1)          \
  OF(Verdict, "verdict", 1)          \
  OF(Stop, "stop", 1)                \
  OF(Scene, "scene", 1)              \
  OF(Landscape, "landscape", 1)      \
  OF(Case, "case", 1)                \
  OF(Calibration, "calibration", 1)

#define MARROW_REGISTER(Type, id, version) MARROW_VALUE_TYPE(marrow::Type, id, version)
MARROW_OWN_TYPES(MARROW_REGISTER)
#undef MARROW_REGISTER
MARROW_FUNCTION_TYPE(marrow::OutlineProjector, "outline_projector", 1)
MARROW_FUNCTION_TYPE(marrow::RadiographProjector, "radiograph_projector", 1)
MARROW_FUNCTION_TYPE(marrow::Cost, "cost", 1)
MARROW_FUNCTION_TYPE(marrow::Optimizer, "optimizer", 1)

namespace MARROW_EXPORT marrow {
#define MARROW_COMPILED_ONCE(Type, id, version) extern template const Content* content_of<Type>();
MARROW_OWN_TYPES(MARROW_COMPILED_ONCE)
#undef MARROW_COMPILED_ONCE
}  // namespace marrow
