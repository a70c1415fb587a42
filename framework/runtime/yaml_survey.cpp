// SPDX-License-Identifier: Apache-2.0
#include "yaml_survey.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

namespace marrow {
namespace {

constexpr std::size_t kMostLevels = 100;
constexpr std::size_t kMostRepeated = 100'000;  // values, by aliases

[[noreturn]] void refuse(const YAML::Mark& mark, const std::string& why) { throw YAML::Exception(mark, why); }

/// Counts values and levels as they would be with every alias written out.
class Survey : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++) refuse(mark, "the file goes on after the end of its first document; keep one document a file");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { add(mark, anchor); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string& text) override {
    if (text.find('\0') != std::string::npos)  // names of files and sentences would end there
      refuse(mark, "a text holds the character NUL (\\0); take it out");
    add(mark, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, anchor);
  }
  void OnMapEnd() override { close(); }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) refuse(mark, "an alias names a list or map that it is in itself");
    repeated_ += found->second.values;
    if (repeated_ > kMostRepeated)
      refuse(mark, "aliases repeat more than " + std::to_string(kMostRepeated) +
                       " values; write out what is meant, or less of it");
    count(mark, found->second);
  }

 private:
  struct Extent {
    std::size_t values = 1, levels = 0;
  };
  struct Open {
    YAML::anchor_t anchor;
    Extent extent;
  };

  void add(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor) anchored_[anchor] = {};
    count(mark, {});
  }
  void open(const YAML::Mark& mark, YAML::anchor_t anchor) {
    open_.push_back({anchor, {1, 1}});
    check_levels(mark, 0);
  }
  void close() {
    const Open last = open_.back();
    open_.pop_back();
    if (last.anchor) anchored_[last.anchor] = last.extent;
    if (!open_.empty()) merge(last.extent);
  }
  void count(const YAML::Mark& mark, const Extent& extent) {
    check_levels(mark, extent.levels);
    if (!open_.empty()) merge(extent);
  }
  void merge(const Extent& inner) {
    Extent& outer = open_.back().extent;
    outer.values += inner.values;
    outer.levels = std::max(outer.levels, inner.levels + 1);
  }
  void check_levels(const YAML::Mark& mark, std::size_t below) const {
    if (open_.size() + below > kMostLevels)
      refuse(mark, "lists and maps are nested more than " + std::to_string(kMostLevels) + " deep");
  }

  std::vector<Open> open_;
  std::map<YAML::anchor_t, Extent> anchored_;
  std::size_t repeated_ = 0;
  int documents_ = 0;
};

}  // namespace

void survey_yaml(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Survey survey;
  while (parser.HandleNextDocument(survey)) {
  }  // what follows the first document would be left out without a word
}

}  // namespace marrow
