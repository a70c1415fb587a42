// SPDX-License-Identifier: Apache-2.0
// The names of figures that a node declares: the declaration, the manifest, and a node that makes another figure.
#include "marrow/runtime/run/output_faults.hpp"
#include "tests/framework/run_fixture.hpp"

namespace figure_names_test {

using marrow::Metrics;
using marrow::PortInfo;

const marrow::Catalogue& catalogue() {
  static const marrow::Catalogue figures({std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "plugins",
                                          std::filesystem::path(MARROW_BINARY_DIR) / "tests" / "figure_plugins"});
  return figures;
}

TEST(FigureNames, AreInTheManifest) {
  const marrow::NodeInfo* declared = catalogue().find("test.declared");
  ASSERT_TRUE(declared);
  EXPECT_EQ(declared->outputs[0].figures, (std::vector<std::string>{"mtre_mm", "*.median_px"}));
  EXPECT_TRUE(catalogue().find("test.undeclared")->outputs[0].figures.empty());
}

TEST(FigureNames, AStarStandsForAnyText) {
  PortInfo port;
  EXPECT_TRUE(may_have_figure(port, "anything")) << "nothing is known";
  port.figures = {"mtre_mm", "*.median_px", "median_*", "a*b*c"};
  for (const char* name : {"mtre_mm", "frontal.median_px", ".median_px", "a.b.median_px", "median_", "median_mtre_mm",
                           "abc", "a--b--c", "abbc"})
    EXPECT_TRUE(may_have_figure(port, name)) << name;
  for (const char* name : {"", "mtre_m", "mtre_mm2", "median.px", "frontal.median_pxx", "ab", "acb", "xabc"})
    EXPECT_FALSE(may_have_figure(port, name)) << name;
}

class FiguresOfARun : public run_fixture::RunTest {
 protected:
  const marrow::Catalogue& catalogue() const override { return figure_names_test::catalogue(); }
  marrow::RunResult run_also(const std::string& node, const std::string& also) {
    return run("  c: {uses: test.constant}\n  n: {uses: " + node + ", in: {of: c}, with: {also: " + also + "}}\n",
               "figures: n");
  }
};

TEST_F(FiguresOfARun, MustBeAmongTheDeclared) {
  const marrow::RunResult other = run_also("test.declared", "odd_mm");
  EXPECT_TRUE(other.failed());
  EXPECT_EQ(other.nodes.back().reason,
            "it gave an output 'metrics' that cannot be: the figure 'odd_mm' is not among those that its declaration "
            "names");
  EXPECT_FALSE(run_also("test.declared", "lateral.median_px").failed());
  EXPECT_FALSE(run_also("test.undeclared", "odd_mm").failed());
}

Metrics figures() { return {}; }
marrow::Pose pose() { return {}; }
std::vector<std::string> faults(const marrow::Plugin& plugin) { return plugin.nodes.back().faults; }

TEST(FigureNames, BelongToAnOutputOfFigures) {
  marrow::Plugin plugin;
  plugin.node("test.figures", figures).summary("s").out("metrics", "h").figures({"a", "b"});
  EXPECT_TRUE(faults(plugin).empty());
  EXPECT_EQ(plugin.nodes.back().info.outputs[0].figures, (std::vector<std::string>{"a", "b"}));
  plugin.node("test.pose", pose).summary("s").out("pose", "h").figures({"a"});
  EXPECT_EQ(faults(plugin),
            (std::vector<std::string>{"output 'pose': .figures() is for an output of figures, which are Metrics"}));
  plugin.node("test.early", figures).summary("s").figures({"a"}).out("metrics", "h");
  EXPECT_EQ(faults(plugin), (std::vector<std::string>{".figures() belongs after an .out()"}));
}

}  // namespace figure_names_test
