// SPDX-License-Identifier: BSD-3-Clause
//
// Vestige for programs that hold their data in VTK 9. Header-only: link VTK::CommonDataModel and
// VTK::FiltersCore yourself. C++17.
#ifndef VESTIGE_VTK_H
#define VESTIGE_VTK_H

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>
#include <vtkResampleToImage.h>
#include <vtkSOADataArrayTemplate.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "vestige.h"

namespace vestige {

/// Shares data sets with a session. Keeps what it shares alive: hold it until vestige_execute has
/// returned, then release() it.
///
/// vtkImageData (axis-aligned) and vtkRectilinearGrid are shared without a copy: every numeric
/// array of point and cell data, interleaved or one array a component (vtkSOADataArrayTemplate).
/// Arrays of other layouts are copied. vtkGhostType gives ghost layers (planes of nothing but
/// duplicate cells, or duplicate points where cells say nothing) and masks hidden points and cells.
/// Arrays whose names begin with "vtk" are VTK's own and are left out.
///
/// Any other data set, and images that are turned, are resampled by vtkResampleToImage on a grid of
/// `resampledPoints` points along the longest side of its bounds and in proportion along the
/// others: that costs one cell search for each of these points, the memory of the resampled arrays,
/// and what is smaller than a spacing. Points outside all cells are no data; cell data become
/// constant inside their cells.
class VtkImport {
 public:
  explicit VtkImport(vestige_session* session) : session_(session) {}

  /// Describes the data set as a block and shares its arrays. Returns the first error's code.
  int share(int block, vtkDataSet* data, int resampledPoints = 128) {
    if (!data) return vestige_block(session_, block, nullptr);
    if (auto* image = vtkImageData::SafeDownCast(data)) {
      if (image->GetDirectionMatrix()->IsIdentity()) return shareImage(block, image);
    }
    if (auto* grid = vtkRectilinearGrid::SafeDownCast(data)) return shareRectilinear(block, grid);
    return shareResampled(block, data, resampledPoints);
  }

  /// Lets go of what was shared; call it after vestige_execute.
  void release() { kept_.clear(); }

  /// The vestige_type of a VTK type (VTK_FLOAT ...); -1 if there is none.
  static int typeOf(int vtkType) {
    switch (vtkType) {
      case VTK_FLOAT:
        return VESTIGE_FLOAT32;
      case VTK_DOUBLE:
        return VESTIGE_FLOAT64;
      case VTK_CHAR:
        return integer<char>();
      case VTK_SIGNED_CHAR:
        return VESTIGE_INT8;
      case VTK_UNSIGNED_CHAR:
        return VESTIGE_UINT8;
      case VTK_SHORT:
        return integer<short>();
      case VTK_UNSIGNED_SHORT:
        return integer<unsigned short>();
      case VTK_INT:
        return integer<int>();
      case VTK_UNSIGNED_INT:
        return integer<unsigned int>();
      case VTK_LONG:
        return integer<long>();
      case VTK_UNSIGNED_LONG:
        return integer<unsigned long>();
      case VTK_LONG_LONG:
        return integer<long long>();
      case VTK_UNSIGNED_LONG_LONG:
        return integer<unsigned long long>();
      case VTK_ID_TYPE:
        return integer<vtkIdType>();
      default:
        return -1;
    }
  }

 private:
  template <class T>
  static constexpr int integer() {
    constexpr int width = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
    return VESTIGE_INT8 + 2 * width + (std::is_unsigned_v<T> ? 1 : 0);
  }

  int shareImage(int block, vtkImageData* image) {
    vestige_grid grid = VESTIGE_GRID_INIT;
    int extent[6];
    image->GetExtent(extent);
    image->GetDimensions(grid.points);
    for (int a = 0; a < 3; ++a) {
      grid.first[a] = extent[2 * a];
      grid.origin[a] = image->GetOrigin()[a];
      grid.spacing[a] = image->GetSpacing()[a];
      if (grid.points[a] == 1 && !(grid.spacing[a] > 0.0)) grid.spacing[a] = 1.0;
    }
    return shareAll(block, grid, image);
  }

  int shareRectilinear(int block, vtkRectilinearGrid* data) {
    vestige_grid grid = VESTIGE_GRID_INIT;
    data->GetDimensions(grid.points);
    vtkDataArray* coordinates[] = {data->GetXCoordinates(), data->GetYCoordinates(),
                                   data->GetZCoordinates()};
    std::array<std::vector<double>, 3> axes;
    for (std::size_t a = 0; a < 3; ++a) {
      for (int i = 0; i < grid.points[a]; ++i) axes[a].push_back(coordinates[a]->GetTuple1(i));
      grid.axes[a] = axes[a].data();
    }
    return shareAll(block, grid, data);
  }

  int shareResampled(int block, vtkDataSet* data, int resampledPoints) {
    double bounds[6];
    data->GetBounds(bounds);
    double longest = 0.0;
    for (int a = 0; a < 3; ++a) longest = std::max(longest, bounds[2 * a + 1] - bounds[2 * a]);
    int points[3];
    for (int a = 0; a < 3; ++a) {
      const double share = longest > 0.0 ? (bounds[2 * a + 1] - bounds[2 * a]) / longest : 0.0;
      points[a] = std::max(2, int(share * std::max(2, resampledPoints) + 0.5));
    }
    auto resample = vtkSmartPointer<vtkResampleToImage>::New();
    resample->SetInputDataObject(data);
    resample->UseInputBoundsOn();
    resample->SetSamplingDimensions(points);
    resample->Update();
    vtkImageData* image = resample->GetOutput();
    kept_.emplace_back(image);
    return shareImage(block, image);
  }

