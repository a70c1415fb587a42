// SPDX-License-Identifier: Apache-2.0
#pragma once
// Calls nodes as they are shipped: by name, out of their libraries. So a test is compiled in a moment, and says no more
// of a node than a pipeline could.
#include <marrow/testing/node.hpp>

namespace shipped = marrow::node_test;
