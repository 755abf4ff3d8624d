// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/data_set_reader.h"

#include <vtkCellData.h>
#include <vtkDICOMImageReader.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetReader.h>
#include <vtkErrorCode.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkImageReader2.h>
#include <vtkLogger.h>
#include <vtkMetaImageReader.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNew.h>
#include <vtkNrrdReader.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLRectilinearGridReader.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

#include "mini-sim/replay/file_series.h"
#include "mini-sim/replay/image_headers.h"

namespace minisim {
namespace {

/// Keeps what VTK would print.
class CapturingWindow : public vtkOutputWindow {
 public:
  static CapturingWindow* New();
  vtkTypeMacro(CapturingWindow, vtkOutputWindow) void DisplayText(const char*) override {}
  void DisplayErrorText(const char* text) override { errors += text; }
  void DisplayGenericWarningText(const char* text) override { DisplayWarningText(text); }
  void DisplayWarningText(const char* text) override {
    // Some readers only warn when data end early: "File operation failed", "Error reading".
    const std::string warning = text;
    if (warning.find("failed") != std::string::npos || warning.find("Error") != std::string::npos)
      errors += warning;
  }
  void DisplayDebugText(const char*) override {}
  std::string errors;
};
vtkStandardNewMacro(CapturingWindow)

    class CaptureErrors {
 public:
  CaptureErrors()
      : before_(vtkOutputWindow::GetInstance()),
        verbosity_(vtkLogger::GetCurrentVerbosityCutoff()) {
    vtkOutputWindow::SetInstance(window_);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  }
  ~CaptureErrors() {
    vtkLogger::SetStderrVerbosity(verbosity_);
    vtkOutputWindow::SetInstance(before_);
  }
  CaptureErrors(const CaptureErrors&) = delete;
  CaptureErrors& operator=(const CaptureErrors&) = delete;

  /// The first sentence of VTK's first error, without its "ERROR: In file, line" and address.
  std::string reason() const {
    std::istringstream lines(window_->errors);
    for (std::string line; std::getline(lines, line);) {
      if (line.find(": In ") != std::string::npos && line.find(", line ") != std::string::npos)
        continue;
      const auto prefix = line.find("): ");
      if (line.starts_with("vtk") && prefix != std::string::npos) line.erase(0, prefix + 3);
      if (!line.empty()) return line;
    }
    return {};
  }