  int shareAll(int block, vestige_grid& grid, vtkDataSet* data) {
    std::array<int, 3> cells{};
    std::array<int, 3> points{grid.points[0], grid.points[1], grid.points[2]};
    for (std::size_t a = 0; a < 3; ++a) cells[a] = std::max(1, points[a] - 1);
    auto* pointGhosts = data->GetPointGhostArray();
    auto* cellGhosts = data->GetCellGhostArray();
    if (cellGhosts) {
      countLayers(cellGhosts, vtkDataSetAttributes::DUPLICATECELL, cells, grid.ghosts);
    } else if (pointGhosts) {
      countLayers(pointGhosts, vtkDataSetAttributes::DUPLICATEPOINT, points, grid.ghosts);
    }
    int code = vestige_block(session_, block, &grid);
    const auto keepFirst = [&](int next) { code = code == VESTIGE_OK ? next : code; };
    if (pointGhosts) {
      keepFirst(shareMask(block, VESTIGE_POINT, pointGhosts, vtkDataSetAttributes::HIDDENPOINT));
    }
    if (cellGhosts) {
      keepFirst(shareMask(block, VESTIGE_CELL, cellGhosts, vtkDataSetAttributes::HIDDENCELL));
    }
    keepFirst(shareArrays(block, VESTIGE_POINT, data->GetPointData(), points));
    keepFirst(shareArrays(block, VESTIGE_CELL, data->GetCellData(), cells));
    return code;
  }

  int shareMask(int block, int location, vtkUnsignedCharArray* ghosts, int bit) {
    kept_.emplace_back(ghosts);
    return vestige_share_mask(session_, block, location, ghosts->GetPointer(0), std::uint8_t(bit),
                              nullptr);
  }

  int shareArrays(int block, int location, vtkDataSetAttributes* attributes,
                  const std::array<int, 3>& size) {
    int code = VESTIGE_OK;
    for (int i = 0; i < attributes->GetNumberOfArrays(); ++i) {
      vtkDataArray* array = attributes->GetArray(i);
      if (!array || typeOf(array->GetDataType()) < 0) continue;
      const std::string name = array->GetName() ? array->GetName() : "array" + std::to_string(i);
      if (name.rfind("vtk", 0) == 0) continue;
      const auto samples = vtkIdType(size[0]) * size[1] * size[2];
      if (array->GetNumberOfTuples() < samples) continue;
      const int shared = shareArray(block, location, name, array);
      if (code == VESTIGE_OK) code = shared;
    }
    return code;
  }

  int shareArray(int block, int location, const std::string& name, vtkDataArray* array) {
    const int type = typeOf(array->GetDataType()), components = array->GetNumberOfComponents();
    std::vector<const void*> separate;
    switch (array->GetDataType()) {
      vtkTemplateMacro(separate = separateComponents<VTK_TT>(array));
    }
    if (!separate.empty()) {
      kept_.emplace_back(array);
      return vestige_share_components(session_, block, name.c_str(), type, location, components,
                                      separate.data(), nullptr);
    }
    vtkSmartPointer<vtkDataArray> packed = array;
    if (!array->HasStandardMemoryLayout()) {
      packed =
          vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(array->GetDataType()));
      packed->DeepCopy(array);
    }
    kept_.emplace_back(packed);
    return vestige_share_field(session_, block, name.c_str(), type, location, components,
                               packed->GetVoidPointer(0), nullptr);
  }

  template <class T>
  static std::vector<const void*> separateComponents(vtkDataArray* array) {
    std::vector<const void*> pointers;
    if (auto* separate = vtkSOADataArrayTemplate<T>::FastDownCast(array)) {
      for (int c = 0; c < array->GetNumberOfComponents(); ++c) {
        pointers.push_back(separate->GetComponentArrayPointer(c));
      }
    }
    return pointers;
  }

  /// How many outermost planes at each face hold nothing but samples with `bit`.
  static void countLayers(vtkUnsignedCharArray* ghosts, int bit, const std::array<int, 3>& size,
                          int layers[6]) {
    const auto* flags = ghosts->GetPointer(0);
    const std::array<vtkIdType, 3> stride{1, size[0], vtkIdType(size[0]) * size[1]};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
      const auto isGhost = [&](int plane) {
        for (int j = 0; j < size[c]; ++j) {
          for (int i = 0; i < size[b]; ++i) {
            if (!(flags[plane * stride[a] + i * stride[b] + j * stride[c]] & bit)) return false;
          }
        }
        return true;
      };
      int low = 0, high = 0;
      while (low < size[a] && isGhost(low)) ++low;
      while (low + high < size[a] && isGhost(size[a] - 1 - high)) ++high;
      layers[2 * a] = low;
      layers[2 * a + 1] = high;
    }
  }

  vestige_session* session_;
  std::vector<vtkSmartPointer<vtkObject>> kept_;
};

}  // namespace vestige

#endif
