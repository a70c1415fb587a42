// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every node of a kind must do, wherever it was compiled: a suite of checks per kind, run by `marrow conformance`.
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/node.hpp"
#include "marrow/runtime/types.hpp"

namespace marrow::conformance {

/// Values by port. A node takes those that it has a port for.
using Inputs = std::map<std::string, Value>;

template <class T>
Value item(T value) {
  return Value::of<T>(std::make_shared<const T>(std::move(value)));
}

/// The outputs of a call, or what it refused its inputs with.
struct Result {
  std::vector<Value> outputs;
  std::optional<std::string> refusal;
};

/// The node that is looked at, with its options as they are by default, but for those that its suite gives a value.
class Subject {
 public:
  explicit Subject(const NodeDefinition& node, std::map<std::string, OptionValue> options = {})
      : node_(node), options_(std::move(options)) {}
  const NodeInfo& info() const { return node_.info; }
  /// Calls the node. An Error that it throws is a refusal; any other exception passes through. Throws NotApplicable for
  /// an input or an option that the node needs and this check has not.
  Result call(const Inputs& inputs, int threads = 0) const;
  /// The output of that name of a call that must not refuse. Throws Failure.
  Value output(const Inputs& inputs, const std::string& port) const;

  /// The same node with another value of an option.
  Subject with(const std::string& option, OptionValue value) const;

 private:
  const NodeDefinition& node_;
  std::map<std::string, OptionValue> options_;
};

/// Thrown by a check that fails; the text says what was found and what was expected.
class Failure : public Error {
 public:
  using Error::Error;
};
/// Thrown where a check has not the inputs that the node needs: a mesher's random field, for a node that changes a
/// mesh.
class NotApplicable : public Error {
 public:
  using Error::Error;
};
/// Throws Failure unless `good`.
void expect(bool good, const std::string& text);
/// Throws Failure for a refusal that says too little.
void expect_reason(const std::string& refusal);
/// "0.41", with three significant digits.
std::string digits(double value);

/// One figure with its limit. The table of all limits is the suites themselves: `marrow inspect` prints it.
struct Check {
  std::string name;
  std::string what;  ///< in one line
  double limit = 0;
  std::string unit;  ///< of the limit; "" where there is none
  /// The figure, which must not exceed the limit; may throw Failure.
  std::function<double(const Subject&)> measure;
};

/// An input that is no good, or at the edge of it: the node refuses it in words or gives a valid output.
struct Trial {
  std::string name;
  std::function<Inputs()> inputs;
};

struct Suite {
  std::string kind;
  std::function<Inputs()> sample;  ///< good inputs of moderate size
  std::function<void(const Inputs&, const std::vector<PortInfo>&, const std::vector<Value>&)>
      validate;  ///< throws Failure for outputs that break the contract
  std::vector<Trial> trials;
  std::vector<Check> accuracy;
  std::function<std::map<std::string, OptionValue>()> options =
      nullptr;  ///< values for options by their names, where a node has them
};

/// The suite of a kind, or nullptr.
const Suite* suite_of(const std::string& kind);
/// All checks of a suite: contract, determinism, threads, its trials, accuracy.
std::vector<Check> checks_of(const Suite& suite);

// The suites, a file each.
Suite camera_suite();
Suite edges_suite();
Suite mesh_suite();
Suite optimizer_suite();
Suite project_suite();
Suite segment_suite();
Suite shaft_suite();
Suite similarity_suite();

}  // namespace marrow::conformance
