// SPDX-License-Identifier: Apache-2.0
// Which passes a replay needs.
#include <algorithm>

#include "marrow/runtime/run/passes.hpp"
#include "marrow/runtime/run/replay.hpp"

namespace marrow {

/// As RunSettings::within, of what runs once.
std::string Passes::within() const {
  const std::string& outer = outer_.settings_.within;
  return (outer.empty() ? "" : outer + "/") + node_.id;
}

/// Whether a replay is about a call in a pass of this body, or in what runs once before them.
bool Passes::is_replayed_inside() const {
  return outer_.settings_.replay && outer_.settings_.replay->leads_into(within());
}

/// Whether that call is in what runs once. A body within this one may run once, too, so that passes of its own are next
/// in the place of the call.
bool Passes::only_replays() const {
  if (!is_replayed_inside()) return false;
  const std::string& place = outer_.settings_.replay->within;
  if (place.size() == within().size()) return true;
  const std::string rest = place.substr(within().size() + 1);
  const auto is_in = [&](const std::string& pass) { return rest == pass || rest.starts_with(pass + "/"); };
  if (repetition_.is_loop) return rest.find_first_not_of("0123456789") < rest.find('/');
  return std::none_of(names_.begin(), names_.end(), is_in);
}

}  // namespace marrow
