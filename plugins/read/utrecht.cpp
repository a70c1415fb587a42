// SPDX-License-Identifier: Apache-2.0
// Data in the manner of Utrecht's gold standard for 2D/3D registration (van de Kraats et al., IEEE TMI 24:1177, 2005).
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/exchange/utrecht_file.hpp"

namespace {

using namespace marrow;

const std::string kFragment = "object";  // the same for all objects, so that one figure compares them

struct Options {
  std::filesystem::path path;
  std::string object;
  std::vector<std::string> projections;
  int number = 0;
  std::string masks = "3d";
};

struct Read {
  Volume ct;
  List<Volume> label;
  List<View> views;
  List<Pose> start;
  List<Truth> truth;
};

/// The object and the start that the options name; of `number`, which counts the starts of all objects in turn.
std::pair<std::string, std::size_t> chosen(const exchange::UtrechtData& data, const Options& options) {
  const std::vector<std::string> known = data.objects.names();
  if (options.number == 0 || !options.object.empty()) {
    if (!data.objects.find(options.object))
      throw Error("object: there is no '" + options.object + "'; " + suggestion(options.object, known));
    if (std::size_t(options.number) > data.starts.size())
      throw Error(
          formatted("number: there are {} starts, so there is none of number {}", data.starts.size(), options.number));
    return {options.object, std::size_t(options.number)};
  }
  const std::size_t all = data.starts.size() * known.size();
  if (std::size_t(options.number) > all)
    throw Error(formatted("number: {} starts of {} objects are {}, so there is none of number {}", data.starts.size(),
                          known.size(), all, options.number));
  const std::size_t index = std::size_t(options.number - 1);
  return {known[index / data.starts.size()], index % data.starts.size() + 1};
}

List<View> views_of(const Options& options, const std::string& object) {
  List<View> views;
  const List<exchange::UtrechtView> all = exchange::read_utrecht_views(options.path, object);
  for (const std::string& name : options.projections)
    if (!all.find(name)) throw Error("projections: there is no '" + name + "'; " + suggestion(name, all.names()));
  for (const exchange::UtrechtView& seen : all) {
    const auto& wanted = options.projections;
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), seen.view.name) == wanted.end()) continue;
    View view = seen.view;
    if (options.masks == "2d") {
      if (seen.object.empty())
        throw Error("masks: projection '" + view.name + "' has no mask of '" + object + "'; take masks: 3d");
      view.mask = seen.object;
    }
    views.add(view.name, std::move(view));
  }
  return views;
}

Read utrecht(const Options& options, Context& context) {
  exchange::UtrechtData data = exchange::read_utrecht(options.path);
  const auto [name, number] = chosen(data, options);
  const exchange::UtrechtObject& object = *data.objects.find(name);
  if (object.inside.empty())
    throw Error("object '" + name + "' has no mask in 3D, from which its surface is made; name it as 'mask'");
  Read read;
  read.views = views_of(options, name);
  read.label.add(kFragment, {data.volume.grid, {object.inside.begin(), object.inside.end()}});
  Pose start;
  start.world_from_model = number == 0
                               ? data.world_from_volume
                               : exchange::started(data.starts[number - 1], data.world_from_volume, object.centre_mm);
  read.start.add(kFragment, std::move(start));
  read.truth.add(kFragment, {data.world_from_volume});
  read.ct = std::move(data.volume);
  context.info("object " + name + (number ? formatted(", start {}", number) : std::string(", at the gold standard")));
  return read;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.utrecht", utrecht)
      .summary(
          "Reads an object, its projections and one of its starts from data in the manner of Utrecht's gold standard "
          "for 2D/3D registration (van de Kraats et al., IEEE TMI 2005)")
      .out("ct", &Read::ct, "the volume, in the units of its file plus value_offset_hu")
      .out("label", &Read::label, "the object's mask in 3D: 1 inside, 0 outside", over("fragment"))
      .out("views", &Read::views, "projections with cameras, seen from the source", over("view"))
      .out("start", &Read::start, "the start that was asked for", over("fragment"))
      .out("truth", &Read::truth, "the gold standard", over("fragment"))
      .option("path", &Options::path, "the description (YAML, docs/public-data.md)", required())
      .option("object", &Options::object, "name of the object; not given: 'number' counts the starts of all objects")
      .option("projections", &Options::projections, "names of the projections to use; none: all")
      .option("number", &Options::number, "which start, from 1; 0: the gold standard itself", at_least(0))
      .option("masks", &Options::masks, "3d: the object's surface alone; 2d: the images are masked, too",
              one_of({"3d", "2d"}));
}
