// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "marrow/runtime/pipeline.hpp"

namespace marrow::compare {

/// An output that is a list over an axis, of a node that is not itself called along this axis. So it names the items.
struct AxisMaker {
  int node = -1, output = -1;
};

/// The node from which the items along one axis of a value have their names. All inputs of a node go in step along an
/// axis, so there may be several; it is the one that needs the fewest other nodes. Nothing if each of them needs a
/// cost, a projector, an optimizer or a body that is repeated: to run these takes as long as a registration.
std::optional<AxisMaker> quick_maker(const Pipeline& pipeline, const Reference& value, const std::string& axis);

}  // namespace marrow::compare
