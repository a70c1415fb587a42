// SPDX-License-Identifier: Apache-2.0
#pragma once
// The only way in which marrow reads JSON that another program may have written or damaged. Writes any text as JSON.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Parses a JSON document. Throws Error, with a text that begins with `what` (usually the file's name), if the text is
/// not JSON, or if lists and objects are nested more than 64 deep. Copying and writing a document are recursive, so the
/// depth must be limited.
nlohmann::json parse_json(const std::string& text, const std::string& what);

/// A document on one line, or with `indent` on lines that are indented. Bytes that are not UTF-8 become U+FFFD.
std::string json_text(const nlohmann::json& value, int indent = -1);

/// A whole number from `least` to `most`. Throws Error for any other value; `what` names it ("run.json: 'threads'").
std::int64_t integer_of(const nlohmann::json& value, std::int64_t least, std::int64_t most, const std::string& what);

/// A parsed document whose destructor needs no memory. The library's destructor of a list or object allocates memory;
/// if there is none, the process is ended.
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
