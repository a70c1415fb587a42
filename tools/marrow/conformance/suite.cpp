// SPDX-License-Identifier: Apache-2.0
#include "conformance/suite.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <cstdio>
#include <thread>

namespace marrow::conformance {
namespace {

/// All values one after the other, as the store would keep them.
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

std::vector<Value> good_call(const Suite& suite, const Subject& subject, const Inputs& inputs, int threads = 0) {
  Result result = subject.call(inputs, threads);
  if (result.refusal) throw Failure("it refuses good inputs: " + *result.refusal);
  suite.validate(inputs, subject.info().outputs, result.outputs);
  return std::move(result.outputs);
}

double check_trial(const Suite& suite, const Trial& trial, const Subject& subject) {
  const Inputs inputs = trial.inputs();
  const Result result = subject.call(inputs);
  if (result.refusal)
    expect_reason(*result.refusal);
  else
    suite.validate(inputs, subject.info().outputs, result.outputs);
  return 0;
}

}  // namespace

void expect(bool good, const std::string& text) {
  if (!good) throw Failure(text);
}

void expect_reason(const std::string& refusal) {
  expect(refusal.size() > 10, "it refuses without saying why: '" + refusal + "'");
}

std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

Result Subject::call(const Inputs& inputs, int threads) const {
  std::vector<Value> values;
  for (const PortInfo& port : node_.info.inputs) {
    const auto found = inputs.find(port.name);
    if (found != inputs.end()) {
      values.push_back(found->second);
    } else {
      if (!port.optional) throw NotApplicable("it needs the input '" + port.name + "'");
      Value absent;
      absent.type = port.type;
      values.push_back(absent);
    }
  }
  const std::shared_ptr<void> options = node_.make_options();
  for (std::size_t i = 0; i < node_.info.options.size(); ++i) {
    const OptionInfo& option = node_.info.options[i];
    const auto given = options_.find(option.name);
    if (given == options_.end() && option.required) throw NotApplicable("it needs the option '" + option.name + "'");
    node_.set_option[i](options.get(), given == options_.end() ? option.default_value : given->second);
  }
  const int count = threads > 0 ? threads : int(std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(count));
  tbb::task_arena arena(count);
  Result result;
  arena.execute([&] {
    try {
      Context context(1);
      result.outputs = node_.call(values, options.get(), context);
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
  const Result result = call(inputs);
  if (result.refusal) throw Failure("it refuses: " + *result.refusal);
  for (std::size_t i = 0; i < node_.info.outputs.size(); ++i)
    if (node_.info.outputs[i].name == port) {
      expect(!result.outputs.at(i).is_absent(), "it gives no output '" + port + "'");
      return result.outputs[i];
    }
  throw Failure("it has no output '" + port + "'");
}

const Suite* suite_of(const std::string& kind) {
  static const std::vector<Suite> kSuites{camera_suite(),  edges_suite(),   mesh_suite(),  optimizer_suite(),
                                          project_suite(), segment_suite(), shaft_suite(), similarity_suite()};
  for (const Suite& suite : kSuites)
    if (suite.kind == kind) return &suite;
  return nullptr;
}

std::vector<Check> checks_of(const Suite& suite) {
  std::vector<Check> checks;
  checks.push_back(
      {"contract", "takes and gives what its kind says, with valid values", 0, "", [&suite](const Subject& subject) {
         try {
           good_call(suite, subject, suite.sample());
         } catch (const NotApplicable& missing) {
           throw Failure(std::string(missing.what()) + ", which its kind does not have");
         }
         return 0.0;
       }});
  checks.push_back({"determinism", "the same bytes when called again", 0, "", [&suite](const Subject& subject) {
                      const Inputs inputs = suite.sample();
                      auto one = good_call(suite, subject, inputs), other = good_call(suite, subject, inputs);
                      expect(keys_of(one) == keys_of(other), "two calls with the same inputs gave different outputs");
                      return 0.0;
                    }});
  checks.push_back({"threads", "the same bytes with 1 thread, 2 and 7", 0, "", [&suite](const Subject& subject) {
                      const Inputs inputs = suite.sample();
                      auto one = good_call(suite, subject, inputs, 1);
                      for (const int threads : {2, 7}) {
                        auto other = good_call(suite, subject, inputs, threads);
                        expect(keys_of(one) == keys_of(other),
                               std::to_string(threads) + " threads gave other outputs than 1");
                      }
                      return 0.0;
                    }});
  for (const Trial& trial : suite.trials)
    checks.push_back({trial.name, "refused in words, or a valid output", 0, "",
                      [&suite, &trial](const Subject& subject) { return check_trial(suite, trial, subject); }});
  checks.insert(checks.end(), suite.accuracy.begin(), suite.accuracy.end());
  return checks;
}

}  // namespace marrow::conformance
