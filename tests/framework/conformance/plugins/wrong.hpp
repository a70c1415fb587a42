// SPDX-License-Identifier: Apache-2.0
#pragma once
// For nodes that are wrong in one way each: the suite of their kind must catch each of them. Most of them change what
// one of marrow's own nodes gives. "plain" changes nothing.
#include <marrow/plugin.hpp>
#include <marrow/testing/node.hpp>

namespace wrong {

/// The name of a node after its kind, which says what is wrong, as an argument of templates.
struct Fault {
  char name[24]{};
  template <std::size_t size>
  constexpr Fault(const char (&text)[size]) {
    std::copy_n(text, size, name);
  }
  constexpr bool operator==(const Fault&) const = default;
};

/// The output of one of marrow's own nodes.
template <class T>
T right(const std::string& node, const std::string& output, const marrow::node_test::Inputs& inputs) {
  return marrow::node_test::call(node, inputs).at(output).as<T>();
}
/// The same of a node that makes a function. It lives as long as the node's inputs here, which are copied.
template <class T>
std::shared_ptr<const T> right_function(const std::string& node, const std::string& output,
                                        const marrow::node_test::Inputs& inputs) {
  const marrow::Value made = marrow::node_test::call(node, inputs).at(output);
  struct Kept {
    marrow::Value function;
    marrow::node_test::Inputs inputs;
  };
  const auto kept = std::make_shared<const Kept>(Kept{made, inputs});
  return {kept, &kept->function.template as<T>()};
}

/// Declares a node of a kind for each fault: `function` gives its function, `ports` declares its ports and options.
template <Fault... faults>
void declare(marrow::Plugin& plugin, const std::string& kind, auto function, auto ports) {
  (ports(plugin.node(kind + "." + faults.name, function.template operator()<faults>())
             .summary("For a test of the suite")),
   ...);
}

/// How often it was called, for nodes that do not give the same each time.
inline int next_call() {
  static std::atomic<int> calls{0};
  return ++calls;
}

}  // namespace wrong
