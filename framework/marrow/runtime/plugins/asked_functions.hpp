// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions that a node written in Python takes. They stay in this process; the node's process asks for their values.
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "marrow/runtime/node/types.hpp"

namespace marrow {

/// Asks the process something while it waits for a reply, and returns its answer.
using AskProcess = std::function<nlohmann::json(const nlohmann::json& question)>;

/// The functions among the inputs of a call, by their numbers. Safe to use from several threads.
class AskedFunctions {
 public:
  /// Takes a function, and returns how a request names it.
  nlohmann::json add(const Value& function);
  /// The function with this number. Throws Error if there is none.
  const Value& at(std::size_t number) const;
  /// The numbers of the costs.
  std::vector<std::size_t> costs() const;

  /// The reply to a question about one of them: {"function": number, "levels": [...], "do": ..., ...}. Throws Error if
  /// there is no such function, and what the function throws. python/bindings/asked.cpp is the other side.
  nlohmann::json reply(const nlohmann::json& question, const AskProcess& ask_process) const;

 private:
  const Cost& cost_of(const nlohmann::json& question) const;

  std::vector<Value> functions_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::shared_ptr<const Cost>> at_levels_;  ///< costs at the levels that were asked for
};

/// Whether nodes written in Python can take functions of this type.
bool can_be_asked(const TypeInfo& type);

/// A transform as 12 numbers: the first three rows of its matrix.
nlohmann::json json_of_transform(const RigidTransform& transform);
/// The inverse. Throws Error unless there are 12 numbers of a rigid transform from the CT to the world.
std::vector<RigidTransform> transforms_of(const nlohmann::json& numbers);

}  // namespace marrow
