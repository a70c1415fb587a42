// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/store/store.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// The kept result of the same node that differs least from `now` in what its key is made from. Why the node runs again
/// is what differs. An input that is as it was the `last` time is no reason, so results with another one are taken only
/// if there are no others: they may be of another item. Of equally near ones it is the last one, or else the latest in
/// `kept`. nullptr if no result of the node is kept.
const Provenance* nearest_result(const std::vector<Store::Last>& kept, const Store::Last& last, const Provenance& now);

}  // namespace marrow
