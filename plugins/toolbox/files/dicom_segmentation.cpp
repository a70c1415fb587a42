// SPDX-License-Identifier: Apache-2.0
#include "label_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "dicom_folder.hpp"
#include "dicom_pixels.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Kind = DicomTag::Kind;

constexpr const char* kSegmentationClass = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* kLabelMapClass = "1.2.840.10008.5.1.4.1.1.66.7";
constexpr std::uint32_t kSegments = 0x00620002, kSegmentNumber = 0x00620004, kSegmentLabel = 0x00620005;
constexpr DicomTag kSegmentationType{0x0062, 0x0001, "SegmentationType"};
constexpr DicomTag kReferencedSegment{0x0062, 0x000B, "ReferencedSegmentNumber", Kind::us};
constexpr DicomTag kMostFraction{0x0062, 0x000E, "MaximumFractionalValue", Kind::us};
constexpr DicomTag kSegmentationAxes{0x0020, 0x0037, "ImageOrientationPatient"};
constexpr DicomTag kSegmentationDistance{0x0018, 0x0088, "SpacingBetweenSlices"};
constexpr DicomTag kSegmentationThickness{0x0018, 0x0050, "SliceThickness"};
constexpr DicomTag kSegmentationFrames{0x0028, 0x0008, "NumberOfFrames"};
constexpr DicomTag kSegmentationBits{0x0028, 0x0100, "BitsAllocated", Kind::us};
constexpr double kFrameAside_mm = 0.1;  // as for the slices of a CT

bool is_segmentation(const fs::path& file) {
  if (!looks_like_dicom(file)) return false;
  const std::string uid = dicom_object(file).class_uid;
  return uid == kSegmentationClass || uid == kLabelMapClass;
}

[[noreturn]] void refuse_segmentation(const fs::path& path, const std::string& fault) {
  throw Error(path.string() + ": is a segmentation that is damaged, or is not read: " + fault + "; export it again");
}

struct Frame {
  int segment = 0;  ///< 0 in a label map, whose pixels are the numbers
  int slice = 0;
  Vector3d position_mm;
};

/// What the header says of all frames.
class Segmentation {
 public:
  explicit Segmentation(const fs::path& path) : file_(path), first_(file_, 1) {
    type_ = first_.text(kSegmentationType).value_or("");
    if (type_ != "BINARY" && type_ != "FRACTIONAL" && type_ != "LABELMAP")
      refuse_segmentation(path,
                          kSegmentationType.text() + " is '" + type_ + "'; expected BINARY, FRACTIONAL or LABELMAP");
    const double rows = needed(kRows), columns = needed(kColumns),
                 frames = first_.number(kSegmentationFrames).value_or(1);
    if (!(rows >= 1 && rows <= 65535 && columns >= 1 && columns <= 65535 && frames >= 1 && frames <= 1e6))
      refuse_segmentation(path, "its header does not say how large its frames are");
    samples_.size = {int(columns), int(rows), 1};
    for (int frame = 1; frame <= int(frames); ++frame) frames_.push_back(frame_at(frame));
    read_axes();
    read_slices();
  }

  LabelMap map() {
    LabelMap map;
    Volume grid{grid_of(samples_), std::vector<float>(samples_.count(), 0)};
    map.segments = segments();
    map.layers.push_back(std::move(grid.values));
    if (type_ == "LABELMAP") {
      put_numbers(map.layers[0]);
    } else {
      for (Segment& segment : map.segments) put(segment, map.layers);
    }
    map.grid = grid.grid;
    return map;
  }

 private:
  const fs::path& path() const { return file_.path(); }
  std::size_t pixels_each() const { return std::size_t(samples_.size[0]) * std::size_t(samples_.size[1]); }

  double needed(const DicomTag& tag) const {
    const auto value = first_.number(tag);
    if (!value) refuse_segmentation(path(), "it has no " + tag.text());
    return *value;
  }

  Frame frame_at(int number) const {
    const DicomHeader header(file_, number);
    Frame frame;
    const auto position = header.numbers(kImagePosition, 3);
    if (!position) refuse_segmentation(path(), formatted("frame {} has no {}", number, kImagePosition.text()));
    frame.position_mm = Vector3d(position->data());
    if (type_ == "LABELMAP") return frame;
    const auto segment = header.number(kReferencedSegment);
    if (!segment) refuse_segmentation(path(), formatted("frame {} has no {}", number, kReferencedSegment.text()));
    frame.segment = int(*segment);
    return frame;
  }

