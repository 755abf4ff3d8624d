// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/session.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>

#include <stdexcept>

namespace minisim {
namespace {

void shareArrays(Session& session, int location, vtkDataSetAttributes* attributes,
                 const std::string& wanted, int& count) {
  for (int i = 0; i < attributes->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = attributes->GetArray(i);  // null: no numbers
    if (!array || !array->GetName() || vestigeType(array) < 0) continue;
    if (!wanted.empty() && wanted != array->GetName()) continue;
    session.field(0, array->GetName(), location, array);
    ++count;
  }
}

std::vector<double> coordinates(vtkDataArray* array) {
  std::vector<double> values(array->GetNumberOfTuples());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = array->GetComponent(vtkIdType(i), 0);
  return values;
}

}  // namespace

int vestigeType(vtkDataArray* array) {
  if (!array->HasStandardMemoryLayout()) return -1;
  const bool wide = array->GetDataTypeSize() == 8;
  switch (array->GetDataType()) {
    case VTK_FLOAT:
      return VESTIGE_FLOAT32;
    case VTK_DOUBLE:
      return VESTIGE_FLOAT64;
    case VTK_CHAR:
      return array->GetDataTypeMin() < 0 ? VESTIGE_INT8 : VESTIGE_UINT8;
    case VTK_SIGNED_CHAR:
      return VESTIGE_INT8;
    case VTK_UNSIGNED_CHAR:
      return VESTIGE_UINT8;
    case VTK_SHORT:
      return VESTIGE_INT16;
    case VTK_UNSIGNED_SHORT:
      return VESTIGE_UINT16;
    case VTK_INT:
      return VESTIGE_INT32;
    case VTK_UNSIGNED_INT:
      return VESTIGE_UINT32;
    case VTK_LONG:
    case VTK_LONG_LONG:
    case VTK_ID_TYPE:
      return wide ? VESTIGE_INT64 : VESTIGE_INT32;
    case VTK_UNSIGNED_LONG:
    case VTK_UNSIGNED_LONG_LONG:
      return wide ? VESTIGE_UINT64 : VESTIGE_UINT32;
    default:
      return -1;
  }
}

Session::Session(const Options& options) : options_(options) {
  vestige_options open = VESTIGE_OPTIONS_INIT;
  const auto orNull = [](const std::string& text) { return text.empty() ? nullptr : text.c_str(); };
  open.config = orNull(options_.config);
  open.config_text = open.config ? nullptr : orNull(options_.configText);
  open.output = orNull(options_.output);
  open.log_data = this;
  open.log = [](int level, const char* sentence, void* self) {
    if (level != VESTIGE_WARNING) return;  // errors come as codes
    static_cast<Session*>(self)->options_.warn(sentence);
  };
  note(vestige_open(&open, &vestige_));
}

Session::~Session() { vestige_close(vestige_); }

std::string Session::lastError() const {
  return std::string(vestige_last_error(vestige_)) + " (" + vestige_code_name(code_) + ")";
}

void Session::domain(const double low[3], const double high[3]) {
  note(vestige_domain(vestige_, low, high));
}

void Session::units(const std::string& name, const std::string& units) {
  note(vestige_units(vestige_, name.c_str(), units.c_str()));
}

void Session::block(int block, const vestige_grid& grid) {
  note(vestige_block(vestige_, block, &grid));
}

void Session::field(int block, const std::string& name, int location, vtkDataArray* array) {
  shared_.emplace_back(array);
  note(vestige_share_field(vestige_, block, name.c_str(), vestigeType(array), location,
                           array->GetNumberOfComponents(), array->GetVoidPointer(0), nullptr));
}

void Session::mask(int block, int location, vtkDataArray* array) {
  shared_.emplace_back(array);
  note(vestige_share_mask(vestige_, block, location,
                          static_cast<const std::uint8_t*>(array->GetVoidPointer(0)), 0xff,
                          nullptr));
}

int Session::execute(std::int64_t cycle, double time) {
  note(vestige_execute(vestige_, cycle, time));
  shared_.clear();
  return std::exchange(code_, int(VESTIGE_OK));
}

void shareDataSet(Session& session, vtkDataSet* data, const std::string& array) {
  vestige_grid grid = VESTIGE_GRID_INIT;
  std::vector<double> axes[3];
  if (auto* image = vtkImageData::SafeDownCast(data)) {
    image->GetDimensions(grid.points);
    image->GetSpacing(grid.spacing);
    // Positions count from index 0, an extent may begin elsewhere.
    image->GetPoint(0, grid.origin);
  } else if (auto* rectilinear = vtkRectilinearGrid::SafeDownCast(data)) {
    rectilinear->GetDimensions(grid.points);
    axes[0] = coordinates(rectilinear->GetXCoordinates());
    axes[1] = coordinates(rectilinear->GetYCoordinates());
    axes[2] = coordinates(rectilinear->GetZCoordinates());
    for (int axis = 0; axis < 3; ++axis) grid.axes[axis] = axes[axis].data();
  } else {
    throw std::runtime_error(std::string("a ") + data->GetClassName() +
                             " is neither an image nor a rectilinear grid");
  }
  session.block(0, grid);
  int count = 0;
  shareArrays(session, VESTIGE_POINT, data->GetPointData(), array, count);
  shareArrays(session, VESTIGE_CELL, data->GetCellData(), array, count);
  if (count > 0) return;
  std::string names;
  for (vtkDataSetAttributes* attributes : {static_cast<vtkDataSetAttributes*>(data->GetPointData()),
                                           static_cast<vtkDataSetAttributes*>(data->GetCellData())})
    for (int i = 0; i < attributes->GetNumberOfArrays(); ++i)
      if (attributes->GetArrayName(i)) names += std::string(" ") + attributes->GetArrayName(i);
  throw std::runtime_error(array.empty() ? "no array of numbers with a name"
                                         : "no array '" + array + "'; there are:" + names);
}

}  // namespace minisim
