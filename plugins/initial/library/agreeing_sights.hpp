// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which landmarks agree on one pose. A network, or a tired person, may put one of them in a wrong place, and least
// squares would follow it.
#include <marrow/domain/pose.hpp>
#include <vector>

#include "marrow/initial/pose_starts.hpp"

namespace marrow::initial {

/// A sight farther than this many of its deviations from where the others' pose shows it is wrong.
constexpr double kMostDeviations = 5;

/// For each sight, whether it agrees with the pose that most of them agree on. All are true for fewer than six sights,
/// and if least squares of all of them leave none farther than kMostDeviations and twice the stated deviations at most.
/// All are true, too, if more than a third would be wrong: then it is not known which are.
///
/// The pose minimises the truncated squares by graduated non-convexity (Yang, Antonante, Tzoumas and Carlone, IEEE RA-L
/// 5, 2020, Section IV with the weights of Eq 14), from the starts of all sights and of those without each name.
std::vector<bool> agreeing_sights(const std::vector<Sight>& sights, const FragmentFrame& frame);

}  // namespace marrow::initial
