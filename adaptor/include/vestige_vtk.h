// SPDX-License-Identifier: BSD-3-Clause
//
// Vestige for programs that hold their data in VTK 9. Header-only: link VTK::CommonDataModel and
// VTK::FiltersCore yourself. C++17.
#ifndef VESTIGE_VTK_H
#define VESTIGE_VTK_H

#include <vtkCellData.h>
#include <vtkCellTypes.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkGenericCell.h>
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
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
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
/// constant inside their cells. Cells must fill what they span: volumes, or surfaces in a plane of
/// two axes; particles, lines and curved surfaces are an error.
///
/// A composite data set (vtkMultiBlockDataSet) is as many blocks as it has leaves. A data set
/// without points, and a leaf that is null, is an empty block.
///
/// What is not stored is said, by vestige_report: an error where the data contradict themselves
/// (too few tuples), a warning where an array is of a kind that is not stored (strings, bits), or a
/// cell array has the name of a point array.
class VtkImport {
 public:
  explicit VtkImport(vestige_session* session) : session_(session) {}

  /// Describes the data set as a block and shares its arrays; the leaves of a composite one become
  /// the blocks `block`, `block` + 1, ... Returns the first error's code.
  int share(int block, vtkDataObject* data, int resampledPoints = 128) {
    if (auto* composite = vtkCompositeDataSet::SafeDownCast(data)) {
      return shareLeaves(block, composite, resampledPoints);
    }
    if (auto* single = vtkDataSet::SafeDownCast(data)) {
      return shareDataSet(block, single, resampledPoints);
    }
    return fail(VESTIGE_ERROR_ARGUMENT, block,
                data ? std::string("is a ") + data->GetClassName() + ", which is no vtkDataSet"
                     : "is NULL");
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

  int fail(int code, int block, const std::string& what) {
    return vestige_report(session_, code,
                          ("the data set of block " + std::to_string(block) + " " + what).c_str());
  }

  int shareLeaves(int block, vtkCompositeDataSet* composite, int resampledPoints) {
    int code = VESTIGE_OK, next = block;
    const auto leaves = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
    leaves->SkipEmptyNodesOff();
    for (leaves->InitTraversal(); !leaves->IsDoneWithTraversal(); leaves->GoToNextItem(), ++next) {
      vtkDataObject* leaf = leaves->GetCurrentDataObject();
      const int shared = leaf ? share(next, leaf, resampledPoints) : shareNothing(next);
      if (code == VESTIGE_OK) code = shared;
    }
    // Leaves of an earlier step.
    int& end = ends_[block];
    for (int gone = next; gone < end; ++gone) shareNothing(gone);
    end = next;
    return code;
  }

  int shareDataSet(int block, vtkDataSet* data, int resampledPoints) {
    auto* image = vtkImageData::SafeDownCast(data);
    auto* grid = vtkRectilinearGrid::SafeDownCast(data);
    const bool turned = image && !image->GetDirectionMatrix()->IsIdentity();
    if (image && !turned) return shareImage(block, image);
    if (grid) return shareRectilinear(block, grid);
    return shareResampled(block, data, resampledPoints);
  }

  int shareNothing(int block) {
    const vestige_grid empty = VESTIGE_GRID_INIT;
    return vestige_block(session_, block, &empty);
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
    }
    // A plane is as thick as a cell is wide.
    for (int a = 0; a < 3; ++a) {
      if (grid.points[a] != 1 || grid.spacing[a] > 0.0) continue;
      grid.spacing[a] = std::max(grid.spacing[(a + 1) % 3], grid.spacing[(a + 2) % 3]);
      if (!(grid.spacing[a] > 0.0)) grid.spacing[a] = 1.0;
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
      const auto given = coordinates[a] ? coordinates[a]->GetNumberOfTuples() : 0;
      if (given < grid.points[a]) {
        return fail(VESTIGE_ERROR_GRID, block,
                    "has " + std::to_string(given) + " " + "xyz"[a] + " coordinates for " +
                        std::to_string(grid.points[a]) + " points");
      }
      for (int i = 0; i < grid.points[a]; ++i) axes[a].push_back(coordinates[a]->GetTuple1(i));
      grid.axes[a] = axes[a].data();
    }
    return shareAll(block, grid, data);
  }

