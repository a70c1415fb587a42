// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/network/inference.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/core/version.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <regex>

#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::network {
namespace {

constexpr std::uint64_t kMostBytes = 512'000'000;
constexpr std::size_t kLongest = 300;

/// The bytes of a model. Throws Error if it cannot be read, is empty, or has more than 512 MB.
std::string model_file(const std::filesystem::path& file) {
  now_reading(file);
  return files::read_bytes(file, kMostBytes);
}

/// What OpenCV's message about a model means: which layer it does not know, or that the file is damaged, and what to
/// do.
std::string reason_of_model(const std::string& message) {
  std::smatch found;
  static const std::regex node("Node \\[([^@\\]]*)@[^\\]]*\\]:\\(([^)]*)\\)");
  if (std::regex_search(message, found, node)) {
    std::string name = found[2];
    name = name.substr(name.find('!') == std::string::npos ? 0 : name.find('!') + 1);
    return "OpenCV " CV_VERSION " cannot compute its layer '" + printable(name) + "' of the type " +
           printable(found[1].str()) +
           "; export the network with other layers (Conv, ConvTranspose, BatchNormalization, Relu, MaxPool, Concat, "
           "Add, Sigmoid), with opset_version=11 and for a tile of fixed size";
  }
  static const std::regex damaged("parse onnx model|has_graph", std::regex::icase);
  if (std::regex_search(message, damaged)) return "is no ONNX model, or a damaged one; export it again";
  // The place in OpenCV's source says nothing here.
  static const std::regex frame("OpenCV\\([0-9.]+\\) \\S+ error: |\\s+$");
  return "OpenCV says: " + printable(cut(std::regex_replace(message, frame, ""), kLongest));
}

/// Where tiles begin along one axis, in pixels of the image; the first begin before it.
std::vector<int> tile_starts(int length, int tile, int overlap) {
  std::vector<int> starts;
  for (int start = -overlap / 2;; start += tile - overlap) {
    starts.push_back(start);
    if (start + tile - overlap / 2 >= length) return starts;
  }
}

/// How much a pixel of a tile counts: 0 near the tile's border, 1 in its middle. The weights of two neighbours add up
/// to 1 in their overlap.
std::vector<float> tile_weights(int tile, int overlap, int stride) {
  std::vector<float> weights;
  for (int i = 0; i < tile; i += stride) {
    const double place = i + 0.5 * (stride - 1), from_border = std::min(place, tile - 1 - place) + 0.5;
    weights.push_back(overlap == 0 ? 1.0f
                                   : float(std::clamp((from_border - 0.25 * overlap) / (0.5 * overlap), 0.0, 1.0)));
  }
  return weights;
}

struct Tile {
  int row, column;
};

/// The tile's part of the planes as the network's input, continued by the mirror image.
cv::Mat blob_of(const std::vector<cv::Mat>& planes, const Tile& tile, const cv::Size& size) {
  cv::Mat blob(std::vector<int>{1, int(planes.size()), size.height, size.width}, CV_32F);
  for (std::size_t c = 0; c < planes.size(); ++c) {
    const cv::Mat& plane = planes[c];
    cv::Mat part(size, CV_32F, blob.ptr<float>(0, int(c)));
    for (int row = 0; row < size.height; ++row) {
      const float* from = plane.ptr<float>(cv::borderInterpolate(tile.row + row, plane.rows, cv::BORDER_REFLECT_101));
      float* to = part.ptr<float>(row);
      for (int column = 0; column < size.width; ++column)
        to[column] = from[cv::borderInterpolate(tile.column + column, plane.cols, cv::BORDER_REFLECT_101)];
    }
  }
  return blob;
}

void activate(cv::Mat& result, Output::Activation activation) {
  const int channels = result.size[1], count = result.size[2] * result.size[3];
  float* values = result.ptr<float>();
  if (activation == Output::Activation::sigmoid)
    std::transform(values, values + std::ptrdiff_t(channels) * count, values,
                   [](float x) { return 1 / (1 + std::exp(-x)); });
  if (activation != Output::Activation::softmax) return;
  for (int i = 0; i < count; ++i) {
    float most = values[i], sum = 0;
    for (int c = 1; c < channels; ++c) most = std::max(most, values[std::ptrdiff_t(c) * count + i]);
    for (int c = 0; c < channels; ++c) {
      float& value = values[std::ptrdiff_t(c) * count + i];
      sum += value = std::exp(value - most);
    }
    for (int c = 0; c < channels; ++c) values[std::ptrdiff_t(c) * count + i] /= sum;
  }
}

/// Throws Error unless the result has the shape that the description promises, with finite values.
void check_result(const cv::Mat& result, const Description& description, const Output& output) {
  const cv::Size size = description.input.size_px;
  const std::vector<int> expected{1, output.channels(), size.height / output.stride_px, size.width / output.stride_px};
  std::vector<int> got(result.size.p, result.size.p + result.dims);
  const auto shape = [](const std::vector<int>& sides) {
    std::string text;
    for (const int side : sides) text += formatted("{}{}", text.empty() ? "" : " x ", side);
    return text;
  };
  if (got != expected)
    throw Error(formatted("{}: output '{}' has the shape {}, but {} describes {} (1, channels, rows, columns)",
                          description.model.string(), output.layer, shape(got), description.file.filename().string(),
                          shape(expected)));
  if (!cv::checkRange(result.reshape(1, 1)))
    throw Error(description.model.string() + ": output '" + output.layer +
                "' has values that are not finite (NaN or infinity); the training may have diverged");
}

/// The sum of the tiles, each pixel with its weight. Tiles are added in their order.
class Joined {
 public:
  Joined(const cv::Size& size, int channels) : weights_(size, CV_32F, cv::Scalar(0)) {
    for (int c = 0; c < channels; ++c) sums_.emplace_back(size, CV_32F, cv::Scalar(0));
  }

