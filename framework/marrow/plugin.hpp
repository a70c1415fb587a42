// SPDX-License-Identifier: Apache-2.0
#pragma once
// The only header that a plugin must include. It brings all types of values, Eigen's matrices, OpenCV's and the parts
// of the standard library below, which nearly every node uses. A node is a plain function that is declared once:
//
//   struct Options { double low = 50; };
//   marrow::EdgeMap find(const marrow::View& view, const Options& options) { ... }
//
//   MARROW_PLUGIN(plugin) {
//     plugin.node("edges.mine", find)
//         .summary("One line that says what it does")
//         .in("view", "X-ray view")
//         .out("edges", "edge pixels")
//         .option("low", &Options::low, "lower threshold", marrow::at_least(0), marrow::unit("%"));
//   }
//
// The function's signature defines the ports. The .in() calls name them in the order of the arguments:
//   const T&          a required input           const List<T>&   a whole list (say which axis: over("view"))
//   const T*          an optional input          const List<T>*   an optional list
//   Context&          seed, cancel, progress, log
//   const Options&    the options: the only argument whose type is not a registered value type
// A node returns a value, a std::optional of one, a List<T>, a std::shared_ptr<const Interface> for a function, a
// std::tuple of these, or a struct whose members are named with .out("port", &Struct::member, "help").
//
// A kind is the part of a node's name before the dot. A library may declare its own kinds (KindBuilder).
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/conformance.hpp"
#include "marrow/runtime/node/abi.hpp"
#include "marrow/runtime/node/node_builder.hpp"
#include "marrow/runtime/node/types.hpp"

namespace MARROW_EXPORT marrow {

/// A kind with its suite, as a loaded plugin registers it.
struct KindDefinition {
  KindInfo info;
  std::vector<std::string> faults;  ///< what is wrong with the declaration itself
  conformance::Suite suite;
};

namespace detail {
/// Checks the declaration itself. Adds what is wrong to `faults`.
void check_declaration(KindDefinition& kind);
}  // namespace detail

/// Declares a kind. Plugin::kind() returns this builder.
///
///   plugin.kind("edges")
///       .summary("edge pixels of an X-ray view")
///       .in<marrow::View>("view", "X-ray view")
///       .out<marrow::EdgeMap>("edges", "edge pixels")
///       .suite(edges_suite());
class KindBuilder {
 public:
  explicit KindBuilder(KindDefinition& kind) : kind_(kind) {}
  KindBuilder(const KindBuilder&) = delete;
  KindBuilder& operator=(const KindBuilder&) = delete;
  ~KindBuilder();

  KindBuilder& summary(std::string text);
  /// An input that nodes of the kind may have. If several types are given, a node takes one of them.
  template <Registered... T>
  KindBuilder& in(std::string name, std::string help, const Over& axis = {}) {
    return add_input({std::move(name), std::move(help), {TypeInfo::of<T>()...}, std::string(axis.axis)});
  }
  /// An output that each node of the kind has, of one of the types.
  template <Registered... T>
  KindBuilder& out(std::string name, std::string help, const Over& axis = {}) {
    return add_output({std::move(name), std::move(help), {TypeInfo::of<T>()...}, std::string(axis.axis)});
  }
  /// A property that nodes may declare with NodeBuilder::trait().
  KindBuilder& trait(std::string name, std::string help);
  /// Its nodes judge or show results, so they may be given the truth.
  KindBuilder& sees_truth();
  /// Its nodes are called in their own process if their options name files.
  KindBuilder& runs_apart(Apart apart);
  /// The checks that every node of the kind must pass in `marrow conformance`.
  KindBuilder& suite(conformance::Suite suite);

 private:
  KindBuilder& add_input(KindPort port);
  KindBuilder& add_output(KindPort port);

  KindDefinition& kind_;
};

/// What a plugin library registers.
class Plugin {
 public:
  template <class R, class... Args>
  NodeBuilder<R, Args...> node(std::string name, R (*function)(Args...)) {
    return NodeBuilder<R, Args...>(add_node(std::move(name)), function);
  }
  /// Registers how values of type T are written to disk as outputs of a pipeline. `function` gets the full path, which
  /// ends in `extension`; an empty extension means a folder. `function` throws Error if it cannot write the value.
  template <Registered T>
  void writer(std::string extension, void (*function)(const T&, const std::string& path), std::string help) {
    add_writer(
        {{TypeInfo::of<T>(), std::move(extension), std::move(help)},
         [function](const void* value, const std::string& path) { function(*static_cast<const T*>(value), path); }});
  }

  /// Declares a kind of nodes with its contract. The nodes of the kind may be in other libraries.
  KindBuilder kind(std::string name);
  /// Gives a kind that another library declares its suite. So its nodes run where the suite is not built.
  void suite(std::string kind, conformance::Suite suite);

  std::deque<NodeDefinition> nodes;
  std::deque<KindDefinition> kinds;
  std::vector<WriterDefinition> writers;

 private:
  NodeDefinition& add_node(std::string name);
  void add_writer(WriterDefinition writer);
};

/// Begins the function that registers nodes and kinds. It makes a shared library a plugin.
#define MARROW_PLUGIN(plugin)                                                                            \
  static void marrow_register_nodes(::marrow::Plugin& plugin);                                           \
  extern "C" __attribute__((visibility("default"))) const ::marrow::PluginEntry* marrow_plugin_entry() { \
    static constexpr ::marrow::PluginEntry kEntry{{'m', 'a', 'r', 'r', 'o', 'w', '!', 0},                \
                                                  sizeof(::marrow::PluginEntry),                         \
                                                  MARROW_API_MAJOR,                                      \
                                                  MARROW_API_MINOR,                                      \
                                                  ::marrow::abi_stamp(),                                 \
                                                  &marrow_register_nodes};                               \
    return &kEntry;                                                                                      \
  }                                                                                                      \
  static void marrow_register_nodes(::marrow::Plugin& plugin)

}  // namespace marrow
