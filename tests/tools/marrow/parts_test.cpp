// SPDX-License-Identifier: Apache-2.0
// What the commands print and decide, asked without the program.
#include <gtest/gtest.h>

#include <compare/cell_jobs.hpp>
#include <iostream>
#include <marrow/domain/random.hpp>
#include <thread>

#include "commands.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/yaml.hpp"
#include "marrow/runtime/node/node_builder.hpp"

namespace parts_test {

using namespace marrow;
using compare::CellRow;
using compare::Experiment;

// What a comparison of all pairs shows where nothing differs: in 500 simulated experiments, one or more findings in no
// more than the level says (as in null_experiments_test.cpp), over all pairs and figures together.

/// Variants a, b, ... in the figures f0, f1, ...; lower is better.
Experiment experiment_of(std::size_t variants, std::size_t metrics) {
  Experiment experiment;
  experiment.name = "pairs";
  for (std::size_t v = 0; v < variants; ++v) experiment.variants.push_back({std::string(1, char('a' + v)), {}, {}});
  for (std::size_t m = 0; m < metrics; ++m) {
    compare::MetricChoice metric;
    metric.path = metric.label = "f" + std::to_string(m);
    experiment.metrics.push_back(metric);
  }
  experiment.compare_all = true;
  experiment.starts.push_back({"0", {}, {}});
  return experiment;
}

void add_row(std::vector<CellRow>& rows, const Experiment& experiment, std::size_t variant, const std::string& name,
             const std::vector<std::optional<double>>& values) {
  CellRow row;
  row.variant = experiment.variants[variant].name;
  row.case_name = name;
  row.start = "0";
  row.id = row.variant + "/" + name + "/0";
  row.values = values;
  row.units.resize(values.size());
  rows.push_back(row);
}

/// A cell is lost with the probability `fails`, whatever its variant.
std::vector<CellRow> null_rows(const Experiment& experiment, Random& random, std::size_t cases, double fails,
                               bool is_skewed) {
  std::vector<CellRow> rows;
  for (std::size_t c = 0; c < cases; ++c) {
    const double of_case = random.normal();
    for (std::size_t v = 0; v < experiment.variants.size(); ++v) {
      std::vector<std::optional<double>> values;
      for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
        const double noise = is_skewed ? -std::log(1 - random.uniform()) : random.normal();
        values.push_back(random.uniform() < fails ? std::nullopt : std::optional(of_case + noise));
      }
      add_row(rows, experiment, v, std::to_string(c), values);
    }
  }
  return rows;
}

struct Setting {
  std::size_t variants, metrics, cases;
  double fails;
  bool is_skewed;
};

TEST(AllPairs, ShowNothingInNineteenOfTwentyNullExperiments) {
  for (const Setting& one : {Setting{3, 1, 20, 0, false},
                             {6, 1, 20, 0, true},
                             {6, 2, 20, 0, false},
                             {4, 1, 40, 0.2, false},
                             {6, 1, 60, 0, false}}) {
    const Experiment experiment = experiment_of(one.variants, one.metrics);
    int wrong = 0;
    for (int i = 0; i < 500; ++i) {
      Random random(std::uint64_t(i) + 1);
      const cli::Answer answer =
          cli::answer_of(experiment, null_rows(experiment, random, one.cases, one.fails, one.is_skewed));
      ASSERT_EQ(answer.pairs.size(), one.variants * (one.variants - 1) / 2 * one.metrics);
      bool any = false;
      for (const cli::PairFinding& pair : answer.pairs)
        any = any || compare::difference_shown(pair.finding.comparison, pair.finding.p_holm);
      wrong += any;
    }
    std::cout << "all pairs of " << one.variants << " variants in " << one.metrics << " figures, " << one.cases
              << " cases, " << one.fails << " lost" << (one.is_skewed ? ", skewed: " : ": ") << wrong << " of 500 ("
              << 0.2 * wrong << " %)\n";
    EXPECT_LE(wrong, 43);
  }
}

/// a and b alike, c and d 1 worse, e loses all.
TEST(AllPairs, RankInGroups) {
  const Experiment experiment = experiment_of(5, 1);
  std::vector<CellRow> rows;
  for (std::size_t c = 0; c < 20; ++c) {
    const double of_case = 5 + 0.1 * double(c), sign = c % 2 ? 0.01 : -0.01;
    const std::string name = std::to_string(c);
    add_row(rows, experiment, 0, name, {of_case + 1});
    add_row(rows, experiment, 1, name, {of_case});
    add_row(rows, experiment, 2, name, {std::nullopt});
    add_row(rows, experiment, 3, name, {of_case + sign});
    add_row(rows, experiment, 4, name, {of_case + 1 + sign});
  }
  const cli::Answer answer = cli::answer_of(experiment, rows);
  std::string order;
  for (const cli::Ranking::Place& place : answer.rankings[0].places)
    order += experiment.variants[place.variant].name + std::to_string(place.rank) + place.group + " ";
  EXPECT_EQ(order, "b1a d1a a3b e3b c5c ");
  EXPECT_EQ(cli::ranking_sentence(experiment, answer, 0),
            "best in f0: b; 8 of 10 pairs differ; not told apart from it: d");
  EXPECT_TRUE(std::isinf(answer.rankings[0].places[4].median));
  EXPECT_EQ(answer.rankings[0].places[4].lost, 20u);
}

