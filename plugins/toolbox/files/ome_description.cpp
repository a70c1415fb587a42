// SPDX-License-Identifier: Apache-2.0
// The description of OME-TIFF, an XML text: https://docs.openmicroscopy.org/ome-model. Only one plain stack of slices
// is supported. For anything else, `other_pages` says what the pages are.
#include <expat.h>

#include <cstdint>
#include <memory>
#include <string_view>

#include "marrow/base/number_text.hpp"
#include "tiff_description.hpp"

namespace marrow::files {
namespace {

constexpr long kNotUnderstood = -1;

/// The number of an attribute, from expat's list of names and values.
long number_of(const char** attributes, std::string_view name, long missing) {
  while (*attributes && *attributes != name) attributes += 2;
  if (!*attributes) return missing;
  const std::string text = attributes[1];
  if (text.empty() || text.size() > 7 || text.find_first_not_of("0123456789") != text.npos) return kNotUnderstood;
  return std::stol(text);
}

/// Whether the slices are in the order of the pages.
bool is_in_order(const char** data) {
  const long first = number_of(data, "FirstZ", 0);
  return first >= 0 && number_of(data, "IFD", 0) == first && number_of(data, "FirstC", 0) == 0 &&
         number_of(data, "FirstT", 0) == 0;
}

/// What the tags tell of the pages.
struct OmePages {
  XML_Parser parser = nullptr;
  int images = 0, pixels = 0;
  bool in_order = true;
  std::string several;
  std::uint64_t pages = 0;
};

void read_tag(void* into, const char* full_name, const char** attributes) {
  OmePages& found = *static_cast<OmePages*>(into);
  std::string_view name = full_name;
  name.remove_prefix(name.find(':') + 1);  // the prefix of its namespace; npos + 1 is 0
  if (name == "Image") ++found.images;
  if (name == "TiffData") found.in_order = found.in_order && is_in_order(attributes);
  if (name != "Pixels" || ++found.pixels > 1) return;
  const long slices = number_of(attributes, "SizeZ", 0), channels = number_of(attributes, "SizeC", kNotUnderstood),
             times = number_of(attributes, "SizeT", kNotUnderstood);
  if (channels < 1 || times < 1 || slices < 0) found.in_order = false;
  if (channels > 1) found.several = formatted("an OME stack of {} channels", channels);
  if (found.several.empty() && times > 1) found.several = formatted("an OME stack of {} times", times);
  if (found.in_order) found.pages = std::uint64_t(slices) * std::uint64_t(channels) * std::uint64_t(times);
}

/// A document type could redefine names, and blow them up.
void refuse_document_type(void* into, const char*, const char*, const char*, int) {
  XML_StopParser(static_cast<OmePages*>(into)->parser, false);
}

/// False if the text is not understood to its end.
bool read_tags(const std::string& text, OmePages& found) {
  // Any byte is a letter of Latin-1: names and numbers are ASCII, and programs write units in encodings of their own.
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate("ISO-8859-1"),
                                                                            XML_ParserFree);
  found.parser = parser.get();
  XML_SetUserData(parser.get(), &found);
  XML_SetStartElementHandler(parser.get(), read_tag);
  XML_SetStartDoctypeDeclHandler(parser.get(), refuse_document_type);
  return XML_Parse(parser.get(), text.data(), int(text.size()), true) == XML_STATUS_OK;
}

}  // namespace

TiffDescription read_ome_description(const std::string& text) {
  TiffDescription description;
  OmePages found;
  const bool is_understood = read_tags(text, found);
  if (found.pixels == 1 && found.images <= 1) description.pages = found.pages;
  if (found.images > 1)
    description.other_pages = formatted("an OME file of {} images", found.images);
  else if (!found.several.empty())
    description.other_pages = found.several;
  else if (found.pixels != 1 || !found.in_order || !is_understood)
    description.other_pages =
        "an OME file whose description is not that of one stack of slices in the order of its pages";
  return description;
}

}  // namespace marrow::files
