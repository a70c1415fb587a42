// SPDX-License-Identifier: Apache-2.0
// Nodes whose figures and items have names that are declared, that the case decides, or that a search decides.
#include <cstdlib>
#include <fstream>

#include <marrow/plugin.hpp>

namespace figures {
/// Stands for what a search needs.
struct Way {};
}  // namespace figures
MARROW_FUNCTION_TYPE(figures::Way, "way", 1)

namespace {
using marrow::List;
using marrow::Metrics;

struct Options {
  std::filesystem::path path;
  std::string also;
};

/// A number for each fragment that the case's file names, a word a line.
List<Metrics> fragments(const Options& options) {
  std::ifstream file(options.path / "fragments.txt");
  List<Metrics> list;
  for (std::string name; file >> name;) {
    if (name == "crash") std::abort();
    if (name == "fail") throw marrow::Error("the file says so");
    list.add(name, Metrics{{{"value", double(name.size()), ""}}});
  }
  return list;
}

struct Case {
  List<Metrics> starts, truths;
};
/// As a case has them: no starts, but truths.
Case absent_and_not(const Options& options) { return {{}, fragments(options)}; }
Metrics between(const Metrics& start, const Metrics& truth) {
  return {{{"mtre_mm", start.items.at(0).value - truth.items.at(0).value, "mm"}}};
}

Metrics figures_of(const Metrics& of, const std::string& also) {
  Metrics made{{{"mtre_mm", of.items.at(0).value, "mm"}, {"frontal.median_px", 2, "px"}}};
  if (!also.empty()) made.items.push_back({also, 3, ""});
  return made;
}
Metrics judged(const Metrics& of, const marrow::Truth&) { return of; }
Metrics measured(const Metrics& of, const Options& options) { return figures_of(of, options.also); }

std::shared_ptr<const figures::Way> way() { return std::make_shared<const figures::Way>(); }
List<Metrics> stages(const Metrics& of, const figures::Way&) {
  List<Metrics> list;
  for (const char* name : {"start", "final"}) list.add(name, of);
  return list;
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.fragments", fragments)
      .summary("A number for each fragment of a case")
      .out("numbers", "the length of its name", marrow::over("fragment"))
      .figures({"value"})
      .option("path", &Options::path, "folder of the case");
  plugin.node("test.case", absent_and_not)
      .summary("Two lists over the fragments, of which one is absent")
      .out("starts", &Case::starts, "none", marrow::over("fragment"))
      .out("truths", &Case::truths, "a number for each", marrow::over("fragment"))
      .option("path", &Options::path, "folder of the case");
  plugin.node("test.between", between)
      .summary("A figure of both")
      .in("start", "number")
      .in("truth", "number")
      .out("metrics", "their difference")
      .figures({"mtre_mm"});
  plugin.kind("jury").summary("may see the truth").sees_truth();
  plugin.node("jury.test", judged)
      .summary("Needs the truth")
      .in("of", "number")
      .in("truth", "truth")
      .out("metrics", "the same")
      .figures({"judged_mm"});
  plugin.node("test.declared", measured)
      .summary("Figures that are declared")
      .in("of", "number")
      .out("metrics", "figures")
      .figures({"mtre_mm", "*.median_px"})
      .option("also", &Options::also, "name of a further figure");
  plugin.node("test.undeclared", measured)
      .summary("The same figures, without a declaration")
      .in("of", "number")
      .out("metrics", "figures")
      .option("also", &Options::also, "name of a further figure");
  plugin.node("test.way", way).summary("A function").out("way", "what a search needs");
  plugin.node("test.stages", stages)
      .summary("Stages of a search")
      .in("of", "number")
      .in("way", "function")
      .out("stages", "the same for the start and the end", marrow::over("stage"));
}
