// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a comparison over time says: in the terminal, as JSON, as a table of all curves, and as a page.
#include <nlohmann/json.hpp>

#include "curves/compared_sequences.hpp"

namespace marrow::cli {

/// All that `marrow curves` compared. Either list may be empty.
struct CurveAnswer {
  std::vector<ComparedSequences> sequences;
  std::vector<ComparedTrials> trials;
};

/// "way/bone.axial_deg: the second is 0.12 deg larger on average, ..."
std::string sentence_of(const ComparedFigure& figure);
std::string sentence_of(const TrialFigure& figure);

void print(const CurveAnswer& answer);
nlohmann::json json_of(const CurveAnswer& answer);
/// A row for each figure and time of each comparison, and of trials for each trial.
std::string csv_of(const CurveAnswer& answer);

/// Writes curves.json, curves.csv and report.html into a folder that is new or empty. Throws Error for another one.
void write_curves(const CurveAnswer& answer, const std::filesystem::path& folder);

}  // namespace marrow::cli
