// SPDX-License-Identifier: Apache-2.0
// segment.level_set against ITK's geodesic active contour on a bone that no threshold segments, and its time and memory
// on a whole CT. Each measurement has a process of its own, so that its peak memory is its own. All use two threads.
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "itk_geodesic.hpp"
#include "marrow/toolbox/field/interior.hpp"
#include "plugins/segment/level_set.cpp"
#include "tests/benchmarks/timing.hpp"
#include "tests/plugins/segment/phantom.hpp"

namespace {

constexpr unsigned kThreads = 2;

using timing::Stopwatch;

std::string text_of(const Stopwatch& stopwatch) {
  char text[80];
  std::snprintf(text, sizeof text, "%.2f s (%.2f s of processor time)", stopwatch.seconds(), stopwatch.processor_s());
  return text;
}

bool has_failed = false;

/// Runs work in a process of its own, with two threads, and prints its peak memory.
void measure(const char* what, const std::function<void()>& work) {
  std::printf("\n%s\n", what);
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, kThreads);
    try {
      work();
    } catch (const std::exception& error) {
      std::printf("  failed: %s\n", error.what());
      std::fflush(stdout);
      _exit(1);
    }
    std::fflush(stdout);
    _exit(0);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  has_failed |= status != 0;
  std::printf("  peak memory %.2f GB\n", double(usage.ru_maxrss) / 1048576);
}

Context logging() {
  Context::Hooks hooks;
  hooks.log = [](std::string_view message, marrow::LogLevel) {
    std::printf("    %.*s\n", int(message.size()), message.data());
  };
  return Context(hooks);
}

void print(const std::string& what, const phantom::Accuracy& a) {
  std::printf("%-34s Dice %.4f  bias %+.3f mm  mean %.3f mm  rms %.3f mm  largest %.2f mm  (%zu points)\n",
              what.c_str(), a.dice, a.bias_mm, a.mean_mm, a.rms_mm, a.largest_mm, a.points);
}

/// Both fragments as one body for Dice, each fragment's surface for distances.
void print_accuracy(const phantom::DistalEnd& bone, const List<SignedField>& fields) {
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const int side = f == 0 ? 1 : -1;
    const auto truth = [&](const Eigen::Vector3d& p) { return bone.distance(p, side); };
    // The canal's mouth at the volume's end is no surface of the bone.
    const auto not_the_end = [](const Eigen::Vector3d& p) { return p.z() < 90; };
    const auto at_fracture = [&](const Eigen::Vector3d& p) { return std::abs(bone.over_cut_mm(p)) < 2.5; };
    print("  " + fields.name(f), phantom::compare(fields[f], truth, not_the_end));
    print("    outer surface",
          phantom::compare(fields[f], truth, [&](const auto& p) { return not_the_end(p) && !at_fracture(p); }));
    print("    fracture", phantom::compare(fields[f], truth, at_fracture));
  }
}

void our_level_set(const phantom::DistalEnd& bone, const Volume& volume, const Options& options) {
  Context context = logging();
  const Stopwatch stopwatch;
  const auto fields = level_set_fields(volume, bone.seeds(), options, context);
  std::printf("  %s for both fragments\n", text_of(stopwatch).c_str());
  print_accuracy(bone, fields);
}

void itk_contour(const phantom::DistalEnd& bone, const Volume& volume, const itk_peer::Settings& settings) {
  std::vector<std::vector<std::array<int, 3>>> seeds;
  const auto list = bone.seeds();
  for (const Seeds& one : list) {
    auto& points = seeds.emplace_back();
    for (const auto& point : one.points_mm) {
      const Eigen::Vector3d index = volume.grid.index_from_point(point);
      points.push_back({int(std::lround(index.x())), int(std::lround(index.y())), int(std::lround(index.z()))});
    }
  }
  const auto& s = volume.grid.spacing_mm;
  const Stopwatch stopwatch;
  const auto results =
      itk_peer::geodesic_active_contours(volume.values, volume.grid.size, {s.x(), s.y(), s.z()}, seeds, settings);
  std::printf("  %s for both fragments: speed image %.2f s", text_of(stopwatch).c_str(), results[0].speed_image_s);
  for (std::size_t f = 0; f < results.size(); ++f)
    std::printf(", %s %d iterations %.2f s", list.name(f).c_str(), results[f].iterations, results[f].contour_s);
  std::printf("\n");
  List<SignedField> fields;
  // A contour that began in the cortex leaves the canal out: filled here as segment.level_set fills it, outside the
  // time.
  for (std::size_t f = 0; f < results.size(); ++f) {
    std::vector<std::uint8_t> is_bone(volume.grid.count()), is_other(volume.grid.count());
    SignedField field{volume.grid, results[f].field};
    for (std::size_t at = 0; at < is_bone.size(); ++at) {
      is_bone[at] = field.values_mm[at] < 0;
      is_other[at] = results[1 - f].field[at] < 0;
    }
    marrow::field::fill_interior(volume.grid, is_bone, is_other);
    for (std::size_t at = 0; at < is_bone.size(); ++at)
      if (is_bone[at]) field.values_mm[at] = std::min(field.values_mm[at], -0.4f);
    fields.add(list.name(f), std::move(field));
  }
  print_accuracy(bone, fields);
}

