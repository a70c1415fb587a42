// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calls nodes as they are shipped: by name, out of their libraries. So a test is compiled in a moment, and says no more
// of a node than a pipeline could.
#include <marrow/testing/node.hpp>

namespace marrow::node_test {

/// One output of a node.
template <class T>
T output(const std::string& node, const std::string& port, const Inputs& inputs, const Options& options = {},
         Context context = Context()) {
  return call(node, inputs, options, std::move(context)).at(port).as<T>();
}
/// One output that is a list.
template <class T>
List<T> output_list(const std::string& node, const std::string& port, const Inputs& inputs, const Options& options = {},
                    Context context = Context()) {
  return call(node, inputs, options, std::move(context)).at(port).as_list<T>();
}

/// A function that a node makes, with the inputs that it refers to.
template <class Function>
std::shared_ptr<const Function> made(const std::string& node, const std::string& port, const Inputs& inputs,
                                     const Options& options = {}) {
  const auto kept = std::make_shared<std::pair<Inputs, Outputs>>(inputs, call(node, inputs, options));
  return {kept, &kept->second.at(port).as<Function>()};
}
/// The cost that a node of the kind similarity makes.
inline std::shared_ptr<const Cost> cost_by(const std::string& node, const Inputs& inputs, const Options& options = {}) {
  return made<Cost>(node, "cost", inputs, options);
}

/// A function of a test as an input.
template <class Function, class Made>
Value function(std::shared_ptr<Made> made) {
  return Value::of<Function>(std::shared_ptr<const Function>(std::move(made)));
}

/// Named items in this order: named("frontal", view, "lateral", other).
template <class T, class... More>
List<T> named(const std::string& name, T item, const More&... more) {
  List<T> list;
  list.add(name, std::move(item));
  if constexpr (sizeof...(more) > 0) {
    const List<T> rest = named(more...);
    for (std::size_t i = 0; i < rest.size(); ++i) list.add_shared(rest.name(i), rest.shared(i));
  }
  return list;
}
template <class... Named>
Value per_view(const Named&... items) {
  return list(named(items...), "view");
}
template <class... Named>
Value per_fragment(const Named&... items) {
  return list(named(items...), "fragment");
}

/// Some options, and others instead of them or besides.
inline Options with(Options options, const Options& others) {
  for (const auto& [name, value] : others) options[name] = value;
  return options;
}
/// Some inputs, and others instead of them or besides.
inline Inputs with(Inputs inputs, const Inputs& others) {
  for (const auto& [port, value] : others) inputs[port] = value;
  return inputs;
}

/// All figures of merit by their names.
inline std::map<std::string, double> figures_of(const Value& metrics) {
  std::map<std::string, double> figures;
  for (const Metric& metric : metrics.as<Metrics>().items) figures[metric.name] = metric.value;
  return figures;
}

}  // namespace marrow::node_test

namespace shipped = marrow::node_test;
