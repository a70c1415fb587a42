// SPDX-License-Identifier: Apache-2.0
// RTK's geometry in XML. Values for all projections come before the first one. A projection without an element has the
// value of the projection before.
#include <expat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/exchange/rtk_geometry.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

constexpr std::uint64_t kMostBytesOfGeometry = 256u << 20;
constexpr double kLargest = 1e7;  // no angle, no distance, and no number of a matrix of such distances is larger
constexpr const char* kRoot = "RTKThreeDCircularGeometry";

/// The elements of RTK's file, and where their numbers go.
constexpr std::array<std::pair<const char*, double RtkProjection::*>, 9> kRtkElements{{
    {"SourceToIsocenterDistance", &RtkProjection::source_to_isocentre_mm},
    {"SourceToDetectorDistance", &RtkProjection::source_to_detector_mm},
    {"GantryAngle", &RtkProjection::gantry_deg},
    {"OutOfPlaneAngle", &RtkProjection::out_of_plane_deg},
    {"InPlaneAngle", &RtkProjection::in_plane_deg},
    {"SourceOffsetX", &RtkProjection::source_x_mm},
    {"SourceOffsetY", &RtkProjection::source_y_mm},
    {"ProjectionOffsetX", &RtkProjection::projection_x_mm},
    {"ProjectionOffsetY", &RtkProjection::projection_y_mm},
}};

