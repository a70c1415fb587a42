// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

/// Has VTK's filters use so many threads; the name of what they run on, "TBB".
std::string use_vtk_threads(int count);
