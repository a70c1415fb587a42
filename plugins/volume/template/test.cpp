// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

TEST(NewNode, BridgesTheSlicesOfAScrew) {
  marrow::Volume volume;
  volume.grid.size = {30, 20, 10};
  for (int z = 0; z < 10; ++z) volume.values.insert(volume.values.end(), 600, float(100 * z));
  for (int y = 8; y < 12; ++y)  // a screw of 20 mm within slice 5
    for (int x = 5; x < 25; ++x) volume.values[volume.grid.offset(x, y, 5)] = 4000;
  const auto bridged =
      node_test::call("volume.new_node", {{"volume", node_test::item(volume)}}).at("volume").as<marrow::Volume>();
  EXPECT_EQ(bridged.grid.size, volume.grid.size);
  EXPECT_NEAR(bridged.at(10, 10, 5), 500, 1e-3) << "between 300 below the screw and 700 above";
  EXPECT_EQ(bridged.at(10, 10, 1), 100) << "a slice without metal stays";
}
