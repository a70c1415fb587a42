// SPDX-License-Identifier: Apache-2.0
// The NRRD library reserves what a header claims before it reads. So the claim of an uncompressed file is held against its size here.
#include <algorithm>
#include <cctype>
#include <fstream>

#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::read {

void check_nrrd_data(const std::filesystem::path& path, double sample_bytes, double samples) {
  std::ifstream stream(path, std::ios::binary);
  std::string line, encoding, data;
  while (std::getline(stream, line) && !line.empty() && line != "\r" && line.size() < 65536) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    std::string key = line.substr(0, colon), value = line.substr(colon + 1);
    std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    value.erase(0, value.find_first_not_of(" =\t"));
    value.erase(value.find_last_not_of(" \t\r") + 1);
    if (key == "encoding") encoding = value;
    if (key == "data file" || key == "datafile") data = value;
  }
  if (encoding != "raw" && encoding != "ascii" && encoding != "text" && encoding != "txt" && encoding != "hex") return;
  std::error_code failure;
  const std::uintmax_t begin = data.empty() && stream ? std::uintmax_t(stream.tellg()) : 0;
  const std::uintmax_t size = std::filesystem::file_size(data.empty() ? path : path.parent_path() / data, failure);
  if (failure) throw Error(path.string() + ": names '" + data + "' for its samples, which is not there");
  const double got = double(size - std::min(size, begin)), least = encoding == "raw" ? sample_bytes : encoding == "hex" ? 2 * sample_bytes : 2 * samples - 1;
  if (got < least)
    throw Error(path.string() + ": is cut off or damaged: " + std::to_string(std::uintmax_t(least)) + " bytes of samples expected, got " +
                std::to_string(std::uintmax_t(got)) + "; copy or export it again");
}

}  // namespace marrow::read