/// A hollow shaft in a whole CT, its blur by formula: the scene's sub-voxels would fill the memory.
Volume whole_ct(double length_mm) {
  const std::array<int, 3> size = timing::is_short() ? std::array{256, 128, 128} : std::array{512, 512, 400};
  Volume volume{phantom::ct_grid(size), {}};
  volume.values.resize(volume.grid.count());
  tbb::parallel_for(0, size[2], [&](int z) {
    std::minstd_rand random(unsigned(z + 1));
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        const Eigen::Vector3d p = volume.grid.point_from_index(Eigen::Vector3d(x, y, z));
        const double outer = phantom::round_cone(p, {60, 20, -length_mm / 2}, {70, 25, length_mm / 2}, 22, 14);
        const auto inside = [](double d) { return 1 / (1 + std::exp(std::clamp(2.4 * d / 0.7, -30.0, 30.0))); };
        const double gap = inside(0.5 - std::abs(p.z()));
        const double bone = inside(outer) * gap, canal = inside(outer + 5) * gap;
        const double noise =
            40 * (double(random()) + double(random()) + double(random()) - 1.5 * 2147483647.0) / 2147483647.0 * 2;
        volume.values[volume.grid.offset(x, y, z)] = float(std::round(50 + 1250 * bone - 1340 * canal + noise));
      }
  });
  return volume;
}

void whole_ct_case(double length_mm) {
  const Volume volume = whole_ct(length_mm);
  List<Seeds> seeds;
  for (const auto& [name, z] : {std::pair{"proximal", 20.0}, {"distal", -20.0}}) {
    const double part = 0.5 + z / length_mm, to_wall_mm = 22 - 8 * part - 2.5;
    seeds.add(name, Seeds{name,
                          {{60 + 10 * part + to_wall_mm, 20 + 5 * part, z},
                           {60 + 10 * part - to_wall_mm, 20 + 5 * part, z}}});
  }
  Context context;
  const Stopwatch stopwatch;
  const auto fields = level_set_fields(volume, seeds, {}, context);
  const std::string time = text_of(stopwatch);
  std::size_t surface = 0;
  for (const SignedField& field : fields)
    for (float value : field.values_mm) surface += std::abs(value) < 0.5f;
  std::printf("  %s, %zu voxels within 0.5 mm of the surfaces\n", time.c_str(), surface);
}

}  // namespace

/// Without arguments: everything. "crop", "itk", "whole": only that. A short run has a smaller CT and few iterations.
int main(int count, char** arguments) {
  const auto is_asked = [&](const char* what) { return count < 2 || std::strcmp(arguments[1], what) == 0; };
  itk_peer::Settings settings;
  settings.most_iterations = timing::is_short() ? 3 : settings.most_iterations;
  std::printf("ITK %s, marrow %s; %u threads\n", itk_peer::version().c_str(), MARROW_VERSION, kThreads);
  const phantom::DistalEnd bone;
  const auto crop = [&] { return bone.scan_of({128, 128, 192}, 40); };
  if (is_asked("crop")) measure("segment.level_set, 128 x 128 x 192", [&] { our_level_set(bone, crop(), {}); });
  if (is_asked("itk"))
    measure("ITK's geodesic active contour, 128 x 128 x 192", [&] { itk_contour(bone, crop(), settings); });
  if (is_asked("whole"))
    for (const double length_mm : timing::is_short() ? std::vector{80.0} : std::vector{80.0, 160.0, 320.0})
      measure(("segment.level_set, 512 x 512 x 400, bone of " + std::to_string(int(length_mm)) + " mm").c_str(),
              [&] { whole_ct_case(length_mm); });
  return has_failed ? 2 : 0;
}
