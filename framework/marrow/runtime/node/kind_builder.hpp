// SPDX-License-Identifier: Apache-2.0
#pragma once
// Declares a kind. Plugin::kind() returns this builder.
//
//   plugin.kind("edges")
//       .summary("edge pixels of an X-ray view")
//       .in<marrow::View>("view", "X-ray view")
//       .out<marrow::EdgeMap>("edges", "edge pixels")
//       .suite(edges_suite());
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/conformance.hpp"
#include "marrow/runtime/node/attributes.hpp"
#include "marrow/runtime/node/kind.hpp"

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

}  // namespace marrow
