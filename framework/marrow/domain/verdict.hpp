// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/domain/pose.hpp"

namespace MARROW_EXPORT marrow {

/// Whether a pose can be relied on. A larger value is worse.
enum class Judgement : std::uint8_t {
  trusted,
  doubtful,  ///< more information must decide, such as another view
  wrong,
};
constexpr bool is_valid(Judgement judgement) { return judgement <= Judgement::wrong; }

/// "trusted", "doubtful" or "wrong".
constexpr const char* name_of(Judgement judgement) {
  constexpr const char* kNames[] = {"trusted", "doubtful", "wrong"};
  return kNames[int(judgement)];
}
/// The judgement of this name; nothing for any other text.
inline std::optional<Judgement> judgement_named(std::string_view name) {
  for (const Judgement one : {Judgement::trusted, Judgement::doubtful, Judgement::wrong})
    if (name == name_of(one)) return one;
  return std::nullopt;
}

/// A pose is off if its mTRE over the fragment's surface is above this length, or if it is rotated about the fragment's
/// long axis by more than this angle.
inline constexpr double kMostError_mm = 2;
inline constexpr double kMostAxialError_deg = 5;

/// How far a pose can be relied on. It is made without knowing the true pose.
struct Verdict {
  Judgement judgement = Judgement::doubtful;
  /// Probability (0 to 1) that the pose is off, as defined at kMostError_mm. NaN if it is not known.
  double failure_probability = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::string> reasons;   ///< in words, the most important first
  std::vector<std::string> remedies;  ///< in words: what would decide it; empty for a trusted pose
  std::vector<Metric> figures;        ///< the numbers behind the reasons

  using fields = Fields<&Verdict::judgement, &Verdict::failure_probability, &Verdict::reasons, &Verdict::remedies,
                        &Verdict::figures>;
};

/// Whether a repetition ends after this pass.
struct Stop {
  bool stops = false;
  std::string reason;  ///< in words, also of a pass that does not stop; may be empty

  using fields = Fields<&Stop::stops, &Stop::reason>;
};

}  // namespace marrow
