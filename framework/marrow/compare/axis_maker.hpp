// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow::compare {

/// An output that is a list over an axis, of a node that is not itself called along this axis. So it names the items.
struct AxisMaker {
  int node = -1, output = -1;
};

/// The outputs from which the items along one axis of a value have their names. All inputs of a node go in step along
/// an axis, so there may be several; they are those that need the fewest other nodes. One of them may be absent in a
/// case. Empty if each needs a cost, a projector, an optimizer or a body that is repeated: to run these takes as long
/// as a registration.
std::vector<AxisMaker> quick_makers(const Pipeline& pipeline, const Reference& value, const std::string& axis);

}  // namespace marrow::compare