class RtkReader {
 public:
  explicit RtkReader(const std::filesystem::path& path)
      : what_(path.string()), parser_(XML_ParserCreate(nullptr), XML_ParserFree) {
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), on_start, on_end);
    XML_SetCharacterDataHandler(parser_.get(), on_text);
  }

  std::vector<RtkProjection> read(const std::string& bytes) {
    const XML_Status status = XML_Parse(parser_.get(), bytes.data(), int(bytes.size()), true);
    if (!fault_.empty()) throw Error(fault_);
    if (status != XML_STATUS_OK)
      throw Error(place() + "is no well-formed XML (" + XML_ErrorString(XML_GetErrorCode(parser_.get())) +
                  "); it is cut off or damaged: write it again");
    if (projections_.empty()) throw Error(what_ + ": there is no <Projection> in it; write it again with RTK");
    return std::move(projections_);
  }

 private:
  std::string place() const { return formatted("{}:{}: ", what_, XML_GetCurrentLineNumber(parser_.get())); }
  /// Notes the first fault, and stops. No exception may pass through the parser.
  void refuse(const std::string& text) {
    if (fault_.empty()) fault_ = place() + text;
    XML_StopParser(parser_.get(), false);
  }

  static void on_start(void* self, const char* name, const char** attributes) {
    static_cast<RtkReader*>(self)->start(name, attributes);
  }
  static void on_end(void* self, const char* name) { static_cast<RtkReader*>(self)->end(name); }
  static void on_text(void* self, const char* text, int count) {
    auto& reader = *static_cast<RtkReader*>(self);
    if (reader.text_.size() < 4096) reader.text_.append(text, std::size_t(count));
  }

  void start(const std::string& name, const char** attributes) {
    text_.clear();
    if (depth_++ == 0) return start_root(name, attributes);
    if (name == "Projection") {
      if (in_projection_) return refuse("a <Projection> begins inside another");
      in_projection_ = true;
      matrix_.reset();
    }
  }

  void start_root(const std::string& name, const char** attributes) {
    if (name != kRoot)
      return refuse("expected <" + std::string(kRoot) + ">, got <" + printable(name.substr(0, 60)) +
                    ">; only this geometry of RTK is read");
    std::string version;
    for (; *attributes; attributes += 2)
      if (std::strcmp(attributes[0], "version") == 0) version = attributes[1];
    if (version != "2" && version != "3")
      refuse("expected version 2 or 3 of RTK's geometry, got " + in_quotes(printable(version.substr(0, 40))) +
             "; write it again with RTK");
  }

  void end(const std::string& name) {
    --depth_;
    if (depth_ == 0) return;
    if (name == "Projection") return end_projection();
    if (name == "Matrix") {
      matrix_ = numbers();
      if (matrix_->size() != 12)
        refuse(formatted("Matrix: expected 12 numbers of at most 1e7, got {}", matrix_->size()));
      return;
    }
    const std::string known = name == "Angle" ? "GantryAngle" : name;  // its older name
    const auto element =
        std::find_if(kRtkElements.begin(), kRtkElements.end(), [&](const auto& pair) { return known == pair.first; });
    const bool is_radius = name == "RadiusCylindricalDetector";
    if (element == kRtkElements.end() && !is_radius) {
      if (name.rfind("Collimation", 0) != 0) refuse("unknown element <" + printable(name.substr(0, 60)) + ">");
      return;
    }
    const std::vector<double> one = numbers();
    if (one.size() != 1)
      return refuse(name + ": expected a number of at most 1e7, got " + in_quotes(printable(text_.substr(0, 40))));
    if (is_radius && one[0] != 0)
      return refuse("RadiusCylindricalDetector: the detector is curved, but marrow's cameras have flat ones");
    if (!is_radius) now_.*(element->second) = one[0];
  }

  void end_projection() {
    in_projection_ = false;
    if (!(now_.source_to_detector_mm > 0))
      return refuse(
          now_.source_to_detector_mm == 0
              ? "SourceToDetectorDistance is 0 or missing: the rays are parallel, but marrow's cameras have a "
                "source"
              : "SourceToDetectorDistance: expected a positive distance in mm");
    if (matrix_) check_matrix();
    projections_.push_back(now_);
  }

  /// RTK itself allows 0.001 between the matrix and that of the angles and distances.
  void check_matrix() {
    const Eigen::Matrix<double, 3, 4> expected = rtk_matrix(now_);
    for (int i = 0; i < 12 && fault_.empty(); ++i) {
      const double got = (*matrix_)[std::size_t(i)], wanted = expected(i / 4, i % 4);
      if (!(std::abs(got - wanted) <= 1e-3 + 1e-9 * std::abs(wanted)))
        refuse(
            formatted("Matrix: row {}, column {} is {:f}, but the angles and distances give {:f}; one of them was "
                      "changed: write it again with RTK",
                      i / 4 + 1, i % 4 + 1, got, wanted));
    }
  }

  /// The numbers of the element's text; empty if a word is none.
  std::vector<double> numbers() const {
    std::istringstream words(text_);
    std::vector<double> values;
    for (std::string word; words >> word;) {
      const auto value = parsed_number(word);
      if (!value || !(std::abs(*value) <= kLargest)) return {};
      values.push_back(*value);
    }
    return values;
  }

  std::string what_, text_, fault_;
  std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser_;
  int depth_ = 0;
  bool in_projection_ = false;
  RtkProjection now_;
  std::optional<std::vector<double>> matrix_;
  std::vector<RtkProjection> projections_;
};

}  // namespace

std::vector<RtkProjection> read_rtk(const std::filesystem::path& path) {
  return RtkReader(path).read(files::read_bytes(path, kMostBytesOfGeometry));
}

std::string rtk_geometry(const std::vector<Camera>& cameras, const Eigen::Vector2d& pixel_mm) {
  std::string text = "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const RtkProjection p = projection_of(cameras[i], pixel_mm, formatted("camera {}", i + 1));
    text += "  <Projection>\n";
    for (const auto& [name, member] : kRtkElements)
      text += "    <" + std::string(name) + ">" + files::number(p.*member) + "</" + name + ">\n";
    text += "    <Matrix>\n";
    const Eigen::Matrix<double, 3, 4> matrix = rtk_matrix(p);
    for (int row = 0; row < 3; ++row) {
      text += "     ";
      for (int column = 0; column < 4; ++column) text += " " + files::number(matrix(row, column));
      text += "\n";
    }
    text += "    </Matrix>\n  </Projection>\n";
  }
  return text + "</RTKThreeDCircularGeometry>\n";
}

}  // namespace marrow::exchange
