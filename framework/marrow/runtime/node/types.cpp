// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/node/types.hpp"

namespace marrow {

template const Content* content_of<Image>();
template const Content* content_of<Picture>();
template const Content* content_of<Volume>();
template const Content* content_of<SignedField>();
template const Content* content_of<Seeds>();
template const Content* content_of<Mesh>();
template const Content* content_of<Camera>();
template const Content* content_of<View>();
template const Content* content_of<EdgeMap>();
template const Content* content_of<ShaftLines>();
template const Content* content_of<Landmarks>();
template const Content* content_of<Pose>();
template const Content* content_of<Truth>();
template const Content* content_of<Metrics>();
template const Content* content_of<Verdict>();
template const Content* content_of<Stop>();
template const Content* content_of<Scene>();
template const Content* content_of<Landscape>();
template const Content* content_of<Case>();
template const Content* content_of<Calibration>();

}  // namespace marrow
