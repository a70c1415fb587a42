// SPDX-License-Identifier: Apache-2.0
#include "difference/difference.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>

#include "difference/numbers.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/run/verdicts.hpp"

namespace marrow::cli {
namespace {

double percent(std::size_t part, std::size_t all) { return all ? 100.0 * double(part) / double(all) : 0; }

template <class T>
void compare(const T& a, const T& b, Amount& amount);

/// Compares a part of a value and adds the result under the part's name.
template <class T>
void compare_part(const std::string& name, const T& a, const T& b, Amount& amount) {
  if (hash_of(a) == hash_of(b)) return;
  Amount part;
  compare(a, b, part);
  for (const std::string& line : part.lines) amount.lines.push_back(name + ": " + line);
  amount.facts[name] = part.facts;
}

template <class T>
void compare_lists(const std::string& what, const List<T>& a, const List<T>& b, Amount& amount) {
  for (const std::string& name : a.names())
    if (const T* other = b.find(name))
      compare_part(what + " " + name, *a.find(name), *other, amount);
    else
      amount.lines.push_back(what + " " + name + ": it is not there, was there");
  for (const std::string& name : b.names())
    if (!a.find(name)) amount.lines.push_back(what + " " + name + ": it was not there");
}

/// Compares values of any type, number by number.
template <class T>
void compare_numbers(const T& a, const T& b, Amount& amount) {
  NumberDifference numbers;
  numbers.add(a, b);
  amount.facts = {{"numbers", numbers.count},
                  {"differ", numbers.differ},
                  {"largest", numbers.largest},
                  {"texts_differ", numbers.texts},
                  {"same_shape", numbers.same_shape}};
  if (numbers.differ)
    amount.lines.push_back(
        formatted("{} of {} numbers differ, by at most {:.4g}", numbers.differ, numbers.count, numbers.largest));
  if (numbers.texts) amount.lines.push_back(formatted("{} texts differ", numbers.texts));
  if (!numbers.same_shape) amount.lines.push_back("lists in it are of other lengths");
}

void compare_placement(const RigidTransform& a, const RigidTransform& b, const FragmentFrame* frame, Amount& amount) {
  if (a.target != b.target || a.source != b.source) {
    amount.lines.push_back("it leads from '" + b.source + "' to '" + b.target + "', led from '" + a.source + "' to '" +
                           a.target + "'");
    return;
  }
  const Eigen::Vector3d point = frame ? frame->origin_mm : Eigen::Vector3d::Zero();
  const double angle_deg = degrees(geodesic_angle_rad(a.rotation, b.rotation)),
               distance_mm = (b * point - a * point).norm();
  amount.facts = {{"rotation_deg", angle_deg}, {"displacement_mm", distance_mm}};
  const std::string where = frame ? "the fragment's centroid" : "the origin of '" + a.source + "'";
  std::string line = formatted("{:.4g} deg and {:.4g} mm apart at {}", angle_deg, distance_mm, where);
  if (frame) {
    const Vector6d motion = motion_between(a, b, *frame);
    amount.facts["axial_rotation_deg"] = degrees(motion[2]);
    amount.facts["axial_displacement_mm"] = motion[5];
    line += formatted(" ({:+.4g} deg about and {:+.4g} mm along its long axis)", degrees(motion[2]), motion[5]);
  }
  amount.lines.push_back(angle_deg == 0 && distance_mm == 0 ? "at the same place" : line);
}

/// Adds the texts that only one of two lists has: `new_one` and `old_one` say so.
void compare_texts(const std::vector<std::string>& a, const std::vector<std::string>& b, const std::string& new_one,
                   const std::string& old_one, Amount& amount) {
  for (const std::string& one : b)
    if (!contains(a, one)) amount.lines.push_back(new_one + one);
  for (const std::string& one : a)
    if (!contains(b, one)) amount.lines.push_back(old_one + one);
}

void compare_poses(const Pose& a, const Pose& b, Amount& amount) {
  compare_placement(a.world_from_model, b.world_from_model, a.frame.is_anatomical ? &a.frame : nullptr, amount);
  if (a.cost != b.cost || a.evaluations != b.evaluations)
    amount.lines.push_back(
        formatted("cost {:.6g}, was {:.6g}; {} evaluations, were {}", b.cost, a.cost, b.evaluations, a.evaluations));
  else if (hash_of(a.world_from_model) == hash_of(b.world_from_model) && a.warnings == b.warnings)
    amount.lines.push_back("its predicted deviations or the way of the search differ");
  amount.facts["cost"] = {a.cost, b.cost};
  amount.facts["evaluations"] = {a.evaluations, b.evaluations};
  if (a.covariance.has_value() != b.covariance.has_value())
    amount.lines.push_back(b.covariance ? "its deviations are predicted, were not"
                                        : "its deviations are not predicted, were");
  compare_texts(a.warnings, b.warnings, "it warns now: ", "it warned before: ", amount);
}

void compare_metrics(const Metrics& a, const Metrics& b, Amount& amount) {
  std::size_t same = 0;
  const auto find = [](const Metrics& metrics, const std::string& name) {
    const auto found = std::find_if(metrics.items.begin(), metrics.items.end(),
                                    [&](const Metric& metric) { return metric.name == name; });
    return found == metrics.items.end() ? nullptr : &*found;
  };
  for (const Metric& now : b.items) {
    const Metric* before = find(a, now.name);
    const std::string unit = now.unit.empty() ? "" : " " + now.unit;
    if (!before) {
      amount.lines.push_back(formatted("{:<24} {:.5g}{}, was not there", now.name, now.value, unit));
    } else if (now.value == before->value || (std::isnan(now.value) && std::isnan(before->value))) {
      ++same;
      continue;
    } else {
      amount.lines.push_back(formatted("{:<24} {:.5g}{}, was {:.5g} ({:+.3g})", now.name, now.value, unit,
                                       before->value, now.value - before->value));
    }
    amount.facts[now.name] = {
        {"before", before ? nlohmann::json(before->value) : nlohmann::json()}, {"now", now.value}, {"unit", now.unit}};
    if (before) amount.facts[now.name]["difference"] = now.value - before->value;
  }
  for (const Metric& before : a.items) {
    if (find(b, before.name)) continue;
    amount.lines.push_back(formatted("{:<24} is not there, was {:.5g}{}", before.name, before.value,
                                     (before.unit.empty() ? "" : " " + before.unit)));
    amount.facts[before.name] = {{"before", before.value}, {"now", nullptr}, {"unit", before.unit}};
  }
  if (same) amount.lines.push_back(formatted("{} other figure{} the same", same, same == 1 ? " is" : "s are"));
}

void compare_verdicts(const Verdict& a, const Verdict& b, Amount& amount) {
  amount.facts = {{"judgement", {name_of(a.judgement), name_of(b.judgement)}},
                  {"failure_probability", {a.failure_probability, b.failure_probability}}};
  if (a.judgement != b.judgement)
    amount.lines.push_back(std::string("it is ") + name_of(b.judgement) + ", was " + name_of(a.judgement));
  const std::string before = probability_text(a.failure_probability), now = probability_text(b.failure_probability);
  if (before != now) amount.lines.push_back("probability of a failure: " + now + ", was " + before);
  compare_texts(a.reasons, b.reasons, "a reason now: ", "a reason before: ", amount);
  compare_texts(a.remedies, b.remedies, "would settle it now: ", "would have settled it before: ", amount);
  Amount figures;
  compare_metrics({a.figures}, {b.figures}, figures);
  amount.lines.insert(amount.lines.end(), figures.lines.begin(), figures.lines.end());
  amount.facts["figures"] = figures.facts;
}

void compare_meshes(const Mesh& a, const Mesh& b, Amount& amount) {
  const std::size_t before = a.vertices_mm.size(), now = b.vertices_mm.size();
  amount.facts = {{"vertices", {before, now}}, {"triangles", {a.triangles.size(), b.triangles.size()}}};
  if (before != now || a.triangles.size() != b.triangles.size()) {
    const double area_before = surface_area_mm2(a), area_now = surface_area_mm2(b);
    amount.facts["area_mm2"] = {area_before, area_now};
    amount.lines.push_back(formatted("{} vertices, were {}; {} triangles, were {}; surface {:.6g} mm2, was {:.6g}", now,
                                     before, b.triangles.size(), a.triangles.size(), area_now, area_before));
  }
  if (before != now) return;
  double largest_mm = 0;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < now; ++i) {
    const double distance_mm = (b.vertices_mm[i] - a.vertices_mm[i]).norm();
    moved += distance_mm != 0;
    largest_mm = std::max(largest_mm, distance_mm);
  }
  amount.facts["moved"] = moved;
  amount.facts["largest_displacement_mm"] = largest_mm;
  amount.lines.push_back(formatted("{} of {} vertices lie elsewhere, by at most {:.4g} mm", moved, now, largest_mm));
  if (a.triangles.size() == b.triangles.size() && a.triangles != b.triangles)
    amount.lines.push_back("its triangles join other vertices");
}

void add_samples(const NumberDifference& numbers, const char* what, const char* unit, Amount& amount) {
  amount.facts.update({{"samples", numbers.count}, {"differ", numbers.differ}, {"largest", numbers.largest}});
  amount.lines.push_back(formatted("{} of {} {} differ ({:.3g} %), by at most {:.4g} {}", numbers.differ, numbers.count,
                                   what, percent(numbers.differ, numbers.count), numbers.largest, unit));
}

/// Compares samples on grids. If the grids differ in size, the samples cannot be matched.
void compare_grids(const Grid& a, const Grid& b, const std::vector<float>& values_a, const std::vector<float>& values_b,
                   const char* unit, Amount& amount) {
  amount.facts["size"] = {a.size, b.size};
  if (a.size != b.size || values_a.size() != values_b.size()) {
    amount.lines.push_back(formatted("{} x {} x {} samples, were {} x {} x {}", b.size[0], b.size[1], b.size[2],
                                     a.size[0], a.size[1], a.size[2]));
    return;
  }
  if (hash_of(a) != hash_of(b)) amount.lines.push_back("its grid lies elsewhere or has another spacing");
  NumberDifference numbers;
  numbers.add(values_a, values_b);
  add_samples(numbers, "voxels", unit, amount);
}

void compare_fields(const SignedField& a, const SignedField& b, Amount& amount) {
  compare_grids(a.grid, b.grid, a.values_mm, b.values_mm, "mm", amount);
  if (a.values_mm.size() != b.values_mm.size()) return;
  std::size_t in = 0, out = 0;
  for (std::size_t i = 0; i < a.values_mm.size(); ++i) {
    in += a.values_mm[i] >= 0 && b.values_mm[i] < 0;
    out += a.values_mm[i] < 0 && b.values_mm[i] >= 0;
  }
  amount.facts["voxels_now_inside"] = in;
  amount.facts["voxels_now_outside"] = out;
  amount.lines.push_back(formatted("{} voxels are inside now, {} are outside now", in, out));
}

void compare_pixels(const cv::Mat& a, const cv::Mat& b, Amount& amount) {
  amount.facts["size"] = {{a.cols, a.rows}, {b.cols, b.rows}};
  if (a.size() != b.size() || a.type() != b.type()) {
    amount.lines.push_back(formatted("{} x {} pixels of {} bits, were {} x {} of {}", b.cols, b.rows,
                                     8 * int(b.elemSize()), a.cols, a.rows, 8 * int(a.elemSize())));
    return;
  }
  NumberDifference numbers;
  numbers.add(a, b);
  numbers.count = a.total();
  numbers.differ = 0;  // count pixels, not channels
  for (int row = 0; row < a.rows; ++row)
    for (int column = 0; column < a.cols; ++column)
      numbers.differ += std::memcmp(a.ptr(row, column), b.ptr(row, column), a.elemSize()) != 0;
  add_samples(numbers, "pixels", "grey values", amount);
}

void compare_edges(const EdgeMap& a, const EdgeMap& b, Amount& amount) {
  std::map<std::pair<long, long>, const EdgePixel*> before;
  for (const EdgePixel& pixel : a.pixels) before[{std::lround(pixel.v_px), std::lround(pixel.u_px)}] = &pixel;
  std::size_t common = 0, changed = 0;
  double largest_px = 0;
  for (const EdgePixel& pixel : b.pixels) {
    const auto found = before.find({std::lround(pixel.v_px), std::lround(pixel.u_px)});
    if (found == before.end()) continue;
    const EdgePixel& old = *found->second;
    ++common;
    changed += hash_of(pixel) != hash_of(old);
    largest_px = std::max(largest_px, std::hypot(double(pixel.u_px) - old.u_px, double(pixel.v_px) - old.v_px));
    before.erase(found);
  }
  const std::size_t gone = before.size(), added = b.pixels.size() - common;
  amount.facts = {{"pixels", {a.pixels.size(), b.pixels.size()}},
                  {"gone", gone},
                  {"new", added},
                  {"changed", changed},
                  {"largest_px", largest_px}};
  amount.lines.push_back(
      formatted("{} edge pixels, were {}: {} gone, {} new", b.pixels.size(), a.pixels.size(), gone, added));
  if (changed)
    amount.lines.push_back(
        formatted("{} of the {} common ones differ, their places by at most {:.4g} px", changed, common, largest_px));
}

/// Compares two lines: the largest distance of an end from the other line, and the angle between them.
void compare_lines(const std::string& name, const LineSegment& a, const LineSegment& b, Amount& amount) {
  const Eigen::Vector2d along = (a.to_px - a.from_px).normalized(), now_along = (b.to_px - b.from_px).normalized();
  const auto cross = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) { return p.x() * q.y() - p.y() * q.x(); };
  const double distance_px =
      std::max(std::abs(cross(along, b.from_px - a.from_px)), std::abs(cross(along, b.to_px - a.from_px)));
  const double angle_deg = degrees(std::atan2(std::abs(cross(along, now_along)), along.dot(now_along)));
  amount.facts[name] = {{"distance_px", distance_px}, {"angle_deg", angle_deg}};
  if (hash_of(a) != hash_of(b))
    amount.lines.push_back(
        formatted("{} border: {:.4g} deg and at most {:.4g} px from where it was", name, angle_deg, distance_px));
}