  /// The most dimensions of any cell: 3 = a volume, 0 = vertices; -1: there is none.
  static int cellDimension(vtkDataSet* data) {
    const auto types = vtkSmartPointer<vtkCellTypes>::New();
    data->GetCellTypes(types);
    const auto cell = vtkSmartPointer<vtkGenericCell>::New();
    int most = -1;
    for (vtkIdType i = 0; i < types->GetNumberOfTypes(); ++i) {
      if (types->GetCellType(i) == VTK_EMPTY_CELL) continue;
      cell->SetCellType(types->GetCellType(i));
      most = std::max(most, cell->GetCellDimension());
    }
    return most;
  }

  int shareResampled(int block, vtkDataSet* data, int resampledPoints) {
    if (data->GetNumberOfPoints() == 0) return shareNothing(block);
    int code = VESTIGE_OK;
    const auto keepFirst = [&](int next) { code = code == VESTIGE_OK ? next : code; };
    // The filter reads them as if they were long enough.
    const auto complete = vtkSmartPointer<vtkDataSet>::Take(data->NewInstance());
    complete->ShallowCopy(data);
    keepFirst(dropUnfit(block, VESTIGE_POINT, complete, data->GetNumberOfPoints()));
    keepFirst(dropUnfit(block, VESTIGE_CELL, complete, data->GetNumberOfCells()));

    double bounds[6], longest = 0.0;
    complete->GetBounds(bounds);
    int sides = 0;
    for (int a = 0; a < 3; ++a) {
      const double side = bounds[2 * a + 1] - bounds[2 * a];
      if (!std::isfinite(side)) {
        return fail(VESTIGE_ERROR_GRID, block,
                    std::string("reaches from ") + std::to_string(bounds[2 * a]) + " to " +
                        std::to_string(bounds[2 * a + 1]) + " along " + "xyz"[a]);
      }
      longest = std::max(longest, side);
      if (side > 0.0) ++sides;
    }
    const int cells = cellDimension(complete);
    if (cells < 2 || cells < sides) {
      static const char* const kinds[] = {"without cells", "of vertices", "of lines",
                                          "of surfaces"};
      return fail(VESTIGE_ERROR_GRID, block,
                  std::string("is a ") + data->GetClassName() + " " + kinds[cells + 1] + ", " +
                      std::to_string(data->GetNumberOfPoints()) +
                      " points: no cell has a volume in which a field could be sampled; bin or "
                      "interpolate it on a grid first");
    }
    const std::int64_t most = std::max(2, resampledPoints);
    std::int64_t all = 1;
    int points[3];
    for (int a = 0; a < 3; ++a) {
      const double side = bounds[2 * a + 1] - bounds[2 * a];
      points[a] = side > 0.0 ? std::max(2, int(side / longest * double(most) + 0.5)) : 1;
      all *= points[a];
      if (all > VTK_INT_MAX) {
        return fail(VESTIGE_ERROR_ARGUMENT, block,
                    "would be resampled on more than 2^31 points: " + std::to_string(most) +
                        " along its longest side are too many");
      }
    }
    auto resample = vtkSmartPointer<vtkResampleToImage>::New();
    resample->SetInputDataObject(complete);
    resample->UseInputBoundsOn();
    resample->SetSamplingDimensions(points);
    resample->Update();
    vtkImageData* image = resample->GetOutput();
    kept_.emplace_back(image);
    keepFirst(shareImage(block, image));
    return code;
  }

