// SPDX-License-Identifier: Apache-2.0
// What the passes must make, for the pipeline around them or for the one call of a replay.
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

void Passes::find_needed_outputs() {
  std::vector<bool> needed(repetition_.alone.outputs.size());
  if (repetition_.until >= 0) needed[std::size_t(repetition_.until)] = true;
  for (const Repetition::Given& given : repetition_.given)
    if (given.carried >= 0) needed[std::size_t(given.carried)] = true;
  const auto add_needed = [&](const Reference& source) {
    if (source.node == int(index_)) needed[std::size_t(source.output / 2)] = true;
  };
  const bool is_replayed = is_replayed_inside();  // then nobody uses what the body makes
  for (const PipelineNode& user : outer_.pipeline_.nodes)
    if (!is_replayed && outer_.needed_[std::size_t(&user - outer_.pipeline_.nodes.data())])
      for (const Wire& wire : user.wires)
        for (const Reference& source : wire.sources) add_needed(source);
  for (const PipelineOutput& output : outer_.pipeline_.outputs)
    if (!is_replayed) add_needed(output.source);
  for (std::size_t i = 0; i < needed.size(); ++i)
    if (needed[i]) needed_outputs_.push_back(int(i));
}

}  // namespace marrow