/// b has the lower median, but a is better in 17 of 20 cases by a little.
TEST(AllPairs, SayWhereCasesContradictTheOrder) {
  const Experiment experiment = experiment_of(2, 1);
  std::vector<CellRow> rows;
  for (std::size_t c = 0; c < 20; ++c) {
    const double a = double(c);
    const bool is_middle = c == 9 || c == 10;
    add_row(rows, experiment, 0, std::to_string(c), {a});
    add_row(rows, experiment, 1, std::to_string(c), {is_middle ? a - 0.01 : a + 0.3});
  }
  const cli::Answer answer = cli::answer_of(experiment, rows);
  EXPECT_EQ(cli::ranking_sentence(experiment, answer, 0),
            "best in f0: b; 1 of 1 pairs differ; shown to be better than it, compared case by case: a; not told apart "
            "from it: none");
}

// How many cells of a comparison run at once: their threads are no more than the cores, unless a person says how many.

using marrow::cli::CompareRequest;
using marrow::cli::pool_of;

int workers(int jobs, int threads) {
  CompareRequest request;
  request.file = "experiment.yaml";
  request.jobs = jobs;
  return pool_of(request, "folder", threads).workers;
}

TEST(CellsAtOnce, HaveAsManyThreadsAsThereAreCores) {
  const int cores = int(std::thread::hardware_concurrency());
  EXPECT_EQ(workers(0, 1), cores);
  EXPECT_EQ(workers(0, cores), 1);
  EXPECT_EQ(workers(0, 2 * cores), 1) << "one cell runs in any case";
  for (int threads = 1; threads <= cores; ++threads) {
    EXPECT_LE(workers(0, threads) * threads, cores);
    EXPECT_GT((workers(0, threads) + 1) * threads, cores) << "no core is left over for another cell";
  }
}

TEST(CellsAtOnce, AreAsManyAsAPersonWants) { EXPECT_EQ(workers(7, 3), 7); }

// How the tables of a comparison write numbers, shares and columns. The texts follow from the values by hand.

using marrow::percent_text;
using marrow::cli::NumberScale;
using marrow::cli::Side;
using marrow::cli::TextTable;

TEST(FigureText, UsualNumbersHaveFourDecimals) {
  const NumberScale scale({0.5, 31.25, 0});
  EXPECT_EQ(scale.text(31.25), "31.2500");
  EXPECT_EQ(scale.text(0.5), "0.5000");
  EXPECT_EQ(scale.text(-0.0), "0.0000");
  EXPECT_EQ(NumberScale({}).text(0), "0.0000");
}

TEST(FigureText, NoNumberReadsAsZero) {
  EXPECT_EQ(NumberScale({3e-5, 4e-5}).text(3e-5), "0.00003000");
  EXPECT_EQ(NumberScale({1e-300}).text(1e-300), "1.000e-300");
  const NumberScale scale({1e-7, 2000});
  EXPECT_EQ(scale.text(2000), "2000.00000");
  EXPECT_EQ(scale.text(1e-7), "1.000e-07");
  EXPECT_EQ(scale.text(-1e-7), "-1.000e-07");
}

TEST(FigureText, LargeNumbersHaveAnExponent) {
  EXPECT_EQ(NumberScale({123456.7}).text(123456.7), "123457");
  EXPECT_EQ(NumberScale({1e7}).text(1e7), "1.000e+07");
  EXPECT_EQ(NumberScale({1e300, 0}).text(0), "0");
}

TEST(FigureText, NoShareReadsAsNoneOrAll) {
  EXPECT_EQ(percent_text(0, 1), "0.0");
  EXPECT_EQ(percent_text(1, 0), "100");
  EXPECT_EQ(percent_text(0.5, 1), "50.0");
  EXPECT_EQ(percent_text(1.0 / 301, 0), "0.3");
  EXPECT_EQ(percent_text(300.0 / 301, 0), "99.7");
  EXPECT_EQ(percent_text(1.0 / 3000, 1), "0.03");
  EXPECT_EQ(percent_text(2999.0 / 3000, 1), "99.97");
  EXPECT_EQ(percent_text(1e-20, 1), "1.0e-18");
  EXPECT_EQ(percent_text(std::nextafter(1.0, 0.0), 1), "99.99999999999999");
}

