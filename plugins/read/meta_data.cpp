// SPDX-License-Identifier: Apache-2.0
// MetaIO only prints a line when samples are missing or do not unpack, and ITK hands on what the memory held. So it is
// made sure here that all of them are there.
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::read {
namespace {

/// The keys of a MetaImage header, and where the samples begin.
struct MetaHeader {
  std::map<std::string, std::string> values;
  std::uintmax_t end = 0;
};

MetaHeader read_header(std::istream& stream) {
  MetaHeader header;
  std::string line;
  while (std::getline(stream, line) && line.size() < 65536) {
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) break;
    const auto trimmed = [](std::string text) {
      text.erase(0, text.find_first_not_of(" \t"));
      text.erase(text.find_last_not_of(" \t\r") + 1);
      return text;
    };
    const std::string key = trimmed(line.substr(0, equals));
    header.values[key] = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") {
      header.end = std::uintmax_t(stream.tellg());
      break;
    }
  }
  return header;
}

/// A whole number of a header; `missing` where the key is not there. Throws Error where it is none.
long long whole_number(const std::filesystem::path& path, const MetaHeader& header, const std::string& key, long long missing) {
  const auto found = header.values.find(key);
  if (found == header.values.end()) return missing;
  char* end = nullptr;
  const long long value = std::strtoll(found->second.c_str(), &end, 10);
  if (found->second.empty() || *end)
    throw Error(path.string() + ": its header says '" + key + " = " + found->second.substr(0, 40) + "'; expected a whole number");
  return value;
}

/// The number of bytes that a zlib or gzip stream unpacks to, up to just over `expected`; 0 when it is damaged or cut
/// off.
double unpacked_bytes(std::istream& stream, double expected) {
  z_stream unpacker = {};
  if (inflateInit2(&unpacker, 15 + 32) != Z_OK) throw Error("zlib does not start");  // 32: zlib or gzip
  std::vector<unsigned char> in(1 << 16), out(1 << 18);
  double total = 0;
  int state = Z_OK;
  while (state == Z_OK && total <= expected) {
    if (unpacker.avail_in == 0) {
      stream.read(reinterpret_cast<char*>(in.data()), std::streamsize(in.size()));
      unpacker.next_in = in.data();
      unpacker.avail_in = unsigned(stream.gcount());
    }
    unpacker.next_out = out.data();
    unpacker.avail_out = unsigned(out.size());
    state = inflate(&unpacker, Z_NO_FLUSH);  // Z_BUF_ERROR at the end of a file that is cut off
    total += double(out.size() - unpacker.avail_out);
  }
  inflateEnd(&unpacker);
  return state == Z_STREAM_END ? total : 0;
}

}  // namespace

void check_meta_header(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  MetaHeader header = read_header(stream);
  const auto refuse = [&](const std::string& key, long long value) {
    throw Error(path.string() + ": its header says '" + key + " = " + std::to_string(value) +
                "', which cannot be; it is damaged: copy or export it again");
  };
  const long long dimensions = whole_number(path, header, "NDims", 3);
  if (dimensions < 1 || dimensions > 4) refuse("NDims", dimensions);
  std::error_code failure;
  const std::string data = header.values["ElementDataFile"];
  const std::uintmax_t beside = std::filesystem::file_size(path.parent_path() / data, failure);
  const long long size = std::max((long long)std::filesystem::file_size(path), failure ? 0 : (long long)beside);
  for (const char* key : {"CompressedDataSize", "HeaderSize"})
    if (const long long bytes = whole_number(path, header, key, 0); bytes < -1 || bytes > size) refuse(key, bytes);
}

void check_meta_data(const std::filesystem::path& path, double sample_bytes) {
  std::ifstream stream(path, std::ios::binary);
  const MetaHeader header = read_header(stream);
  const auto value = [&](const std::string& key) {
    const auto found = header.values.find(key);
    return found == header.values.end() ? std::string() : found->second;
  };
  const auto is_true = [](const std::string& text) {
    return !text.empty() && (text[0] == 'T' || text[0] == 't' || text[0] == '1');
  };
  std::filesystem::path data = path;
  std::uintmax_t begin = header.end;
  if (const std::string name = value("ElementDataFile"); name != "LOCAL" && name != "Local" && name != "local") {
    data = path.parent_path() / name;
    begin = 0;
  }
  std::error_code failure;
  const std::uintmax_t size = std::filesystem::file_size(data, failure);
  if (failure)
    throw Error(path.string() + ": names '" + data.filename().string() + "' for its samples, which is not there");
  if (const long long skipped = whole_number(path, header, "HeaderSize", 0); skipped > 0)
    begin = std::uintmax_t(skipped);
  else if (skipped == -1)  // the samples are what the file ends with
    begin = size - std::min(size, std::uintmax_t(sample_bytes));
  std::ifstream samples(data, std::ios::binary);
  samples.seekg(std::streamoff(begin));
  const bool is_packed = is_true(value("CompressedData"));
  if (!is_packed && !is_true(value("BinaryData"))) return;  // numbers as text, which MetaIO counts
  const double got = is_packed ? unpacked_bytes(samples, sample_bytes) : double(size - std::min(size, begin));
  if (is_packed ? got != sample_bytes : got < sample_bytes)
    throw Error(data.string() + ": is cut off or damaged: " + std::to_string(std::uintmax_t(sample_bytes)) +
                " bytes of samples expected, got " +
                (got > 0 ? std::to_string(std::uintmax_t(got)) : "a stream that does not unpack") +
                "; copy or export it again");
}

}  // namespace marrow::read
