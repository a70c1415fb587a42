// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a trained network takes and gives: the YAML file beside its ONNX file (docs/networks.md).
#include <filesystem>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

namespace marrow::network {

/// What the values of the network's input are.
enum class Values { line_integrals, grey_values, hounsfield };

/// How the values are scaled before the network sees them. `percentiles`: (value - p_low) / (p_high - p_low) of all
/// pixels that count; `deviation`: (value - mean) / standard deviation of these; `fixed`: (value - low) / (high - low).
struct Normalisation {
  enum class Method { percentiles, deviation, fixed };
  Method method = Method::percentiles;
  double low = 1, high = 99;
};

struct Input {
  Values values = Values::line_integrals;
  bool bone_is_bright = true;
  /// Size of a pixel: in mm at the bone, for a CT in its slices; 0: pixel_px counts.
  double pixel_mm = 0;
  /// Size of a pixel in pixels of the image; 0: pixel_mm counts.
  double pixel_px = 0;
  Normalisation normalisation;
  cv::Size size_px;    ///< of the tile that the network takes
  int overlap_px = 0;  ///< of neighbouring tiles, in pixels of the network
  int slices = 1;      ///< neighbouring slices of a CT as channels, the middle one is the slice that counts; odd
};

struct Output {
  /// What its channels are. classes: probability of each name; edge_strength: one channel, 0 to 1, how sure it is that
  /// a border passes; heat_maps: for each named point, where it is.
  enum class Kind { classes, edge_strength, heat_maps };
  enum class Activation { none, sigmoid, softmax };
  Kind kind = Kind::classes;
  std::string layer;                         ///< name of the output in the ONNX file
  std::vector<std::string> names;            ///< of the channels; none for edge_strength
  Activation activation = Activation::none;  ///< what is still to be applied to the network's values
  int stride_px = 1;                         ///< pixels of the input for one of this output
  /// heat_maps: the deviation of a point is this times the spread of its map.
  double deviation_factor = 1;

  int channels() const { return names.empty() ? 1 : int(names.size()); }
};

struct Description {
  std::filesystem::path file, model;
  std::string name, help, version, licence;
  std::string trained_on, good_for, not_for;
  Input input;
  std::vector<Output> outputs;  ///< at most one of each kind
};

/// Reads the description. The model is the file beside it with the same name and the ending .onnx. Throws Error with
/// all faults and their lines.
Description read_description(const std::filesystem::path& file);

/// The output of a kind. Throws Error if the network has none; it says what there is.
const Output& output_of(const Description& description, Output::Kind kind);

/// The channels of some classes. Throws Error if the output lacks one of them; it names the nearest one.
std::vector<std::size_t> channels_of_classes(const Description& description, const Output& output,
                                             const std::vector<std::string>& names);

/// The values of the network's input that its node can give. Throws Error if the network wants others.
void expect_values(const Description& description, std::initializer_list<Values> can_give, const std::string& node);

}  // namespace marrow::network
