// SPDX-License-Identifier: Apache-2.0
#pragma once
// All simulation nodes in one file, for tests of the whole chain.
#include "plugins/simulate/case.cpp"
#include "plugins/simulate/ct.cpp"
#include "plugins/simulate/femur.cpp"
#include "plugins/simulate/fluoroscopy.cpp"
#include "plugins/simulate/fracture.cpp"
#include "plugins/simulate/surface.cpp"
