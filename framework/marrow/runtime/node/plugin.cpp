// SPDX-License-Identifier: Apache-2.0
// The part of plugin.hpp that need not be compiled in each plugin.
#include "marrow/plugin.hpp"

namespace marrow {

KindBuilder::~KindBuilder() { detail::check_declaration(kind_); }

KindBuilder& KindBuilder::summary(std::string text) {
  kind_.info.summary = std::move(text);
  return *this;
}

KindBuilder& KindBuilder::trait(std::string name, std::string help) {
  kind_.info.traits.push_back({std::move(name), std::move(help)});
  return *this;
}

KindBuilder& KindBuilder::sees_truth() {
  kind_.info.sees_truth = true;
  return *this;
}

KindBuilder& KindBuilder::runs_apart(Apart apart) {
  kind_.info.apart = apart;
  return *this;
}

KindBuilder& KindBuilder::suite(conformance::Suite suite) {
  kind_.suite = std::move(suite);
  for (const conformance::Check& check : conformance::checks_of(kind_.suite)) kind_.info.checks.push_back(check);
  return *this;
}

KindBuilder& KindBuilder::add_input(KindPort port) {
  kind_.info.inputs.push_back(std::move(port));
  return *this;
}

KindBuilder& KindBuilder::add_output(KindPort port) {
  kind_.info.outputs.push_back(std::move(port));
  return *this;
}

NodeDefinition& Plugin::add_node(std::string name) {
  nodes.emplace_back().info.name = std::move(name);
  return nodes.back();
}

void Plugin::add_writer(WriterDefinition writer) { writers.push_back(std::move(writer)); }

KindBuilder Plugin::kind(std::string name) {
  kinds.emplace_back().info.name = std::move(name);
  return KindBuilder(kinds.back());
}

}  // namespace marrow
