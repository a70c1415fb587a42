// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every node of a kind must do, wherever it was compiled. The library that brings a kind brings its suite of
// checks, and `marrow conformance` runs them.
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/kind.hpp"
#include "marrow/runtime/node.hpp"

namespace marrow::conformance {

/// Values by port. A node takes those that it has a port for; where a port stands here in several types, the one of its
/// own type.
class Inputs {
 public:
  Inputs() = default;
  Inputs(std::initializer_list<std::pair<std::string, Value>> values) : values_(values) {}
  /// Adds a value, or replaces the one of the same port and type.
  void set(const std::string& port, Value value);
  /// nullptr where there is none of the port's name and type.
  const Value* find(const PortInfo& port) const;
  /// The first of that name. Throws std::out_of_range.
  Value& at(const std::string& port);
  const Value& at(const std::string& port) const;

 private:
  std::vector<std::pair<std::string, Value>> values_;
};

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
  /// `further` is for inputs that the kind does not have; a check's own inputs go before.
  explicit Subject(const NodeDefinition& node, std::map<std::string, OptionValue> options = {}, Inputs further = {})
      : node_(node), options_(std::move(options)), further_(std::move(further)) {}
  const NodeInfo& info() const { return node_.info; }
  /// Whether the node declares this trait of its kind.
  bool has_trait(const std::string& name) const;
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
  Inputs further_;
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
/// A folder for files that checks write. It belongs to this run of `marrow conformance`, which removes it. Throws Error
/// outside of one.
std::filesystem::path files_folder();
/// Called by `marrow conformance` before the first check.
void set_files_folder(const std::filesystem::path& folder);

/// One figure with its limit.
struct Check : CheckInfo {
  /// The figure, which must not exceed the limit; may throw Failure.
  std::function<double(const Subject&)> measure;
};

/// An input that is no good, or at the edge of it: the node refuses it in words or gives a valid output.
struct Trial {
  std::string name;
  std::function<Inputs()> inputs;
};

struct Suite {
  std::function<Inputs()> sample;  ///< good inputs of moderate size; empty: there is no suite
  std::function<void(const Inputs&, const std::vector<PortInfo>&, const std::vector<Value>&)>
      validate;  ///< throws Failure for outputs that break the contract
  std::vector<Trial> trials;
  std::vector<Check> accuracy;
  std::function<std::map<std::string, OptionValue>()> options =
      nullptr;  ///< values for options by their names, where a node has them
};

/// All checks of a suite: contract, determinism, threads, its trials, accuracy. They refer to the suite's functions,
/// and not to the suite. None of a suite without a sample.
std::vector<Check> checks_of(const Suite& suite);

}  // namespace marrow::conformance
