// SPDX-License-Identifier: Apache-2.0
// Painted masks. They lie in .marrow/drafts until the case is saved, each under the digest of its content, so that
// undoing a stroke finds the mask as it was.
#include <cstdint>

#include "marrow/domain/printable.hpp"
#include "marrow/runtime/hash.hpp"
#include "marrow/toolbox/files/samples_out.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The image whose pixels, row after row, are first used, then not used, and so on, each for as many pixels as `runs`
/// says. Throws Error unless they fill the image.
std::string mask_of(int width_px, int height_px, const json& runs) {
  const std::size_t count = std::size_t(width_px) * std::size_t(height_px);
  std::string mask;
  mask.reserve(count);
  bool is_used = true;
  for (const json& run : runs) {
    const std::size_t length = run.is_number_unsigned() ? run.get<std::size_t>() : count + 1;
    if (length > count - mask.size()) break;
    mask.append(length, is_used ? '\xff' : '\0');
    is_used = !is_used;
  }
  if (!runs.is_array() || mask.size() != count)
    throw Error("the mask does not fill its image of " + std::to_string(width_px) + " x " + std::to_string(height_px) +
                " pixels");
  return mask;
}

int side_of(const Request& request, const std::string& name) {
  const json side = request.body.value(name, json());
  if (!side.is_number_integer() || side < 1 || side > 65536)
    throw Error("'" + name + "' must be a whole number from 1 to 65536");
  return side.get<int>();
}

}  // namespace

void add_xray_masks(Server& server, Workbench& workbench) {
  server.post("/api/xray/mask", [&](const Request& request) {
    const int width_px = side_of(request, "width_px"), height_px = side_of(request, "height_px");
    if (std::int64_t(width_px) * height_px > 400'000'000) throw Error("the image is too large for a mask");
    const std::string mask = mask_of(width_px, height_px, request.body.value("runs", json()));
    const std::string png = files::png_of(width_px, height_px, 1, files::Sample::u8, mask.data());
    const fs::path file = working_file(workbench, "mask", ".png", png);
    return json_answer({{"mask", workbench.folder.relative(file)}});
  });
}

}  // namespace marrow::workbench
