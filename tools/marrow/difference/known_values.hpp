// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values that runs computed, as far as they still exist.
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "difference/amounts.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"
#include "marrow/runtime/store/store.hpp"

namespace marrow::cli {

/// One value of one run, and where it can be found.
struct ValueOfRun {
  std::string key;
  std::filesystem::path file;  ///< file below outputs/; empty if the run wrote none
  std::string uses;            ///< the node that made it
};

class KnownValues {
 public:
  /// Keeps a value that a run in this process computed, with all its items.
  void add(const Value& value);
  /// The amount by which two values differ. The text says if it comes from files, or if only the keys are known.
  Amount amount(const ValueOfRun& before, const ValueOfRun& now);

 private:
  std::optional<Value> find(const std::string& key);
  std::optional<std::string> packed(const Value& value, const std::string& uses);
  std::optional<Amount> amount_of_values(const Value& before, const Value& now, const ValueOfRun& made_before,
                                         const ValueOfRun& made_now);

  std::map<std::string, Value> held_;
  Store store_;
  std::optional<std::map<std::string, Digest>> entries_;  ///< entries of the store, by the keys of their outputs
  std::unique_ptr<Catalogue> catalogue_;  ///< made when the first value with a plugin's own type is found
};

}  // namespace marrow::cli
