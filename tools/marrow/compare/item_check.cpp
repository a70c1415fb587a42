// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <set>
#include <tuple>

#include "command_options.hpp"
#include "compare/cell_jobs.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRunner;
using compare::Experiment;
using compare::NamedItem;

class ItemCheck {
 public:
  ItemCheck(const CompareRequest& request, const Experiment& experiment, const CellRunner& runner,
            const fs::path& folder, bool makes_cases)
      : request_(request), experiment_(experiment), runner_(runner), folder_(folder), makes_cases_(makes_cases) {}

  int run(std::vector<NamedItem> open) {
    for (const std::size_t one : {std::size_t(0), experiment_.cases.size() - 1}) {
      if (open.empty() || contains(cases_, experiment_.cases[one].name)) break;
      if (!learn(one, open)) return stopped();
      if (!why_not_.empty()) {
        if (!request_.quiet) say_note("whether there are the items that figures name is not checked: " + why_not_);
        return 0;
      }
      cases_.push_back(experiment_.cases[one].name);
      std::erase_if(open, [&](const NamedItem& item) {
        return names_[from(item)].empty() || contains(names_[from(item)], item.item);
      });
    }
    if (open.empty()) return 0;
    print(open);
    return 2;
  }

 private:
  /// Figures that name items along the same axis of the same output ask the same.
  using Source = std::tuple<std::size_t, std::string, int, std::string>;
  static Source from(const NamedItem& item) { return {item.variant, item.node, item.output, item.axis}; }

  /// Adds the names of a case. Returns false if it was interrupted. If a node fails, why_not_ says why.
  bool learn(std::size_t case_number, const std::vector<NamedItem>& items) {
    const std::string& name = experiment_.cases[case_number].name;
    const fs::path place = runner_.case_place(case_number);
    if (!place.empty() && !fs::exists(place)) {
      if (!makes_cases_) why_not_ = "case '" + name + "' is not made yet";
      if (!makes_cases_) return true;
    }
    if (!request_.quiet)
      std::fprintf(stderr, "  %s case %s, to see which items it has\n",
                   place.empty() || fs::exists(place) ? "looking at" : "making", printable(name).c_str());
    std::vector<Job> jobs;
    std::set<Source> asked;
    for (std::size_t i = 0; i < items.size(); ++i)
      if (asked.insert(from(items[i])).second)
        jobs.push_back({{{"do", "items"},
                         {"cell", compare::cell_id(experiment_, {items[i].variant, case_number, 0})},
                         {"node", items[i].node},
                         {"output", items[i].output},
                         {"axis", items[i].axis}},
                        "items",
                        i});
    return run_jobs(jobs, pool_of(request_, folder_, request_.threads), [&](const Job& job, const JobEnd& end) {
      std::vector<std::string>& names = names_[from(items[job.number])];
      if (!end.failed.empty()) why_not_ = end.failed;
      if (end.failed.empty())
        for (const std::string name : end.answer)
          if (!contains(names, name)) names.push_back(name);
    });
  }

  void print(const std::vector<NamedItem>& items) {
    Diagnostics found;
    found.remember(experiment_.file.string(), plain_text(experiment_.text));
    const std::string in = (cases_.size() > 1 ? " in the cases '" : " in case '") + joined(cases_, "' and '") + "'";
    for (const NamedItem& item : items) {
      Diagnostics one;
      one.add(item.place, "'" + item.path + "': there is no " + item.axis + " '" + item.item + "'" + in,
              suggestion(item.item, names_[from(item)]));
      found.add_all(one);  // several variants may have the same fault
    }
    print_faults(found);
  }

  const CompareRequest& request_;
  const Experiment& experiment_;
  const CellRunner& runner_;
  const fs::path& folder_;
  bool makes_cases_;
  std::vector<std::string> cases_;  ///< that were looked at
  std::map<Source, std::vector<std::string>> names_;
  std::string why_not_;
};

}  // namespace

int check_items(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
                const fs::path& folder, const Store* store, bool makes_cases) {
  CellRunner runner(experiment, catalogue, store, folder, request.threads, request.file_limits);
  std::vector<NamedItem> open = experiment.named_items;
  const fs::path place = open.empty() ? fs::path() : runner.case_place(0);
  if (place.empty() || fs::exists(place))
    std::erase_if(open, [&](const NamedItem& item) {
      const compare::CellIndex first{item.variant, 0, 0};
      return runner.finished(first, runner.key_of(first)).has_value();
    });
  return ItemCheck(request, experiment, runner, folder, makes_cases).run(open);
}

}  // namespace marrow::cli
