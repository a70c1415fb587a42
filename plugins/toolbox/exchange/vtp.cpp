// SPDX-License-Identifier: Apache-2.0
// Surfaces of VTK (.vtp), read and written by VTK itself. 3D Slicer marks the coordinate system by a text "SPACE".
#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkOutputWindow.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <stdexcept>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/vtk/poly_data.hpp"

namespace marrow::exchange {
namespace {

/// Keeps the first complaint of VTK, instead of printing it.
class Complaints : public vtkOutputWindow {
 public:
  static Complaints* New() { return new Complaints; }
  void DisplayText(const char* text) override { keep(text); }
  void DisplayErrorText(const char* text) override { keep(text); }
  void DisplayWarningText(const char* text) override { keep(text); }
  void DisplayGenericWarningText(const char* text) override { keep(text); }
  bool are_none() const { return first_.empty(); }
  /// Its last line, which says what is wrong; the others name VTK's source.
  std::string shown() const {
    std::string text = first_;
    while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
    text = text.substr(text.rfind('\n') + 1);
    if (const std::size_t at = text.find("): "); at != std::string::npos) text = text.substr(at + 3);
    return printable(text.substr(0, 120));
  }

 private:
  void keep(const char* text) {
    if (first_.empty() && text) first_ = text;
  }
  std::string first_;
};

/// Receives VTK's complaints during its lifetime.
class Listening {
 public:
  explicit Listening(Complaints* complaints) : before_(vtkOutputWindow::GetInstance()) {
    vtkOutputWindow::SetInstance(complaints);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  }
  ~Listening() {
    vtkOutputWindow::SetInstance(before_);
    vtkLogger::SetStderrVerbosity(verbosity_);
  }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

 private:
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_ = vtkLogger::GetCurrentVerbosityCutoff();
};

/// The numbers that follow `name` (as in name="4") in the text before `end`, added up; infinite if one is negative.
double claimed(const std::string& bytes, std::size_t end, const std::string& name) {
  double sum = 0;
  for (std::size_t at = 0; (at = bytes.find(name, at)) < end;) {
    at = std::min(bytes.find_first_not_of(" \t\r\n='\"+", at + name.size()), bytes.size());
    double count = 0;
    const auto end_of_number = std::from_chars(bytes.data() + at, bytes.data() + bytes.size(), count);
    const bool is_claim = count >= 0 && end_of_number.ec != std::errc::result_out_of_range;
    sum += is_claim ? count : std::numeric_limits<double>::infinity();
  }
  return sum;
}

/// VTK would reserve memory for as many points and cells as the file claims to have, whatever its size.
void check_claims(const std::string& bytes, const std::string& what) {
  const std::size_t end = std::min(bytes.find("<AppendedData"), bytes.size());
  constexpr double kMostPerByte = 1100;  // zlib packs at most 1032 bytes into one
  for (const char* name : {"NumberOfPoints", "NumberOfVerts", "NumberOfLines", "NumberOfStrips", "NumberOfPolys",
                           "NumberOfTuples", "NumberOfComponents"}) {
    const double count = claimed(bytes, end, name);
    if (!(count <= kMostPerByte * double(bytes.size()) && count < 4e9))
      throw Error(
          formatted("{}: its {} is negative, or more than a file of {} bytes can hold; it is damaged: export it again",
                    what, name, bytes.size()));
  }
}

/// The value of an attribute in the text of a tag; empty if there is none. XML allows both quotes, and blanks about
/// '='.
std::string_view attribute(std::string_view tag, std::string_view name) {
  constexpr std::string_view kBlanks = " \t\r\n";
  for (std::size_t at = tag.find(name, 1); at != std::string_view::npos; at = tag.find(name, at + 1)) {
    if (kBlanks.find(tag[at - 1]) == std::string_view::npos) continue;  // the end of a longer name
    const std::size_t equals = tag.find_first_not_of(kBlanks, at + name.size());
    if (equals == std::string_view::npos || tag[equals] != '=') continue;
    const std::size_t quote = tag.find_first_not_of(kBlanks, equals + 1);
    if (quote == std::string_view::npos || (tag[quote] != '"' && tag[quote] != '\'')) continue;
    const std::size_t end = tag.find(tag[quote], quote + 1);
    if (end != std::string_view::npos) return tag.substr(quote + 1, end - quote - 1);
  }
  return {};
}

void check_is_vtp(const std::string& bytes, const std::string& what) {
  const std::size_t begin = bytes.find("<VTKFile");
  if (begin == std::string::npos)
    throw Error(what + ": expected a surface of VTK in XML, with <VTKFile at its beginning; export it again as .vtp");
  if (attribute(std::string_view(bytes).substr(begin, bytes.find('>', begin) - begin), "type") != "PolyData")
    throw Error(what + ": its type is not PolyData, so it is no surface; export the surface as .vtp");
}

FilePolygons polygons_of(vtkPolyData& data, const std::string& what) {
  FilePolygons result;
  auto& [points, corners, counts] = result.polygons;
  points.resize(std::size_t(data.GetNumberOfPoints()));
  for (std::size_t i = 0; i < points.size(); ++i) data.GetPoint(vtkIdType(i), points[i].data());
  if (data.GetNumberOfStrips() > 0)
    throw Error(what + ": has strips of triangles, which are not read; save it with polygons (VTK: vtkTriangleFilter)");
  vtkCellArray& faces = *data.GetPolys();
  for (vtkIdType cell = 0; cell < faces.GetNumberOfCells(); ++cell) {
    vtkIdType count = 0;
    const vtkIdType* corner = nullptr;
    faces.GetCellAtId(cell, count, corner);
    for (vtkIdType i = 0; i < count; ++i) {
      if (corner[i] < 0 || std::size_t(corner[i]) >= points.size())
        throw Error(
            formatted("{}: a face names point {}; there are {}, counted from 0", what, corner[i], points.size()));
      corners.push_back(std::uint32_t(corner[i]));
    }
    counts.push_back(std::uint32_t(count));
  }
  if (counts.empty()) throw Error(what + ": there is no polygon in it; export the surface again as .vtp");
  auto* const space = vtkStringArray::SafeDownCast(data.GetFieldData()->GetAbstractArray("SPACE"));
  if (space && space->GetNumberOfValues() > 0) result.space.look_into("SPACE=" + space->GetValue(0));
  return result;
}

}  // namespace

FilePolygons read_vtp(const std::filesystem::path& path) {
  const std::string what = path.string(), bytes = files::read_bytes(path, kMostSurfaceBytes);
  check_is_vtp(bytes, what);
  check_claims(bytes, what);
  vtkNew<Complaints> complaints;
  const Listening listening(complaints);
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(bytes);
  try {
    reader->Update();
  } catch (const std::logic_error&) {  // a length that VTK takes from the file, and asks a vector for
    throw Error(what + ": VTK cannot read it; it is damaged: export it again");
  }
  if (!complaints->are_none())
    throw Error(what + ": VTK cannot read it (" + complaints->shown() + "); it is cut off or damaged: export it again");
  return polygons_of(*reader->GetOutput(), what);
}

std::string vtp_bytes(const Mesh& mesh) {
  check_mesh(mesh, "the surface cannot be written as .vtp");
  vtkNew<vtkStringArray> space;
  space->SetName("SPACE");
  space->InsertNextValue("LPS");
  const auto data = vtk::poly_data(mesh);
  data->GetFieldData()->AddArray(space);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  if (!writer->Write()) throw Error("the surface cannot be written as .vtp");
  return writer->GetOutputString();
}

}  // namespace marrow::exchange
