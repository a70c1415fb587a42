// SPDX-License-Identifier: Apache-2.0
// Nodes that declare what their options must be to each other; none of them tests it.
#include <marrow/plugin.hpp>

namespace {
using marrow::Metrics;

Metrics number() { return {{{"value", 1, ""}}}; }

struct Limits {
  double low = 50, high = 75;
  double near_mm = 600, far_mm = 1000;
  int first = 1, last = 10;
};
Metrics limits(const Limits&) { return number(); }

struct Lists {
  std::vector<double> alpha_deg{0, 0}, beta_deg{0, 90};
  std::vector<std::string> names;
  std::vector<std::filesystem::path> paths;
  std::vector<double> sizes, weights;
  std::vector<std::string> labels;
};
Metrics lists(const Lists&) { return number(); }

struct Sources {
  std::filesystem::path file;
  std::vector<std::string> words;
};
Metrics one_of_two(const Metrics*, const Sources&) { return number(); }
Metrics one_of_three(const Metrics*, const Sources&) { return number(); }
Metrics one_or_both(const Metrics*, const Sources&) { return number(); }

struct Words {
  std::vector<std::string> words{"one"};
  std::vector<double> sizes;
};
Metrics each_once(const Words&) { return number(); }
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.number", number).summary("A number").out("number", "1");
  plugin.node("test.limits", limits)
      .summary("Numbers in their order")
      .out("number", "1")
      .option("low", &Limits::low, "at most high", marrow::at_least(0), marrow::at_most(100))
      .option("high", &Limits::high, "at least low", marrow::at_least(0), marrow::at_most(100))
      .relation(marrow::not_above("low", "high"))
      .option("near_mm", &Limits::near_mm, "less than far_mm")
      .option("far_mm", &Limits::far_mm, "more than near_mm")
      .relation(marrow::below("near_mm", "far_mm"))
      .option("first", &Limits::first, "less than last")
      .option("last", &Limits::last, "more than first")
      .relation(marrow::below("first", "last"));
  plugin.node("test.lists", lists)
      .summary("Lists that go together")
      .out("number", "1")
      .option("alpha_deg", &Lists::alpha_deg, "as many as beta_deg")
      .option("beta_deg", &Lists::beta_deg, "as many as alpha_deg")
      .relation(marrow::same_length({"alpha_deg", "beta_deg"}))
      .option("paths", &Lists::paths, "files")
      .option("names", &Lists::names, "one for each of paths, or none")
      .relation(marrow::as_many_or_none("names", "paths"))
      .option("sizes", &Lists::sizes, "as many as weights and labels")
      .option("weights", &Lists::weights, "as many as sizes and labels")
      .option("labels", &Lists::labels, "as many as sizes and weights")
      .relation(marrow::same_length({"sizes", "weights", "labels"}));
  plugin.node("test.one_of_two", one_of_two)
      .summary("An input or an option")
      .in("number", "where no file is given")
      .out("number", "1")
      .option("file", &Sources::file, "where no number is wired")
      .relation(marrow::exactly_one({"in.number", "file"}));
  plugin.node("test.one_of_three", one_of_three)
      .summary("An input or one of two options")
      .in("number", "a number")
      .out("number", "1")
      .option("file", &Sources::file, "a file")
      .option("words", &Sources::words, "words")
      .relation(marrow::exactly_one({"in.number", "file", "words"}));
  plugin.node("test.one_or_both", one_or_both)
      .summary("An input, an option, or both")
      .in("number", "a number")
      .out("number", "1")
      .option("file", &Sources::file, "a file")
      .relation(marrow::at_least_one({"in.number", "file"}));
  plugin.node("test.each_once", each_once)
      .summary("Words, each once")
      .out("number", "1")
      .option("words", &Words::words, "words")
      .relation(marrow::at_least_one({"words"}))
      .relation(marrow::distinct("words"))
      .option("sizes", &Words::sizes, "sizes")
      .relation(marrow::distinct("sizes"));
}
