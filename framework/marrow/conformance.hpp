// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks of what every node of a kind must do, no matter who compiled the node. The library that declares a kind also
// brings its suite of checks. `marrow conformance` runs them.
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/node/node.hpp"

namespace MARROW_EXPORT marrow {
namespace conformance {

/// Input values by the names of ports. A node takes the values of the ports that it has. A name may occur several times
/// with different types. A node then takes the value of its port's type.
class Inputs {
 public:
  Inputs() = default;
  Inputs(std::initializer_list<std::pair<std::string, Value>> values);
  /// Adds a value, or replaces the one of the same port and type.
  void set(const std::string& port, Value value);
  /// The value with the port's name and type, or nullptr.
  const Value* find(const PortInfo& port) const;
  /// The first value with that name. Throws std::out_of_range if there is none.
  Value& at(const std::string& port);
  const Value& at(const std::string& port) const;

 private:
  std::vector<std::pair<std::string, Value>> values_;
};

template <class T>
Value item(T value) {
  return Value::of<T>(std::make_shared<const T>(std::move(value)));
}

/// The outputs of a call, or the message with which the node refused its inputs.
struct Result {
  std::vector<Value> outputs;
  std::optional<std::string> refusal;
};

/// The node under test. Its options have their default values, except those for which its suite gives a value.
class Subject {
 public:
  /// `further` holds values for inputs that the kind does not declare. The inputs of a check take precedence.
  explicit Subject(const NodeDefinition& node, std::map<std::string, OptionValue> options = {}, Inputs further = {});
  const NodeInfo& info() const { return node_.info; }
  /// Whether the node declares this trait of its kind.
  bool has_trait(const std::string& name) const;
  /// Calls the node with `threads` threads; 0 means one per hardware thread. An Error of the node counts as a refusal;
  /// any other exception passes through. Throws NotApplicable if the node needs an input or an option that this check
  /// does not have.
  Result call(const Inputs& inputs, int threads = 0) const;
  /// Calls the node and returns its output of that name. If one of the last calls was the same and took and gave only
  /// data, returns what that call gave. Throws Failure if the node refuses or does not give this output.
  Value output(const Inputs& inputs, const std::string& port) const;

  /// The same node with another value of an option.
  Subject with(const std::string& option, OptionValue value) const;

 private:
  const NodeDefinition& node_;
  std::map<std::string, OptionValue> options_;
  Inputs further_;
};

/// Thrown by a check that fails. The text says what was found and what was expected.
class Failure : public Error {
 public:
  using Error::Error;
};
/// Thrown if a check does not have the inputs that the node needs. Example: the checks of meshers give a random field,
/// but the node under test changes a mesh.
class NotApplicable : public Error {
 public:
  using Error::Error;
};
/// Throws Failure unless `good`.
void expect(bool good, const std::string& text);
/// Throws Failure if the text of a refusal is too short to be a reason (10 bytes or fewer).
void expect_reason(const std::string& refusal);
/// The number as text with three significant digits, such as "0.41".
std::string digits(double value);
/// The folder for files that checks write. `marrow conformance` makes it for its run and removes it afterwards. Throws
/// Error outside of such a run.
std::filesystem::path files_folder();
/// Sets the folder of files_folder(). `marrow conformance` calls it before the first check.
void set_files_folder(const std::filesystem::path& folder);

/// One measurement and its limit.
struct Check : CheckInfo {
  /// Returns the measured value, which must not exceed the limit. May throw Failure.
  std::function<double(const Subject&)> measure;
};

/// Bad or borderline inputs. The node must either refuse them with a reason or give a valid output.
struct Trial {
  std::string name;
  std::function<Inputs()> inputs;
};

struct Suite {
  std::function<Inputs()> sample;  ///< makes good inputs of moderate size; empty if the kind has no suite
  /// Throws Failure for outputs that break the contract.
  std::function<void(const Inputs&, const std::vector<PortInfo>&, const std::vector<Value>&)> validate;
  std::vector<Trial> trials;
  std::vector<Check> accuracy;
  /// Values of options by their names. A value is used if the node has that option.
  std::function<std::map<std::string, OptionValue>()> options = nullptr;

  /// Adds a check of accuracy: the measured value must not exceed the limit.
  void add(std::string name, std::string what, double limit, std::string unit,
           std::function<double(const Subject&)> measure) {
    accuracy.push_back({{std::move(name), std::move(what), limit, std::move(unit)}, std::move(measure)});
  }
};

/// All checks of a suite: contract, determinism, threads, its trials, accuracy. They hold a copy of the suite, so the
/// suite may be destroyed before them. Empty if the suite has no sample.
std::vector<Check> checks_of(const Suite& suite);

}  // namespace conformance
}  // namespace marrow
