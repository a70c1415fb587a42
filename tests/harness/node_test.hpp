// SPDX-License-Identifier: Apache-2.0
#pragma once
// What nearly all tests of nodes use. Tests lie in a namespace within marrow::test, so they name these without a
// prefix.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <marrow/plugin.hpp>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "shipped.hpp"
#include "tests/harness/bodies.hpp"
#include "tests/harness/cameras.hpp"
#include "tests/harness/edges.hpp"
#include "tests/harness/figures.hpp"
#include "tests/harness/functions.hpp"
#include "tests/harness/grids.hpp"
#include "tests/harness/heard.hpp"
#include "tests/harness/message_of.hpp"
#include "tests/harness/poses.hpp"
#include "tests/harness/views.hpp"

namespace marrow::test {

using namespace marrow::node_test;
using Eigen::Vector2d, Eigen::Vector3d, Eigen::Matrix3d;
using Strings = std::vector<std::string>;
using Numbers = std::vector<double>;

}  // namespace marrow::test