  void read_axes() {
    const auto axes = first_.numbers(kSegmentationAxes, 6);
    const auto spacing = first_.numbers(kPixelSpacing, 2);
    if (!axes || !spacing)
      refuse_segmentation(path(), "it does not say how its frames lie in the patient, or how large a pixel is");
    const Vector3d along_row(axes->data()), along_column(axes->data() + 3);
    normal_ = along_row.cross(along_column);
    if (std::abs(normal_.norm() - 1) > kRoundedDirection)
      refuse_segmentation(path(), kSegmentationAxes.text() + " has no right angle");
    normal_.normalize();
    for (int row = 0; row < 3; ++row) {
      samples_.direction[std::size_t(3 * row)] = along_row[row];
      samples_.direction[std::size_t(3 * row + 1)] = along_column[row];
      samples_.direction[std::size_t(3 * row + 2)] = normal_[row];
    }
    samples_.spacing_mm = {(*spacing)[1], (*spacing)[0], 1};
  }

  /// The distance of the slices. A segmentation need not have frames for slices that it leaves empty.
  double slice_distance(const std::vector<double>& heights) const {
    double least = 1e9;
    for (std::size_t i = 1; i < heights.size(); ++i)
      if (const double step = heights[i] - heights[i - 1]; step > kFrameAside_mm / 10) least = std::min(least, step);
    const auto given = first_.number(kSegmentationDistance), thickness = first_.number(kSegmentationThickness);
    const double distance = given ? std::abs(*given) : least < 1e9 ? least : thickness.value_or(0);
    if (!(distance > 0)) refuse_segmentation(path(), "it does not say how far its slices lie apart");
    return distance;
  }