  void add(const cv::Mat& result, int row, int column, const std::vector<float>& rows,
           const std::vector<float>& columns) {
    for (int v = std::max(0, -row); v < int(rows.size()) && row + v < weights_.rows; ++v)
      for (int u = std::max(0, -column); u < int(columns.size()) && column + u < weights_.cols; ++u) {
        const float weight = rows[std::size_t(v)] * columns[std::size_t(u)];
        weights_.at<float>(row + v, column + u) += weight;
        for (std::size_t c = 0; c < sums_.size(); ++c)
          sums_[c].at<float>(row + v, column + u) += weight * result.ptr<float>(0, int(c))[v * int(columns.size()) + u];
      }
  }
  std::vector<cv::Mat> mean() {
    for (cv::Mat& sum : sums_) sum /= weights_;
    return std::move(sums_);
  }

 private:
  cv::Mat weights_;
  std::vector<cv::Mat> sums_;
};

/// OpenCV's messages about a model go to standard error otherwise.
class Quiet {
 public:
  Quiet() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;
  ~Quiet() { cv::utils::logging::setLogLevel(before_); }

 private:
  cv::utils::logging::LogLevel before_;
};

cv::dnn::Net net_of(const Description& description, const std::string& bytes) {
  try {
    cv::dnn::Net net = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
    net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    return net;
  } catch (const cv::Exception& fault) {
    throw Error(description.model.string() + ": " + reason_of_model(fault.what()));
  }
}

cv::Mat result_of(cv::dnn::Net& net, const Description& description, const Output& output, const cv::Mat& blob) {
  try {
    net.setInput(blob);
    return net.forward(output.layer).clone();
  } catch (const cv::Exception& fault) {
    throw Error(formatted("{}: the network does not take a tile of {} x {} px with {}, as {} says: {}",
                          description.model.string(), blob.size[2], blob.size[3],
                          counted(std::size_t(blob.size[1]), "channel"), description.file.filename().string(),
                          reason_of_model(fault.what())));
  }
}

}  // namespace

struct Network::Model {
  explicit Model(Description read) : description(std::move(read)), bytes(model_file(description.model)) {}

  Description description;
  std::string bytes;
  /// Each thread has its own: a net holds the values of its layers. Many images are computed without reading it again.
  tbb::enumerable_thread_specific<cv::dnn::Net> nets{[this] { return net_of(description, bytes); }};
};

Network::Network(Description description) : model_(std::make_unique<Model>(std::move(description))) {
  const Quiet quiet;
  const cv::dnn::Net& net = model_->nets.local();
  const std::vector<std::string> layers = net.getUnconnectedOutLayersNames();
  for (const Output& output : model_->description.outputs)
    if (std::find(layers.begin(), layers.end(), output.layer) == layers.end())
      throw Error(model_->description.model.string() + ": has no output '" + output.layer + "', which " +
                  model_->description.file.filename().string() + " names; " + suggestion(output.layer, layers));
}
Network::Network(Network&&) noexcept = default;
Network::~Network() = default;

Network read_for_views(const std::filesystem::path& file, const std::string& node) {
  Network network(read_description(file));
  expect_values(network.description(), {Values::line_integrals, Values::grey_values}, node);
  return network;
}

const Description& Network::description() const { return model_->description; }

std::vector<cv::Mat> Network::maps(const std::vector<cv::Mat>& planes, const Output& output,
                                   const Context& context) const {
  const Input& input = model_->description.input;
  const int stride = output.stride_px, overlap = input.overlap_px;
  std::vector<Tile> tiles;
  for (const int row : tile_starts(planes[0].rows, input.size_px.height, overlap))
    for (const int column : tile_starts(planes[0].cols, input.size_px.width, overlap)) tiles.push_back({row, column});
  const Quiet quiet;
  std::vector<cv::Mat> results(tiles.size());
  tbb::parallel_for(std::size_t(0), tiles.size(), [&](std::size_t i) {
    context.check_cancelled();
    results[i] = result_of(model_->nets.local(), model_->description, output, blob_of(planes, tiles[i], input.size_px));
    check_result(results[i], model_->description, output);
    activate(results[i], output.activation);
  });
  const auto reduced = [&](int length) { return (length + stride - 1) / stride; };
  Joined joined({reduced(planes[0].cols), reduced(planes[0].rows)}, output.channels());
  const std::vector<float> rows = tile_weights(input.size_px.height, overlap, stride),
                           columns = tile_weights(input.size_px.width, overlap, stride);
  for (std::size_t i = 0; i < tiles.size(); ++i)
    joined.add(results[i], tiles[i].row / stride, tiles[i].column / stride, rows, columns);
  return joined.mean();
}

}  // namespace marrow::network