void compare_shafts(const ShaftLines& a, const ShaftLines& b, Amount& amount) {
  compare_lines("left", a.left, b.left, amount);
  compare_lines("right", a.right, b.right, amount);
  amount.facts["width_mm"] = {a.width_mm, b.width_mm};
  if (a.width_mm != b.width_mm)
    amount.lines.push_back(formatted("width {:.6g} mm, was {:.6g}", b.width_mm, a.width_mm));
  if (a.log_likelihood != b.log_likelihood)
    amount.lines.push_back(formatted("log likelihood {:.6g}, was {:.6g}", b.log_likelihood, a.log_likelihood));
  if (amount.lines.empty()) amount.lines.push_back("the same borders; the rejected candidates differ");
}

template <class T>
void compare(const T& a, const T& b, Amount& amount) {
  if constexpr (std::is_same_v<T, Pose>) {
    compare_poses(a, b, amount);
  } else if constexpr (std::is_same_v<T, Truth>) {
    compare_placement(a.world_from_model, b.world_from_model, nullptr, amount);
  } else if constexpr (std::is_same_v<T, Metrics>) {
    compare_metrics(a, b, amount);
  } else if constexpr (std::is_same_v<T, Verdict>) {
    compare_verdicts(a, b, amount);
  } else if constexpr (std::is_same_v<T, Mesh>) {
    compare_meshes(a, b, amount);
  } else if constexpr (std::is_same_v<T, Volume>) {
    compare_grids(a.grid, b.grid, a.values, b.values, "HU", amount);
  } else if constexpr (std::is_same_v<T, SignedField>) {
    compare_fields(a, b, amount);
  } else if constexpr (std::is_same_v<T, Image> || std::is_same_v<T, Picture>) {
    compare_pixels(a.pixels, b.pixels, amount);
  } else if constexpr (std::is_same_v<T, EdgeMap>) {
    compare_edges(a, b, amount);
  } else if constexpr (std::is_same_v<T, ShaftLines>) {
    compare_shafts(a, b, amount);
  } else if constexpr (std::is_same_v<T, View>) {
    compare_part("image", a.image, b.image, amount);
    compare_part("camera", a.camera, b.camera, amount);
    compare_part("mask", Image{a.mask}, Image{b.mask}, amount);
  } else if constexpr (std::is_same_v<T, Case>) {
    compare_part("ct", a.ct, b.ct, amount);
    compare_lists("seeds", a.seeds, b.seeds, amount);
    compare_lists("view", a.views, b.views, amount);
    compare_lists("start", a.start, b.start, amount);
    compare_lists("truth", a.truth, b.truth, amount);
  } else {
    compare_numbers(a, b, amount);
  }
}