  void read_slices() {
    std::vector<double> heights;
    for (const Frame& frame : frames_) heights.push_back(normal_.dot(frame.position_mm));
    const std::size_t lowest = std::size_t(std::min_element(heights.begin(), heights.end()) - heights.begin());
    const double begin = heights[lowest];
    const Vector3d origin = frames_[lowest].position_mm;
    std::vector<double> sorted = heights;
    std::sort(sorted.begin(), sorted.end());
    const double distance = slice_distance(sorted);
    samples_.spacing_mm[2] = distance;
    const double slices = std::round((sorted.back() - begin) / distance) + 1;
    check_size(path().string(), {samples_.size[0], samples_.size[1], (long long)(slices)}, file_.file().size(), 4096);
    samples_.size[2] = int(slices);
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      frames_[i].slice = int(std::round((heights[i] - begin) / distance));
      const Vector3d expected = origin + frames_[i].slice * distance * normal_;
      if ((frames_[i].position_mm - expected).norm() > kFrameAside_mm)
        refuse_segmentation(path(), formatted("frame {} lies {:.2f} mm beside the even grid of the others", i + 1,
                                              (frames_[i].position_mm - expected).norm()));
    }
    for (int k = 0; k < 3; ++k) samples_.origin_mm[std::size_t(k)] = origin[k];
  }

  std::string text_of(const DicomElements& item, std::uint32_t tag) const {
    const DicomElement* element = find_element(path(), item, tag);
    if (!element || element->value.bytes > 1024) return {};
    const std::string text = file_.text(element->value);
    return text.substr(0, text.find_last_not_of(std::string(" \0", 2)) + 1);
  }

  std::vector<Segment> segments() const {
    std::vector<Segment> segments;
    const DicomElement* sequence = find_element(path(), file_.elements(), kSegments);
    if (!sequence || sequence->items.empty()) refuse_segmentation(path(), "it lists no segments (SegmentSequence)");
    for (const DicomElements& item : sequence->items) {
      const DicomElement* number = find_element(path(), item, kSegmentNumber);
      if (!number || number->value.bytes != 2) refuse_segmentation(path(), "a segment has no SegmentNumber");
      const int value = int(number_in_bytes(file_.text(number->value), number->big_endian));
      if (value > 0) segments.push_back({value, text_of(item, kSegmentLabel), 0});
    }
    return segments;
  }

  /// Which pixels of a frame are inside. Frames of one bit follow each other without filling.
  std::vector<std::uint8_t> inside(std::size_t frame) {
    std::vector<std::uint8_t> pixels(pixels_each());
    if (type_ == "BINARY") {
      const std::uint64_t first = frame * pixels.size(), last = first + pixels.size() - 1;
      if (needed(kSegmentationBits) != 1 || file_.is_compressed() || file_.pixel_parts().size() != 1)
        refuse_segmentation(path(), "its pixels are not written as single bits without compression");
      const DicomSpan& span = file_.pixel_parts()[0];
      if (last / 8 >= span.bytes)
        refuse_segmentation(path(), formatted("it ends in the pixels of frame {}", frame + 1));
      const std::string bytes = file_.text({span.begin + first / 8, last / 8 - first / 8 + 1});
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const std::uint64_t bit = first + i;
        pixels[i] = std::uint8_t(bytes[std::size_t(bit / 8 - first / 8)]) >> (bit % 8) & 1;
      }
      return pixels;
    }
    const double half = 0.5 * first_.number(kMostFraction).value_or(255);
    const std::vector<float> values = to_float(frame_samples(frame));
    std::transform(values.begin(), values.end(), pixels.begin(), [&](float value) { return value >= half; });
    return pixels;
  }

  Samples frame_samples(std::size_t frame) {
    if (!pixels_) pixels_ = read_dicom_pixels(file_, 1);
    return read_dicom_frame(*pixels_, int(frame) + 1);
  }

  void put_numbers(std::vector<float>& layer) {
    std::map<std::size_t, std::size_t> frame_at;  // by its place
    for (std::size_t frame = 0; frame < frames_.size(); ++frame) {
      if (const auto [other, is_new] = frame_at.emplace(place_of(frame), frame); !is_new)
        refuse_segmentation(path(), formatted("frames {} and {} show the same slice", other->second + 1, frame + 1));
      const std::vector<float> values = to_float(frame_samples(frame));
      std::copy(values.begin(), values.end(), layer.begin() + std::ptrdiff_t(place_of(frame)));
    }
  }

  std::size_t place_of(std::size_t frame) const { return std::size_t(frames_[frame].slice) * pixels_each(); }

  /// Puts a segment to the first layer where none of its voxels is taken.
  void put(Segment& segment, std::vector<std::vector<float>>& layers) {
    std::map<std::size_t, std::vector<std::uint8_t>> masks;  // by their places
    for (std::size_t frame = 0; frame < frames_.size(); ++frame) {
      if (frames_[frame].segment != segment.number) continue;
      if (!masks.emplace(place_of(frame), inside(frame)).second)
        refuse_segmentation(path(), formatted("two frames show the same slice of the segment {}", segment.number));
    }
    const auto is_free = [&](const std::vector<float>& layer) {
      for (const auto& [place, mask] : masks)
        for (std::size_t i = 0; i < mask.size(); ++i)
          if (mask[i] && layer[place + i] != 0) return false;
      return true;
    };
    while (segment.layer < layers.size() && !is_free(layers[segment.layer])) ++segment.layer;
    if (segment.layer == layers.size()) layers.emplace_back(samples_.count(), 0.0f);
    for (const auto& [place, mask] : masks)
      for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i]) layers[segment.layer][place + i] = float(segment.number);
  }

  DicomFile file_;
  DicomHeader first_;
  std::string type_;
  Samples samples_;  ///< the grid
  Vector3d normal_ = Vector3d::UnitZ();
  std::vector<Frame> frames_;
  std::optional<DicomPixels> pixels_;
};

}  // namespace

fs::path dicom_segmentation_in(const fs::path& path) {
  std::error_code failure;
  if (!fs::is_directory(path, failure)) return fs::is_regular_file(path, failure) && is_segmentation(path) ? path : "";
  std::vector<fs::path> found;
  for (fs::directory_iterator entry(path, failure), end; entry != end && !failure; entry.increment(failure))
    if (entry->is_regular_file(failure) && is_segmentation(entry->path())) found.push_back(entry->path());
  std::sort(found.begin(), found.end());
  if (found.size() > 1)
    throw Error(formatted("{}: holds {} segmentations ('{}', '{}'); name one of these files", path.string(),
                          found.size(), found[0].filename().string(), found[1].filename().string()));
  if (found.empty()) return {};
  check_stays_inside(path, found[0]);
  return found[0];
}

LabelMap read_dicom_segmentation(const fs::path& path) { return Segmentation(path).map(); }

}  // namespace marrow::files