TEST(FigureText, ARateOfNothingIsNone) {
  EXPECT_EQ(marrow::cli::rate_text(0, 0, {0, 1}, 1), "-");
  EXPECT_EQ(marrow::cli::rate_text(1, 301, {0.0005, 0.0186}, 1), "1/301 (0.1 to 1.9 %)");
  EXPECT_EQ(marrow::cli::rate_text(1, 301, {0.0004, 0.0186}, 0), "1/301 (0.04 to 2 %)");
}

TEST(FigureText, ColumnsAreAsWideAsTheirTexts) {
  TextTable table({Side::left, Side::right, Side::left});
  table.add({"name", "number", "more"});
  table.add({"\xC3\xA9t\xC3\xA9", "12345678901234567890", "x"});  // three characters, five bytes
  table.add({"a\nb", "1"});
  EXPECT_EQ(table.text(),
            "name                  number  more\n"
            "\xC3\xA9t\xC3\xA9     12345678901234567890  x\n"
            "a\\x0ab                     1\n");
}

using marrow::OptionValue;
using marrow::cli::yaml_text;

TEST(CatalogueText, NumbersHaveTenDigits) {
  EXPECT_EQ(yaml_text(OptionValue(true)), "true");
  EXPECT_EQ(yaml_text(OptionValue(std::int64_t(-12))), "-12");
  EXPECT_EQ(yaml_text(OptionValue(0.1)), "0.1");
  EXPECT_EQ(yaml_text(OptionValue(100000.0)), "100000");
  EXPECT_EQ(yaml_text(OptionValue(1e-6)), "1e-06");
  EXPECT_EQ(yaml_text(OptionValue(1.0 / 3)), "0.3333333333");
  EXPECT_EQ(yaml_text(OptionValue(-std::numeric_limits<double>::infinity())), "-.inf");
}

TEST(CatalogueText, TextsReadBack) {
  const std::pair<std::string, std::string> texts[] = {{"mean", "mean"},
                                                       {"cases/femur.yaml", "cases/femur.yaml"},
                                                       {"ä", "ä"},
                                                       {"", R"("")"},
                                                       {"two words", R"("two words")"},
                                                       {"true", R"("true")"},
                                                       {"~", R"("~")"},
                                                       {"a: \"b\\\"", R"("a: \"b\\\"")"},
                                                       {"a\nb", R"("a\nb")"},
                                                       {"#x", R"("#x")"},
                                                       {"- x", R"("- x")"}};
  for (const auto& [text, written] : texts) {
    EXPECT_EQ(yaml_text(OptionValue(text)), written);
    EXPECT_EQ(marrow::parse_yaml(written).Scalar(), text);
  }
}

TEST(CatalogueText, ListsAreInOneLine) {
  EXPECT_EQ(yaml_text(OptionValue(std::vector<double>{})), "[]");
  EXPECT_EQ(yaml_text(OptionValue(std::vector<double>{1, -0.5, 1e7})), "[1, -0.5, 10000000]");
  EXPECT_EQ(yaml_text(OptionValue(std::vector<std::string>{"a", "b, c", ""})), R"([a, "b, c", ""])");
}

TEST(CatalogueText, RelationsInWords) {
  using marrow::cli::relation_text;
  EXPECT_EQ(relation_text(marrow::not_above("low", "high")), "'low' is not above 'high'");
  EXPECT_EQ(relation_text(marrow::below("a", "b")), "'a' is below 'b'");
  EXPECT_EQ(relation_text(marrow::same_length({"a", "b", "c"})), "'a', 'b', 'c' have the same length");
  EXPECT_EQ(relation_text(marrow::as_many_or_none("a", "b")), "'a' has as many items as 'b', or none");
  EXPECT_EQ(relation_text(marrow::exactly_one({"a", "in.b"})), "exactly one of 'a', 'in.b' is given");
  EXPECT_EQ(relation_text(marrow::at_least_one({"a", "b"})), "at least one of 'a', 'b' is given");
  EXPECT_EQ(relation_text(marrow::at_least_one({"a"})), "'a' is not empty");
  EXPECT_EQ(relation_text(marrow::distinct("a")), "'a' has no item twice");
}

TEST(CatalogueText, AKindWithItsLimits) {
  marrow::KindInfo kind;
  kind.name = "edges";
  kind.checks = {{"bias", "how far off", 0.25, "px"}, {"contract", "what it gives", 0, ""}};
  kind.traits = {{"steady", "does not move"}};
  kind.outputs = {{"edges", "the edges", {{"edge_map", {}}}, "view"}};
  const nlohmann::json j = marrow::cli::kind_json(kind);
  EXPECT_EQ(j["checks"][0]["limit"], 0.25);
  EXPECT_FALSE(j["checks"][1].contains("limit"));
  EXPECT_EQ(j["traits"][0]["name"], "steady");
  EXPECT_EQ(j["outputs"][0]["types"][0], "edge_map");
  EXPECT_EQ(j["outputs"][0]["axis"], "view");
}

}  // namespace parts_test