 private:
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_;
  vtkNew<CapturingWindow> window_;
};

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& reason) {
  throw std::runtime_error("'" + file.string() + "': " + reason);
}

template <typename Reader>
vtkSmartPointer<vtkDataSet> run(const std::filesystem::path& file, Reader* reader,
                                const CaptureErrors& capture) {
  reader->Update();
  if (const std::string reason = capture.reason(); !reason.empty()) fail(file, reason);
  if (const auto code = reader->GetErrorCode(); code != vtkErrorCode::NoError)
    fail(file, vtkErrorCode::GetStringFromErrorCode(code));
  return vtkDataSet::SafeDownCast(reader->GetOutputDataObject(0));
}

template <typename Reader>
vtkSmartPointer<vtkDataSet> readFile(const std::filesystem::path& file,
                                     const CaptureErrors& capture) {
  vtkNew<Reader> reader;
  reader->SetFileName(file.c_str());
  return run(file, reader.Get(), capture);
}

/// VTK's own image readers take anything for theirs; ask first.
template <typename Reader>
vtkSmartPointer<vtkDataSet> readImage(const std::filesystem::path& file, const char* format,
                                      const CaptureErrors& capture) {
  vtkNew<Reader> reader;
  if (!reader->CanReadFile(file.c_str())) fail(file, std::string("is not a ") + format + " file");
  reader->SetFileName(file.c_str());
  return run(file, reader.Get(), capture);
}

vtkSmartPointer<vtkDataSet> readNrrd(const std::filesystem::path& file,
                                     const CaptureErrors& capture) {
  const auto data = readImage<vtkNrrdReader>(file, "NRRD", capture);
  const auto axes = unnamedNrrdAxes(file);
  auto* image = vtkImageData::SafeDownCast(data);
  vtkDataArray* array = image ? image->GetPointData()->GetScalars() : nullptr;
  if (!axes || !array) return data;
  const vtkIdType samples = vtkIdType(axes->sizes[0]) * axes->sizes[1] * axes->sizes[2];
  if (array->GetNumberOfValues() != samples) fail(file, "its data do not fit its sizes");
  // The same values in the same order, seen as samples instead of components.
  array->SetNumberOfComponents(1);
  array->SetNumberOfTuples(samples);
  vtkNew<vtkImageData> mended;
  mended->SetDimensions(axes->sizes.data());
  mended->SetSpacing(axes->spacing.data());
  mended->SetOrigin(image->GetOrigin());
  mended->GetPointData()->SetScalars(array);
  return vtkSmartPointer<vtkDataSet>(mended.Get());
}

vtkSmartPointer<vtkDataSet> readRaw(const std::filesystem::path& file, const RawLayout& raw,
                                    const CaptureErrors& capture) {
  static const std::map<std::string, std::pair<int, int>> kTypes = {
      {"int8", {VTK_SIGNED_CHAR, 1}}, {"uint8", {VTK_UNSIGNED_CHAR, 1}},
      {"int16", {VTK_SHORT, 2}},      {"uint16", {VTK_UNSIGNED_SHORT, 2}},
      {"int32", {VTK_INT, 4}},        {"uint32", {VTK_UNSIGNED_INT, 4}},
      {"float32", {VTK_FLOAT, 4}},    {"float64", {VTK_DOUBLE, 8}}};
  const auto type = kTypes.find(raw.type);
  if (type == kTypes.end()) throw std::runtime_error("'" + raw.type + "' is no type of raw data");
  const auto have = std::filesystem::file_size(file);
  const auto need =
      raw.header + std::uintmax_t(raw.shape[0]) * raw.shape[1] * raw.shape[2] * type->second.second;
  if (have != need)
    fail(file, "has " + std::to_string(have) + " bytes; " + std::to_string(raw.shape[0]) + " x " +
                   std::to_string(raw.shape[1]) + " x " + std::to_string(raw.shape[2]) + " " +
                   raw.type + " with a header of " + std::to_string(raw.header) + " need " +
                   std::to_string(need));
  vtkNew<vtkImageReader2> reader;
  reader->SetFileName(file.c_str());
  reader->SetFileDimensionality(3);
  reader->SetDataScalarType(type->second.first);
  reader->SetDataExtent(0, raw.shape[0] - 1, 0, raw.shape[1] - 1, 0, raw.shape[2] - 1);
  reader->SetDataSpacing(raw.spacing.data());
  reader->SetHeaderSize(raw.header);
  reader->FileLowerLeftOn();  // the first row is the lowest y
  if (raw.bigEndian)
    reader->SetDataByteOrderToBigEndian();
  else
    reader->SetDataByteOrderToLittleEndian();
  return run(file, reader.Get(), capture);
}

/// Undoes VTK's half turn of DICOM volumes about x, rows upward and slices backward: that is all
/// rows in reverse order. Then x runs along the files' rows, y down their columns, z along the
/// slices' positions: left, posterior and superior where slices are axial.
void turnBack(vtkImageData* image) {
  vtkDataArray* array = image->GetPointData()->GetScalars();
  if (!array) return;
  const int* size = image->GetDimensions();
  const std::size_t row = std::size_t(size[0]) * std::size_t(array->GetNumberOfComponents()) *
                          std::size_t(array->GetDataTypeSize());
  auto* first = static_cast<char*>(array->GetVoidPointer(0));
  auto* last = first + row * (std::size_t(size[1]) * std::size_t(size[2]) - 1);
  for (; first < last; first += row, last -= row) std::swap_ranges(first, first + row, last);
}

vtkSmartPointer<vtkDataSet> readDicomFolder(const std::filesystem::path& folder,
                                            const CaptureErrors& capture) {
  vtkNew<vtkDICOMImageReader> reader;
  bool any = false;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    any = any || (entry.is_regular_file() && reader->CanReadFile(entry.path().c_str()));
  if (!any) fail(folder, "has neither files that can be read by extension nor DICOM slices");
  reader->SetDirectoryName(folder.c_str());
  const auto data = run(folder, reader.Get(), capture);
  // DICOM states the distance of rows (y) first, VTK takes it for that of columns.
  if (auto* image = vtkImageData::SafeDownCast(data)) {
    const double* spacing = image->GetSpacing();
    image->SetSpacing(spacing[1], spacing[0], spacing[2]);
    turnBack(image);
  }
  return data;
}

vtkSmartPointer<vtkDataSet> read(const std::filesystem::path& file,
                                 const std::optional<RawLayout>& raw,
                                 const CaptureErrors& capture) {
  if (raw) return readRaw(file, *raw, capture);
  if (std::filesystem::is_directory(file)) return readDicomFolder(file, capture);
  switch (kindOf(file)) {
    case FileKind::VtkXmlImage:
      return readImage<vtkXMLImageDataReader>(file, "VTK XML image (.vti)", capture);
    case FileKind::VtkXmlRectilinear:
      return readImage<vtkXMLRectilinearGridReader>(file, "VTK XML rectilinear grid (.vtr)",
                                                    capture);
    case FileKind::VtkLegacy:
      return readFile<vtkDataSetReader>(file, capture);
    case FileKind::MetaImage:
      checkMetaImageSize(file);
      return readImage<vtkMetaImageReader>(file, "MetaImage", capture);
    case FileKind::Nrrd:
      return readNrrd(file, capture);
    case FileKind::Nifti:
      return readImage<vtkNIFTIImageReader>(file, "NIfTI", capture);
    case FileKind::Unknown:
      break;
  }
  fail(file,
       "unknown kind of file: .vti .vtr .vtk .mhd .mha .nrrd .nhdr .nii .nii.gz are known; "
       "give --shape for raw bytes");
}

}  // namespace

vtkSmartPointer<vtkDataSet> readDataSet(const std::filesystem::path& file,
                                        const std::optional<RawLayout>& raw) {
  if (!std::filesystem::exists(file)) fail(file, "does not exist");
  const CaptureErrors capture;
  const auto data = read(file, raw, capture);
  if (!data || data->GetNumberOfPoints() == 0) fail(file, "holds no grid");
  if (data->GetPointData()->GetNumberOfArrays() + data->GetCellData()->GetNumberOfArrays() == 0)
    fail(file, "holds no arrays");
  const bool namesArrays = raw ? false
                               : kindOf(file) == FileKind::VtkXmlImage ||
                                     kindOf(file) == FileKind::VtkXmlRectilinear ||
                                     kindOf(file) == FileKind::VtkLegacy;
  if (!namesArrays && data->GetPointData()->GetScalars())
    data->GetPointData()->GetScalars()->SetName(kUnnamedArray);
  return data;
}

std::optional<double> statedTime(vtkDataSet* data) {
  vtkDataArray* time = data->GetFieldData()->GetArray("TimeValue");
  if (!time || time->GetNumberOfTuples() != 1) return std::nullopt;
  return time->GetComponent(0, 0);
}

}  // namespace minisim
