// SPDX-License-Identifier: Apache-2.0
// The description of OME-TIFF, an XML text: https://docs.openmicroscopy.org/ome-model. Only one plain stack of slices
// is supported. For anything else, `other_pages` says what the pages are.
#include <cctype>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "marrow/base/number_text.hpp"
#include "tiff_description.hpp"

namespace marrow::files {
namespace {

struct Tag {
  std::string name;  ///< without the prefix of its namespace
  std::map<std::string, std::string> attributes;
};

/// The opening tags of an XML text, one after the other.
class Tags {
 public:
  explicit Tags(std::string_view text) : text_(text) {}

  /// The next tag. std::nullopt at the end, or if the text is not understood.
  std::optional<Tag> next() {
    while (is_understood_) {
      at_ = text_.find('<', at_);
      if (at_ == text_.npos) return std::nullopt;
      if (passes("<!--", "-->") || passes("<?", "?>") || passes("<![CDATA[", "]]>") || passes("</", ">")) continue;
      if (text_.substr(at_, 2) == "<!") break;  // a document type could redefine names
      ++at_;
      if (auto tag = read()) return tag;
      break;
    }
    is_understood_ = false;
    return std::nullopt;
  }
  bool is_understood() const { return is_understood_; }

 private:
  bool passes(std::string_view begin, std::string_view end) {
    if (text_.substr(at_, begin.size()) != begin) return false;
    const std::size_t found = text_.find(end, at_ + begin.size());
    is_understood_ = is_understood_ && found != text_.npos;
    at_ = found == text_.npos ? text_.size() : found + end.size();
    return true;
  }
  void skip_space() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  std::string name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !std::isspace(static_cast<unsigned char>(text_[at_])) &&
           std::string_view("=/><\"'").find(text_[at_]) == std::string_view::npos)
      ++at_;
    const std::string_view full = text_.substr(begin, at_ - begin);
    return std::string(full.substr(full.find(':') + 1));  // npos + 1 is 0
  }
  std::optional<Tag> read() {
    Tag tag{name(), {}};
    while (!tag.name.empty()) {
      skip_space();
      if (at_ >= text_.size()) break;
      if (text_[at_] == '>' || text_.substr(at_, 2) == "/>") return tag;
      const std::string key = name();
      skip_space();
      if (key.empty() || at_ >= text_.size() || text_[at_] != '=') break;
      ++at_;
      skip_space();
      if (at_ >= text_.size() || (text_[at_] != '"' && text_[at_] != '\'')) break;
      const std::size_t end = text_.find(text_[at_], at_ + 1);
      if (end == text_.npos) break;
      tag.attributes[key] = text_.substr(at_ + 1, end - at_ - 1);
      at_ = end + 1;
    }
    return std::nullopt;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  bool is_understood_ = true;
};

constexpr long kNotUnderstood = -1;

long number_of(const Tag& tag, const char* name, long missing) {
  const auto found = tag.attributes.find(name);
  if (found == tag.attributes.end()) return missing;
  const std::string& text = found->second;
  if (text.empty() || text.size() > 7 || text.find_first_not_of("0123456789") != text.npos) return kNotUnderstood;
  return std::stol(text);
}

/// Whether the slices are in the order of the pages.
bool is_in_order(const Tag& data) {
  const long first = number_of(data, "FirstZ", 0);
  return first >= 0 && number_of(data, "IFD", 0) == first && number_of(data, "FirstC", 0) == 0 &&
         number_of(data, "FirstT", 0) == 0;
}

}  // namespace

TiffDescription read_ome_description(const std::string& text) {
  TiffDescription description;
  Tags tags(text);
  int images = 0, pixels = 0;
  bool in_order = true;
  std::string several;
  while (const auto tag = tags.next()) {
    if (tag->name == "Image") ++images;
    if (tag->name == "TiffData") in_order = in_order && is_in_order(*tag);
    if (tag->name != "Pixels" || ++pixels > 1) continue;
    const long slices = number_of(*tag, "SizeZ", 0), channels = number_of(*tag, "SizeC", kNotUnderstood),
               times = number_of(*tag, "SizeT", kNotUnderstood);
    if (channels < 1 || times < 1 || slices < 0) in_order = false;
    if (channels > 1) several = formatted("an OME stack of {} channels", channels);
    if (several.empty() && times > 1) several = formatted("an OME stack of {} times", times);
    if (in_order) description.pages = std::uint64_t(slices) * std::uint64_t(channels) * std::uint64_t(times);
  }
  if (pixels != 1 || images > 1) description.pages = 0;
  if (images > 1)
    description.other_pages = formatted("an OME file of {} images", images);
  else if (!several.empty())
    description.other_pages = several;
  else if (pixels != 1 || !in_order || !tags.is_understood())
    description.other_pages =
        "an OME file whose description is not that of one stack of slices in the order of its pages";
  return description;
}

}  // namespace marrow::files
