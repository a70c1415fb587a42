// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>

/// edges.adaptive_relaxation with its defaults.
marrow::EdgeMap find_edges(const marrow::View& view);
