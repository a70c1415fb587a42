// SPDX-License-Identifier: Apache-2.0
// Circles of nodes that wait for each other.
#include <algorithm>
#include <map>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {
namespace {

struct WaitedFor {
  std::string port;
  std::size_t node;
};

/// Which nodes wait for which. Nodes can be taken out.
class WaitingNodes {
 public:
  explicit WaitingNodes(const WrittenPipeline& written)
      : sources_(written.nodes.size()),
        users_(sources_.size()),
        waits_for_(sources_.size()),
        is_left_(sources_.size(), true) {
    std::map<std::string, std::size_t> index;
    for (std::size_t i = 0; i < sources_.size(); ++i) index.emplace(written.nodes[i].id, i);
    for (std::size_t i = 0; i < sources_.size(); ++i)
      for (const auto& [port, value] : written.nodes[i].wires) {
        const auto add = [&, i, name = port](const YAML::Node& reference) {
          if (!reference.IsScalar()) return;
          const auto found = index.find(reference.Scalar().substr(0, reference.Scalar().find('.')));
          if (found == index.end()) return;
          sources_[i].push_back({name, found->second});
          users_[found->second].push_back(i);
          ++waits_for_[i];
        };
        if (value.value.IsSequence())
          for (const YAML::Node& item : value.value) add(item);
        else
          add(value.value);
      }
    for (std::size_t i = 0; i < sources_.size(); ++i)
      if (waits_for_[i] == 0) take_out({i});
  }

  std::size_t count() const { return sources_.size(); }
  bool is_left(std::size_t node) const { return is_left_[node]; }

  /// Takes out these nodes and all nodes that wait for nothing else.
  void take_out(std::vector<std::size_t> nodes) {
    while (!nodes.empty()) {
      const std::size_t node = nodes.back();
      nodes.pop_back();
      if (!is_left_[node]) continue;
      is_left_[node] = false;
      for (const std::size_t user : users_[node])
        if (--waits_for_[user] == 0) nodes.push_back(user);
    }
  }

  /// The first source that is left of a node that is left. There always is one.
  const WaitedFor& source_of(std::size_t node) const {
    return *std::find_if(sources_[node].begin(), sources_[node].end(),
                         [&](const WaitedFor& source) { return is_left_[source.node]; });
  }

  /// A circle that holds the node or that the node waits for. Each node of it waits for the next. It begins with the
  /// node that is first in the file.
  std::vector<std::size_t> circle_before(std::size_t node) const {
    std::vector<std::size_t> path;
    std::map<std::size_t, std::size_t> place;
    for (; place.emplace(node, path.size()).second; node = source_of(node).node) path.push_back(node);
    path.erase(path.begin(), path.begin() + std::ptrdiff_t(place.at(node)));
    std::rotate(path.begin(), std::min_element(path.begin(), path.end()), path.end());
    return path;
  }

 private:
  std::vector<std::vector<WaitedFor>> sources_;
  std::vector<std::vector<std::size_t>> users_;
  std::vector<std::size_t> waits_for_;  ///< number of sources that are left
  std::vector<bool> is_left_;
};

}  // namespace

void check_circles(const WrittenPipeline& written, Diagnostics& diagnostics) {
  WaitingNodes waiting(written);
  for (std::size_t i = 0; i < waiting.count(); ++i)
    while (waiting.is_left(i) && !diagnostics.is_full()) {
      const std::vector<std::size_t> circle = waiting.circle_before(i);
      std::vector<std::string> names, wires;
      for (const std::size_t node : circle) {
        const WaitedFor& source = waiting.source_of(node);
        names.push_back(written.nodes[node].id);
        wires.push_back(names.back() + " takes " + written.nodes[source.node].id + " as " + in_quotes(source.port));
      }
      diagnostics.add(written.nodes[circle[0]].place,
                      circle.size() == 1 ? "node " + in_quotes(names[0]) + " waits for itself"
                                         : "these nodes wait for each other in a circle: " + joined(names, ", "),
                      joined(wires, ", ") + "; leave out one of these wires");
      waiting.take_out(circle);
    }
}

}  // namespace marrow