/// Compares two values as the type T that they have.
template <class... T>
void compare_as_any_of(const Value& before, const Value& now, Amount& amount) {
  ((before.type == TypeInfo::of<T>() && (compare(before.as<T>(), now.as<T>(), amount), true)) || ...);
}

Amount amount_of_counts(std::uintmax_t before, std::uintmax_t now, std::uintmax_t differ, const std::string& what) {
  Amount amount;
  amount.facts = {{"bytes", {before, now}}, {"bytes_differ", differ}};
  if (before == now)
    amount.lines.push_back(formatted("{} of {} bytes of {} differ", differ, now, what));
  else
    amount.lines.push_back(formatted("{} of {} bytes, were {}", what, now, before));
  return amount;
}

}  // namespace

Amount amount_of(const Value& before, const Value& now) {
  Amount amount;
  if (before.type == now.type)
    compare_as_any_of<Image, Picture, Volume, SignedField, Seeds, Mesh, Camera, View, EdgeMap, ShaftLines, Pose, Truth,
                      Metrics, Verdict, Scene, Landscape, Case>(before, now, amount);
  return amount;
}

Amount amount_of_bytes(const std::string& before, const std::string& now, const std::string& what) {
  std::size_t differ = 0;
  for (std::size_t i = 0; i < before.size() && i < now.size(); ++i) differ += before[i] != now[i];
  return amount_of_counts(before.size(), now.size(), differ, what);
}

Amount amount_of_files(const std::filesystem::path& before, const std::filesystem::path& now) {
  std::ifstream files[2] = {std::ifstream(before, std::ios::binary), std::ifstream(now, std::ios::binary)};
  std::vector<char> blocks[2] = {std::vector<char>(1 << 16), std::vector<char>(1 << 16)};
  std::uintmax_t sizes[2] = {}, differ = 0;
  for (bool is_more = true; is_more;) {
    std::streamsize counts[2];
    for (int k = 0; k < 2; ++k) {
      files[k].read(blocks[k].data(), std::streamsize(blocks[k].size()));
      sizes[k] += std::uintmax_t(counts[k] = files[k].gcount());
    }
    for (std::streamsize i = 0; i < std::min(counts[0], counts[1]); ++i)
      differ += blocks[0][std::size_t(i)] != blocks[1][std::size_t(i)];
    is_more = counts[0] > 0 || counts[1] > 0;
  }
  return amount_of_counts(sizes[0], sizes[1], differ, "the file");
}

}  // namespace marrow::cli
