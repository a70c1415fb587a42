// SPDX-License-Identifier: Apache-2.0
#pragma once
// The value types that all plugins share. A plugin registers the types of its own namespace itself.
#include "marrow/base/export.hpp"
#include "marrow/domain/calibration.hpp"
#include "marrow/domain/case.hpp"
#include "marrow/domain/features.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/domain/landmarks.hpp"
#include "marrow/domain/scene.hpp"
#include "marrow/domain/stop.hpp"
#include "marrow/domain/verdict.hpp"
#include "marrow/runtime/node/value.hpp"

MARROW_VALUE_TYPE(marrow::Image, "image", 1)
MARROW_VALUE_TYPE(marrow::Picture, "picture", 1)
MARROW_VALUE_TYPE(marrow::Volume, "volume", 1)
MARROW_VALUE_TYPE(marrow::SignedField, "signed_field", 1)
MARROW_VALUE_TYPE(marrow::Seeds, "seeds", 1)
MARROW_VALUE_TYPE(marrow::Mesh, "mesh", 1)
MARROW_VALUE_TYPE(marrow::Camera, "camera", 1)
MARROW_VALUE_TYPE(marrow::View, "view", 1)
MARROW_VALUE_TYPE(marrow::EdgeMap, "edge_map", 1)
MARROW_VALUE_TYPE(marrow::ShaftLines, "shaft_lines", 2)
MARROW_VALUE_TYPE(marrow::Landmarks, "landmarks", 1)
MARROW_VALUE_TYPE(marrow::Pose, "pose", 3)
MARROW_VALUE_TYPE(marrow::Truth, "truth", 1)
MARROW_VALUE_TYPE(marrow::Metrics, "metrics", 1)
MARROW_VALUE_TYPE(marrow::Verdict, "verdict", 1)
MARROW_VALUE_TYPE(marrow::Stop, "stop", 1)
MARROW_VALUE_TYPE(marrow::Scene, "scene", 1)
MARROW_VALUE_TYPE(marrow::Landscape, "landscape", 1)
MARROW_VALUE_TYPE(marrow::Case, "case", 1)
MARROW_VALUE_TYPE(marrow::Calibration, "calibration", 1)
MARROW_FUNCTION_TYPE(marrow::OutlineProjector, "outline_projector", 1)
MARROW_FUNCTION_TYPE(marrow::RadiographProjector, "radiograph_projector", 1)
MARROW_FUNCTION_TYPE(marrow::Cost, "cost", 1)
MARROW_FUNCTION_TYPE(marrow::Optimizer, "optimizer", 1)

namespace MARROW_EXPORT marrow {
extern template const Content* content_of<Image>();
extern template const Content* content_of<Picture>();
extern template const Content* content_of<Volume>();
extern template const Content* content_of<SignedField>();
extern template const Content* content_of<Seeds>();
extern template const Content* content_of<Mesh>();
extern template const Content* content_of<Camera>();
extern template const Content* content_of<View>();
extern template const Content* content_of<EdgeMap>();
extern template const Content* content_of<ShaftLines>();
extern template const Content* content_of<Landmarks>();
extern template const Content* content_of<Pose>();
extern template const Content* content_of<Truth>();
extern template const Content* content_of<Metrics>();
extern template const Content* content_of<Verdict>();
extern template const Content* content_of<Stop>();
extern template const Content* content_of<Scene>();
extern template const Content* content_of<Landscape>();
extern template const Content* content_of<Case>();
extern template const Content* content_of<Calibration>();
}  // namespace marrow
