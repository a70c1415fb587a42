// SPDX-License-Identifier: Apache-2.0
#include "marrow/conformance.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <deque>
#include <stdexcept>
#include <thread>

#include "marrow/base/number_text.hpp"
#include "marrow/base/process_state.hpp"
#include "marrow/runtime/node/relations.hpp"

namespace marrow::conformance {
namespace {

std::filesystem::path& known_files_folder() {
  static std::filesystem::path folder;
  return folder;
}

/// The content hashes of all values, one after the other.
std::string keys_of(std::vector<Value>& values) {
  std::string text;
  const std::function<void(Value&)> add = [&](Value& value) {
    for (Value& one : value.items) add(one);
    if (value.data && !value.type.is_function)
      text += value.type.content->hash(value.data.get()).hex() + " ";
    else
      text += value.is_list() ? "list " : "none ";
  };
  for (Value& value : values) add(value);
  return text;
}

/// A value for each input of a node. Throws NotApplicable if there is none for a required one.
std::vector<Value> values_for(const NodeInfo& node, const Inputs& inputs, const Inputs& further) {
  std::vector<Value> values;
  for (const PortInfo& port : node.inputs) {
    const Value* found = inputs.find(port);
    if (!found) found = further.find(port);
    if (!found && !port.optional) throw NotApplicable("it needs the input '" + port.name + "'");
    values.push_back(found ? *found : Value{});
    values.back().type = port.type;
  }
  return values;
}

bool has_function(const Value& value) {
  return value.type.is_function || std::any_of(value.items.begin(), value.items.end(), has_function);
}

/// What a call of a node depends on, as text. Empty if that cannot be told, because it takes or gives functions.
std::string text_of_call(const NodeInfo& node, const std::map<std::string, OptionValue>& options,
                         std::vector<Value>& inputs) {
  const auto gives_function = [](const PortInfo& output) { return output.type.is_function; };
  if (std::any_of(inputs.begin(), inputs.end(), has_function) ||
      std::any_of(node.outputs.begin(), node.outputs.end(), gives_function))
    return "";
  std::string text = node.name + " " + keys_of(inputs);
  for (const auto& [name, value] : options) text += name + ": " + json_of(value).dump() + " ";
  return text;
}

/// The outputs of the last calls. Most checks of accuracy measure one figure of an output that other checks measure,
/// too, and the call takes nearly all of the time. Checks run one after the other.
class LastOutputs {
 public:
  const std::vector<Value>* find(const std::string& call) const {
    for (const auto& [known, outputs] : last_)
      if (known == call) return &outputs;
    return nullptr;
  }
  const std::vector<Value>& keep(const std::string& call, std::vector<Value> outputs) {
    constexpr std::size_t kMost = 4;
    if (last_.size() == kMost) last_.pop_front();
    last_.emplace_back(call, std::move(outputs));
    return last_.back().second;
  }

