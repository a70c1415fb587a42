// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one way in which marrow reads JSON that something else may have written or damaged.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace marrow {

/// The JSON document in a text. Throws Error, which begins with `what` (mostly the file's name): for a text that is no
/// JSON, and for lists and objects nested more than 64 deep, since copying and writing a document recurses.
nlohmann::json parse_json(const std::string& text, const std::string& what);

/// A whole number from `least` to `most`. Throws Error for any other value; `what` names it ("run.json: 'threads'").
std::int64_t integer_of(const nlohmann::json& value, std::int64_t least, std::int64_t most, const std::string& what);

/// A parsed document. Its end needs no memory: that of a list or object of the library allocates, and a lack of memory
/// would then end the process.
class JsonDocument {
 public:
  explicit JsonDocument(nlohmann::json value) : value_(std::move(value)) {}
  ~JsonDocument();
  JsonDocument(const JsonDocument&) = delete;
  JsonDocument& operator=(const JsonDocument&) = delete;
  nlohmann::json& value() { return value_; }

 private:
  nlohmann::json value_;
};

}  // namespace marrow
