// SPDX-License-Identifier: Apache-2.0
// A plugin that is built twice, with another VERSION each: what a person's plugin is before and after a change of its
// code.
#include <chrono>

#include <marrow/plugin.hpp>

namespace versions {
class Scaler {
 public:
  explicit Scaler(double factor) : factor_(factor) {}
  double operator()(double x) const { return factor_ * x; }

 private:
  double factor_;
};
/// A type that only this plugin knows.
struct Powers {
  std::vector<double> values;
  using fields = marrow::Fields<&Powers::values>;
};
}  // namespace versions
MARROW_FUNCTION_TYPE(versions::Scaler, "scaler", 1)
MARROW_VALUE_TYPE(versions::Powers, "powers", 1)

namespace {
using marrow::Metrics;
using versions::Powers;
using versions::Scaler;

constexpr double kFactor = VERSION == 1 ? 2 : 2.5;

Metrics number(double value) { return {{{"value", value, "mm"}}}; }
Metrics scale(const Metrics& a) { return number(kFactor * a.items.at(0).value); }
std::shared_ptr<const Scaler> scaler() { return std::make_shared<Scaler>(kFactor); }
Metrics apply(const Scaler& scaler, const Metrics& to) { return number(scaler(to.items.at(0).value)); }
Powers powers() { return {{1, kFactor, kFactor * kFactor}}; }
Metrics last(const Powers& powers) { return number(powers.values.back()); }
Metrics now() { return number(double(std::chrono::steady_clock::now().time_since_epoch().count())); }
struct FileOptions {
  std::filesystem::path path;
};
Metrics file_size(const FileOptions& options) {
  if (!std::filesystem::is_directory(options.path))
    return {{{"bytes", double(std::filesystem::file_size(options.path)), ""}}};
  double sum = 0;
  for (const auto& entry : std::filesystem::directory_iterator(options.path)) sum += double(entry.file_size());
  return {{{"bytes", sum, ""}}};
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.scale", scale)
      .summary("Scales by a number that the version decides")
      .in("a", "number")
      .out("scaled", "the product");
  plugin.node("test.scaler", scaler).summary("A function that does the same").out("scaler", "scales");
  plugin.node("test.apply_scaler", apply)
      .summary("Calls it")
      .in("scaler", "function")
      .in("to", "number")
      .out("scaled", "the product");
  plugin.node("test.powers", powers).summary("A value of the plugin's own type").out("powers", "of the factor");
  plugin.node("test.last_power", last).summary("Its last number").in("powers", "powers").out("number", "the last");
  plugin.node("test.clock", now).summary("Not the same each time, which a node must not be").out("number", "the time");
  plugin.node("test.file_size", file_size)
      .summary("Of a file, or of all in a folder")
      .out("bytes", "the size")
      .option("path", &FileOptions::path, "file or folder", marrow::required());
}