 private:
  std::deque<std::pair<std::string, std::vector<Value>>> last_;
};

LastOutputs& last_outputs() {
  static LastOutputs outputs;
  return outputs;
}

using Kept = std::shared_ptr<const Suite>;

std::vector<Value> good_call(const Suite& suite, const Subject& subject, const Inputs& inputs, int threads = 0) {
  Result result = subject.call(inputs, threads);
  if (result.refusal) throw Failure("it refuses good inputs: " + *result.refusal);
  suite.validate(inputs, subject.info().outputs, result.outputs);
  return std::move(result.outputs);
}

/// A kind does not know the options of its nodes, so that one is missing is no breach of the contract.
struct OptionMissing : NotApplicable {
  using NotApplicable::NotApplicable;
};

Check contract_check(const Kept& suite) {
  return {{"contract", "takes and gives what its kind says, with valid values", 0, ""},
          [suite](const Subject& subject) {
            try {
              good_call(*suite, subject, suite->sample());
            } catch (const OptionMissing&) {
              throw;
            } catch (const NotApplicable& missing) {
              throw Failure(std::string(missing.what()) + ", which its kind does not have; give an input with --in");
            }
            return 0.0;
          }};
}

Check determinism_check(const Kept& suite) {
  return {{"determinism", "the same bytes when called again", 0, ""}, [suite](const Subject& subject) {
            const Inputs inputs = suite->sample();
            auto one = good_call(*suite, subject, inputs), other = good_call(*suite, subject, inputs);
            expect(keys_of(one) == keys_of(other), "two calls with the same inputs gave different outputs");
            return 0.0;
          }};
}

Check threads_check(const Kept& suite) {
  return {{"threads", "the same bytes with 1 thread, 2 and 7", 0, ""}, [suite](const Subject& subject) {
            const Inputs inputs = suite->sample();
            auto one = good_call(*suite, subject, inputs, 1);
            for (const int threads : {2, 7}) {
              auto other = good_call(*suite, subject, inputs, threads);
              expect(keys_of(one) == keys_of(other), formatted("{} threads gave other outputs than 1", threads));
            }
            return 0.0;
          }};
}

Check trial_check(const Kept& suite, const Trial& trial) {
  return {{trial.name, "refused in words, or a valid output", 0, ""},
          [suite, make_inputs = trial.inputs](const Subject& subject) {
            const Inputs inputs = make_inputs();
            const Result result = subject.call(inputs);
            if (result.refusal)
              expect_reason(*result.refusal);
            else
              suite->validate(inputs, subject.info().outputs, result.outputs);
            return 0.0;
          }};
}

}  // namespace

void Inputs::set(const std::string& port, Value value) {
  for (auto& [name, known] : values_)
    if (name == port && known.type == value.type) {
      known = std::move(value);
      return;
    }
  values_.emplace_back(port, std::move(value));
}

const Value* Inputs::find(const PortInfo& port) const {
  for (const auto& [name, value] : values_)
    if (name == port.name && value.type == port.type) return &value;
  return nullptr;
}

const Value& Inputs::at(const std::string& port) const {
  for (const auto& [name, value] : values_)
    if (name == port) return value;
  throw std::out_of_range("there is no input '" + port + "'");
}

Value& Inputs::at(const std::string& port) { return const_cast<Value&>(std::as_const(*this).at(port)); }

void expect(bool good, const std::string& text) {
  if (!good) throw Failure(text);
}

void expect_reason(const std::string& refusal) {
  expect(refusal.size() > 10, "it refuses without saying why: '" + refusal + "'");
}

std::string digits(double value) { return short_number(value); }

std::filesystem::path files_folder() {
  if (known_files_folder().empty()) throw Error("this check writes files, so only 'marrow conformance' can run it");
  return known_files_folder();
}
void set_files_folder(const std::filesystem::path& folder) { known_files_folder() = folder; }

Inputs::Inputs(std::initializer_list<std::pair<std::string, Value>> values) : values_(values) {}

Subject::Subject(const NodeDefinition& node, std::map<std::string, OptionValue> options, Inputs further)
    : node_(node), options_(std::move(options)), further_(std::move(further)) {}

bool Subject::has_trait(const std::string& name) const {
  const std::vector<std::string>& traits = node_.info.traits;
  return std::find(traits.begin(), traits.end(), name) != traits.end();
}

Result Subject::call(const Inputs& inputs, int threads) const {
  std::vector<Value> values = values_for(node_.info, inputs, further_);
  const std::shared_ptr<void> options = node_.make_options();
  for (std::size_t i = 0; i < node_.info.options.size(); ++i) {
    const OptionInfo& option = node_.info.options[i];
    const auto given = options_.find(option.name);
    if (given == options_.end() && option.required)
      throw OptionMissing("it needs the option '" + option.name + "'; give it with --set " + option.name + "=...");
    node_.set_option[i](options.get(), given == options_.end() ? option.default_value : given->second);
  }
  const int count = threads > 0 ? threads : int(std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(count));
  tbb::task_arena arena(count);
  Result result;
  arena.execute([&] {
    try {
      ProcessState::of_runs()->keep_during([&] {
        Context context(1);
        result.outputs = node_.call(values, options.get(), context);
      });
    } catch (const Error& error) {
      result.refusal = error.what();
    }
  });
  return result;
}

Subject Subject::with(const std::string& option, OptionValue value) const {
  Subject other = *this;
  other.options_[option] = std::move(value);
  return other;
}

Value Subject::output(const Inputs& inputs, const std::string& port) const {
  std::vector<Value> values = values_for(node_.info, inputs, further_);
  const std::string of_call = text_of_call(node_.info, options_, values);
  const std::vector<Value>* outputs = of_call.empty() ? nullptr : last_outputs().find(of_call);
  Result result;
  if (!outputs) {
    result = call(inputs);
    if (result.refusal) throw Failure("it refuses: " + *result.refusal);
    outputs = of_call.empty() ? &result.outputs : &last_outputs().keep(of_call, result.outputs);
  }
  for (std::size_t i = 0; i < node_.info.outputs.size(); ++i)
    if (node_.info.outputs[i].name == port) {
      expect(!outputs->at(i).is_absent(), "it gives no output '" + port + "'");
      return (*outputs)[i];
    }
  throw Failure("it has no output '" + port + "'");
}

std::vector<Check> checks_of(const Suite& suite) {
  if (!suite.sample) return suite.accuracy;  // nodes of the kind take no inputs, such as those that read files
  const auto kept = std::make_shared<const Suite>(suite);
  std::vector<Check> checks{contract_check(kept), determinism_check(kept), threads_check(kept)};
  for (const Trial& trial : suite.trials) checks.push_back(trial_check(kept, trial));
  checks.insert(checks.end(), suite.accuracy.begin(), suite.accuracy.end());
  return checks;
}

}  // namespace marrow::conformance
