// SPDX-License-Identifier: Apache-2.0
// What stands above a recipe's pipeline, and that it does not name the user.
#include "marrow/runtime/run/replay.hpp"
#include "tests/framework/fixture.hpp"

namespace run_recipe_test {

class RunRecipeTest : public testing::Test {
 protected:
  std::string pipeline_with(const std::string& home, const std::string& pipeline) {
    environment_.set("HOME", home);
    const std::string text = marrow::RunRecipe{"1.2.3", 1, {}, pipeline}.text();
    return text.substr(text.find("--seed 1\n") + 9);
  }

 private:
  runtime_fixture::Environment environment_;
};

TEST_F(RunRecipeTest, SaysVersionSeedAndLimits) {
  EXPECT_EQ((marrow::RunRecipe{"1.2.3", 7, {}, "marrow: 1\n"}.text()),
            "# The recipe of a run with marrow 1.2.3.\n"
            "# As a file, it runs again by: marrow run FILE --seed 7\n"
            "marrow: 1\n");
  const std::string limited = marrow::RunRecipe{"1.2.3\n", 7, {512.5, 30}, "marrow: 1\n"}.text();
  EXPECT_EQ(limited,
            "# The recipe of a run with marrow 1.2.3\\x0a.\n"
            "# As a file, it runs again by: marrow run FILE --seed 7 --file-memory 512.5 --file-seconds 30\n"
            "marrow: 1\n");
}

TEST_F(RunRecipeTest, NamesNoHomeFolderAndKeepsOtherPaths) {
  for (const std::string home : {"/home/jane", "/home/jane/"})
    EXPECT_EQ(
        pipeline_with(home, "a: /home/jane/ct\nb: [/home/jane, \"/home/jane/x y\"]\nc: cp /home/jane/a /home/jane"),
        "a: $env:HOME/ct\nb: [$env:HOME, \"$env:HOME/x y\"]\nc: cp $env:HOME/a $env:HOME");
  const std::string others = "a: /home/jane2/ct\nb: /data/home/jane/ct\nc: /home/jane.old\nd: /home\n";
  EXPECT_EQ(pipeline_with("/home/jane", others), others);
  for (const std::string no_home : {"", "/", "jane"}) EXPECT_EQ(pipeline_with(no_home, others), others);
}

}  // namespace run_recipe_test
