// SPDX-License-Identifier: Apache-2.0
#include "difference/difference.hpp"

#include <nlohmann/json.hpp>

#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

Metrics metrics_of(const json& file) {
  Metrics metrics;
  for (const json& metric : file.at("metrics"))
    metrics.items.push_back({metric.at("name"),
                             metric.at("value").is_null() ? std::nan("") : metric.at("value").get<double>(),
                             metric.at("unit")});
  return metrics;
}

/// Reads a picture of 8 bits. Nothing for a PNG of 16 bits.
std::optional<Picture> picture_of(const fs::path& file) {
  RgbPixels pixels = read_png(file);
  if (pixels.is_wide) return std::nullopt;
  return Picture{cv::Mat(pixels.height_px, pixels.width_px, CV_8UC3, pixels.bytes.data()).clone()};
}

/// A pose, or else a verdict. Throws Error for a file of another kind.
Value value_of_yaml(const fs::path& file) {
  try {
    return Value::of(std::make_shared<const Pose>(files::read_pose_file(file)));
  } catch (const Error&) {
    return Value::of(std::make_shared<const Verdict>(files::read_verdict_file(file)));
  }
}

/// The value in a file of outputs/, if this program can read it.
std::optional<Value> value_of_file(const fs::path& file) {
  const std::string extension = file.extension().string();
  try {
    if (extension == ".json")
      return Value::of(std::make_shared<const Metrics>(
          metrics_of(parse_json(read_text_file(file, kMostRecordBytes), file.string()))));
    if (extension == ".yaml") return value_of_yaml(file);
    if (extension == ".png")
      if (auto picture = picture_of(file)) return Value::of(std::make_shared<const Picture>(std::move(*picture)));
  } catch (const std::exception&) {  // of another kind, or damaged; its bytes are compared instead
  }
  return std::nullopt;
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return !path.empty() && fs::is_regular_file(path, error);
}

/// Calls visit for each single item of a value, also in nested lists.
template <class Visit>
void for_items(const Value& value, const Visit& visit) {
  if (!value.is_list()) return visit(value);
  for (const Value& item : value.items) for_items(item, visit);
}

Amount with_source(Amount amount, const char* source) {
  amount.facts["source"] = source;
  if (std::string(source) == "files" && !amount.lines.empty()) amount.lines.back() += " (by the files in outputs/)";
  return amount;
}

}  // namespace

void KnownValues::add(const Value& value) {
  for_items(value, [&](const Value& item) {
    if (item.data && !item.type.is_function) held_[item.key.hex()] = item;
  });
}

std::optional<Value> KnownValues::find(const std::string& key) {
  if (const auto held = held_.find(key); held != held_.end()) return held->second;
  if (!entries_) {
    entries_.emplace();
    for (const Store::Entry& entry : store_.entries())
      for (const Digest& output : entry.outputs) (*entries_)[output.hex()] = entry.key;
  }
  const auto entry = entries_->find(key);
  if (entry == entries_->end()) return std::nullopt;
  std::optional<Value> found;
  if (const auto stored = store_.find(entry->second))
    for (const Value& output : stored->outputs)
      for_items(output, [&](const Value& item) {
        if (item.source && item.key.hex() == key) found = item;
      });
  return found;
}

/// The bytes of a value whose type belongs to a plugin. Only this plugin can read the value.
std::optional<std::string> KnownValues::packed(const Value& value, const std::string& uses) {
  if (!catalogue_) catalogue_ = std::make_unique<Catalogue>();
  if (!catalogue_->find(uses)) return std::nullopt;
  for (const PortInfo& output : catalogue_->load(uses).info.outputs) {
    if (output.type != value.type || !output.type.content) continue;
    Packer packer;
    output.type.content->pack((value.data ? value.data : value.source->data(output.type)).get(), packer);
    return packer.packed;
  }
  return std::nullopt;
}

std::optional<Amount> KnownValues::amount_of_values(const Value& before, const Value& now,
                                                    const ValueOfRun& made_before, const ValueOfRun& made_now) {
  try {
    const Amount amount = amount_of(before, now);
    if (!amount.lines.empty()) return amount;
    if (before.type.id != now.type.id)
      return Amount{{"it is a " + now.type.id + ", was a " + before.type.id},
                    {{"types", {before.type.id, now.type.id}}}};
    const auto bytes_before = packed(before, made_before.uses), bytes_now = packed(now, made_now.uses);
    if (bytes_before && bytes_now) return amount_of_bytes(*bytes_before, *bytes_now, "the " + now.type.id);
  } catch (const Error&) {  // damaged, removed just now, or with another layout
  }
  return std::nullopt;
}

Amount KnownValues::amount(const ValueOfRun& before, const ValueOfRun& now) {
  const auto value_before = find(before.key), value_now = find(now.key);
  if (value_before && value_now)
    if (auto amount = amount_of_values(*value_before, *value_now, before, now))
      return with_source(std::move(*amount), "values");
  const auto read_before = value_before ? value_before : value_of_file(before.file),
             read_now = value_now ? value_now : value_of_file(now.file);
  if (read_before && read_now)
    if (auto amount = amount_of_values(*read_before, *read_now, before, now))
      return with_source(std::move(*amount), "files");
  if (is_file(before.file) && is_file(now.file)) return with_source(amount_of_files(before.file, now.file), "files");
  Amount unknown;
  const char* whose = !value_before && !value_now ? "of both runs"
                      : value_before              ? "of the second run"
                                                  : "of the first run";
  unknown.lines = {std::string("by how much is not known: the store no longer has the value ") + whose};
  return with_source(std::move(unknown), "none");
}

}  // namespace marrow::cli