  int shareAll(int block, vestige_grid& grid, vtkDataSet* data) {
    std::array<int, 3> cells{};
    std::array<int, 3> points{grid.points[0], grid.points[1], grid.points[2]};
    for (std::size_t a = 0; a < 3; ++a) cells[a] = std::max(1, points[a] - 1);
    // Those that are too short are refused with the other arrays.
    const auto whole = [](vtkUnsignedCharArray* ghosts, const std::array<int, 3>& size) {
      const auto samples = vtkIdType(size[0]) * size[1] * size[2];
      return ghosts && ghosts->GetNumberOfTuples() >= samples ? ghosts : nullptr;
    };
    auto* pointGhosts = whole(data->GetPointGhostArray(), points);
    auto* cellGhosts = whole(data->GetCellGhostArray(), cells);
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
    keepFirst(shareArrays(block, VESTIGE_POINT, data, points));
    keepFirst(shareArrays(block, VESTIGE_CELL, data, cells));
    return code;
  }

  int shareMask(int block, int location, vtkUnsignedCharArray* ghosts, int bit) {
    kept_.emplace_back(ghosts);
    return vestige_share_mask(session_, block, location, ghosts->GetPointer(0), std::uint8_t(bit),
                              nullptr);
  }

  static std::string nameOf(vtkAbstractArray* array, int index) {
    return array->GetName() ? array->GetName() : "array" + std::to_string(index);
  }

  /// Whether the array can be shared; otherwise its absence is said, and `code` may become an
  /// error.
  bool isFit(int block, int location, vtkAbstractArray* array, const std::string& name,
             vtkIdType samples, int& code) {
    const char* const place = location == VESTIGE_POINT ? "point" : "cell";
    const std::string which =
        std::string(place) + " array '" + name + "' of block " + std::to_string(block);
    if (!vtkDataArray::SafeDownCast(array) || typeOf(array->GetDataType()) < 0) {
      vestige_report(session_, VESTIGE_OK,
                     (which + " is left out: a " + array->GetClassName() +
                      " holds no numbers that can be stored")
                         .c_str());
      return false;
    }
    if (array->GetNumberOfTuples() >= samples) return true;
    const int failed =
        vestige_report(session_, VESTIGE_ERROR_FIELD,
                       (which + " has " + std::to_string(array->GetNumberOfTuples()) +
                        " tuples, the block has " + std::to_string(samples) + " " + place + "s")
                           .c_str());
    if (code == VESTIGE_OK) code = failed;
    return false;
  }

  static vtkDataSetAttributes* attributesOf(vtkDataSet* data, int location) {
    if (location == VESTIGE_POINT) return data->GetPointData();
    return data->GetCellData();
  }

  /// Takes out the arrays that cannot be shared.
  int dropUnfit(int block, int location, vtkDataSet* data, vtkIdType samples) {
    int code = VESTIGE_OK;
    vtkDataSetAttributes* attributes = attributesOf(data, location);
    for (int i = attributes->GetNumberOfArrays() - 1; i >= 0; --i) {
      vtkAbstractArray* array = attributes->GetAbstractArray(i);
      if (!isFit(block, location, array, nameOf(array, i), samples, code)) {
        attributes->RemoveArray(i);
      }
    }
    return code;
  }

  int shareArrays(int block, int location, vtkDataSet* data, const std::array<int, 3>& size) {
    int code = VESTIGE_OK;
    vtkDataSetAttributes* attributes = attributesOf(data, location);
    const auto samples = vtkIdType(size[0]) * size[1] * size[2];
    for (int i = 0; i < attributes->GetNumberOfArrays(); ++i) {
      vtkAbstractArray* array = attributes->GetAbstractArray(i);
      const std::string name = nameOf(array, i);
      const bool ghosts = name == vtkDataSetAttributes::GhostArrayName();
      if (name.rfind("vtk", 0) == 0 && !ghosts) continue;
      if (!isFit(block, location, array, name, samples, code) || ghosts) continue;
      if (location == VESTIGE_CELL && data->GetPointData()->HasArray(name.c_str())) {
        vestige_report(session_, VESTIGE_OK,
                       ("cell array '" + name + "' of block " + std::to_string(block) +
                        " is left out: a point array has that name")
                           .c_str());
        continue;
      }
      const int shared = shareArray(block, location, name, vtkDataArray::SafeDownCast(array));
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
  std::map<int, int> ends_;  ///< of composite data sets: block after the last, by the first
};

}  // namespace vestige

#endif
