// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkHexahedron.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>

#include <cmath>

#include "adaptor/vestige_vtk.h"
#include "proxy/archive.h"
#include "simulation.h"

namespace vestige::test {
namespace {

vtkNew<vtkImageData> imageOf(const Sample& sample) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(sample.size.data());
  image->SetSpacing(sample.grid.spacing);
  vtkNew<vtkFloatArray> array;
  array->SetName("f");
  array->SetNumberOfTuples(vtkIdType(sample.values.size()));
  std::copy(sample.values.begin(), sample.values.end(), array->GetPointer(0));
  image->GetPointData()->AddArray(array);
  return image;
}

std::map<std::string, std::string> archiveOf(const std::string& output, vtkDataSet* data,
                                             int resampledPoints = 128) {
  {
    Simulation run(output);
    VtkImport import(run.session);
    EXPECT_EQ(import.share(0, data, resampledPoints), VESTIGE_OK) << run.error();
    EXPECT_EQ(vestige_execute(run.session, 0, 0.0), VESTIGE_OK) << run.error();
  }
  return filesOf(output);
}

TEST(VtkImport, ImagesAndRectilinearGridsAreTheGridsThatTheyAre) {
  const Folder folder;
  Sample sample;
  for (auto& spacing : sample.grid.spacing) spacing = 0.125;
  {
    Simulation run(folder / "own.cdb");
    ASSERT_EQ(run.step(sample, 0), VESTIGE_OK) << run.error();
  }
  const auto own = filesOf(folder / "own.cdb");
  const auto image = imageOf(sample);
  EXPECT_EQ(own, archiveOf(folder / "image.cdb", image));

  vtkNew<vtkRectilinearGrid> grid;
  grid->SetDimensions(sample.size.data());
  for (int a = 0; a < 3; ++a) {
    vtkNew<vtkDoubleArray> axis;
    for (int i = 0; i < sample.size[std::size_t(a)]; ++i) axis->InsertNextValue(0.125 * i);
    a == 0   ? grid->SetXCoordinates(axis)
    : a == 1 ? grid->SetYCoordinates(axis)
             : grid->SetZCoordinates(axis);
  }
  grid->GetPointData()->ShallowCopy(image->GetPointData());
  EXPECT_EQ(own, archiveOf(folder / "rectilinear.cdb", grid));
}

TEST(VtkImport, InterleavedAndSeparateComponentsGiveEqualBytes) {
  const Folder folder;
  const Sample sample;
  const auto n = vtkIdType(sample.values.size());
  auto interleaved = imageOf(sample), separate = imageOf(sample);
  vtkNew<vtkDoubleArray> aos;
  vtkNew<vtkSOADataArrayTemplate<double>> soa;
  for (vtkDataArray* array : {static_cast<vtkDataArray*>(aos), static_cast<vtkDataArray*>(soa)}) {
    array->SetName("v");
    array->SetNumberOfComponents(3);
    array->SetNumberOfTuples(n);
    for (vtkIdType i = 0; i < n; ++i) {
      for (int c = 0; c < 3; ++c) {
        array->SetComponent(i, c, sample.values[std::size_t((i * (c + 1)) % n)]);
      }
    }
  }
  interleaved->GetPointData()->AddArray(aos);
  separate->GetPointData()->AddArray(soa);
  EXPECT_EQ(archiveOf(folder / "a.cdb", interleaved), archiveOf(folder / "b.cdb", separate));
}

TEST(VtkImport, GhostTypesGiveLayersAndMasks) {
  const Folder folder;
  Sample sample;
  auto image = imageOf(sample);
  auto* ghosts = image->AllocateCellGhostArray();
  for (vtkIdType cell = 0; cell < image->GetNumberOfCells(); ++cell) {
    const int x = int(cell % (sample.size[0] - 1));
    ghosts->SetValue(cell, x < 2 ? vtkDataSetAttributes::DUPLICATECELL : 0);
  }
  auto* hidden = image->AllocatePointGhostArray();
  hidden->FillValue(0);
  hidden->SetValue(5, vtkDataSetAttributes::HIDDENPOINT);
  archiveOf(folder / "a.cdb", image);
  const Archive archive(folder / "a.cdb");
  const auto file = archive.open(archive.rows().front());
  EXPECT_NEAR(file.header().domain.low.x, 2.0 * sample.grid.spacing[0], 1e-12);
  EXPECT_EQ(file.header().statistics.noData, 1u);
  EXPECT_EQ(file.header().statistics.count,
            std::uint64_t(sample.size[0] - 2) * std::uint64_t(sample.size[1] * sample.size[2]));
}

TEST(VtkImport, OtherDataSetsAreResampled) {
  const Folder folder;
  // Two hexahedra side by side; the field is x + 10 y, which resampling reproduces exactly.
  vtkNew<vtkUnstructuredGrid> data;
  vtkNew<vtkPoints> points;
  vtkNew<vtkDoubleArray> values;
  values->SetName("f");
  for (int z = 0; z < 2; ++z) {
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 3; ++x) {
        points->InsertNextPoint(x, y, z);
        values->InsertNextValue(x + 10.0 * y);
      }
    }
  }
  data->SetPoints(points);
  data->GetPointData()->AddArray(values);
  for (vtkIdType x = 0; x < 2; ++x) {
    const vtkIdType corners[] = {x, x + 1, x + 4, x + 3, x + 6, x + 7, x + 10, x + 9};
    data->InsertNextCell(VTK_HEXAHEDRON, 8, corners);
  }
  archiveOf(folder / "a.cdb", data, 16);
  const Archive archive(folder / "a.cdb");
  const auto file = archive.open(archive.rows().front());
  EXPECT_NEAR(file.header().domain.high.x, 2.0, 1e-3);
  EXPECT_EQ(file.header().statistics.count, 16u * 8u * 8u);
  EXPECT_NEAR(file.header().statistics.low, 0.0, 0.02);
  EXPECT_NEAR(file.header().statistics.high, 12.0, 0.02);
  EXPECT_EQ(damageOf(folder / "a.cdb"), "");
}

TEST(VtkImport, EveryVtkTypeThatHoldsNumbersHasOneOfOurs) {
  EXPECT_EQ(VtkImport::typeOf(VTK_FLOAT), VESTIGE_FLOAT32);
  EXPECT_EQ(VtkImport::typeOf(VTK_UNSIGNED_SHORT), VESTIGE_UINT16);
  EXPECT_EQ(VtkImport::typeOf(VTK_INT), VESTIGE_INT32);
  EXPECT_EQ(VtkImport::typeOf(VTK_LONG), VESTIGE_INT64);
  EXPECT_EQ(VtkImport::typeOf(VTK_UNSIGNED_LONG_LONG), VESTIGE_UINT64);
  EXPECT_EQ(VtkImport::typeOf(VTK_STRING), -1);
}

}  // namespace
}  // namespace vestige::test
