// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <vtkBitArray.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkHexahedron.h>
#include <vtkHyperTreeGrid.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>

#include <cmath>

#include "adaptor/include/vestige_vtk.h"
#include "proxy/archive/archive.h"
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

/// Points with a field, and cells of a type that take `corners` of them each.
template <class Data>
vtkNew<Data> cellsOf(int type, const std::vector<std::array<double, 3>>& points, int corners) {
  vtkNew<Data> data;
  vtkNew<vtkPoints> places;
  vtkNew<vtkDoubleArray> values;
  values->SetName("f");
  for (const auto& point : points) {
    places->InsertNextPoint(point.data());
    values->InsertNextValue(point[0] + 10.0 * point[1]);
  }
  data->SetPoints(places);
  data->GetPointData()->AddArray(values);
  data->Allocate(vtkIdType(points.size()));
  for (vtkIdType i = 0; i + corners <= vtkIdType(points.size()); i += corners) {
    vtkIdType ids[8];
    for (int c = 0; c < corners; ++c) ids[c] = i + c;
    data->InsertNextCell(type, corners, ids);
  }
  return data;
}

const std::vector<std::array<double, 3>> kPlaces = {{0, 0, 0}, {1, 0, 0.5}, {0, 1, 1},
                                                    {1, 1, 0}, {2, 0, 0.5}, {1, 2, 1}};

TEST(VtkImport, WhatHasNoVolumeIsAnErrorThatSaysWhatItIs) {
  const Folder folder;
  Simulation run(folder / "a.cdb");
  VtkImport import(run.session);
  const auto expect = [&](vtkDataObject* data, int code, const std::string& part) {
    EXPECT_EQ(import.share(0, data), code) << part;
    EXPECT_NE(run.error().find(part), std::string::npos) << run.error();
    EXPECT_TRUE(run.logged(part));
  };
  expect(cellsOf<vtkUnstructuredGrid>(VTK_VERTEX, kPlaces, 1), VESTIGE_ERROR_GRID,
         "block 0 is a vtkUnstructuredGrid of vertices, 6 points: no cell has a volume");
  expect(cellsOf<vtkPolyData>(VTK_VERTEX, kPlaces, 1), VESTIGE_ERROR_GRID, "of vertices");
  expect(cellsOf<vtkPolyData>(VTK_LINE, kPlaces, 2), VESTIGE_ERROR_GRID, "of lines");
  expect(cellsOf<vtkPolyData>(VTK_TRIANGLE, kPlaces, 3), VESTIGE_ERROR_GRID, "of surfaces");
  expect(cellsOf<vtkUnstructuredGrid>(VTK_VERTEX, kPlaces, 8), VESTIGE_ERROR_GRID, "without cells");
  expect(vtkNew<vtkHyperTreeGrid>(), VESTIGE_ERROR_ARGUMENT, "is a vtkHyperTreeGrid");
  expect(nullptr, VESTIGE_ERROR_ARGUMENT, "is NULL");
  auto places = kPlaces;
  places[1][2] = std::nan("");
  places[2][0] = HUGE_VAL;
  expect(cellsOf<vtkUnstructuredGrid>(VTK_TETRA, places, 4), VESTIGE_ERROR_GRID, "reaches from");
  EXPECT_EQ(import.share(0, cellsOf<vtkUnstructuredGrid>(VTK_TETRA, kPlaces, 4), 1 << 30),
            VESTIGE_ERROR_ARGUMENT);
}

TEST(VtkImport, EmptyDataSetsAreEmptyBlocks) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  VtkImport import(run.session);
  vtkNew<vtkUnstructuredGrid> nothing;
  vtkNew<vtkImageData> sizeless;
  vtkNew<vtkRectilinearGrid> unset;
  ASSERT_EQ(import.share(0, imageOf(sample)), VESTIGE_OK) << run.error();
  EXPECT_EQ(import.share(1, nothing), VESTIGE_OK) << run.error();
  EXPECT_EQ(import.share(2, sizeless), VESTIGE_OK) << run.error();
  EXPECT_EQ(import.share(3, unset), VESTIGE_OK) << run.error();
  EXPECT_EQ(vestige_execute(run.session, 0, 0.0), VESTIGE_OK) << run.error();
}

TEST(VtkImport, FlatMeshesAreStoredAsPlanes) {
  const Folder folder;
  const auto flat = cellsOf<vtkUnstructuredGrid>(
      VTK_QUAD, {{0, 0, 0}, {0.4, 0, 0}, {0.4, 0.2, 0}, {0, 0.2, 0}}, 4);
  archiveOf(folder / "a.cdb", flat, 17);
  const Archive archive(folder / "a.cdb");
  const auto header = archive.open(archive.rows().front()).header();
  EXPECT_EQ(header.statistics.count, 17u * 9u);
  EXPECT_EQ(header.statistics.noData, 0u);
  EXPECT_NEAR(header.statistics.high, 2.4, 1e-5);
  EXPECT_NEAR(header.domain.size().z, 0.4 / 16, 1e-3);
}

TEST(VtkImport, ArraysThatAreTooShortAreErrorsAndOthersAreStored) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  VtkImport import(run.session);
  auto image = imageOf(sample);
  vtkNew<vtkFloatArray> brief;
  brief->SetName("brief");
  brief->SetNumberOfTuples(63);
  image->GetPointData()->AddArray(brief);
  EXPECT_EQ(import.share(0, image), VESTIGE_ERROR_FIELD);
  EXPECT_NE(run.error().find("point array 'brief' of block 0 has 63 tuples, the block has 7680"),
            std::string::npos)
      << run.error();
  EXPECT_EQ(vestige_execute(run.session, 0, 0.0), VESTIGE_OK) << run.error();
  EXPECT_EQ(Archive(folder / "a.cdb").fields(), std::vector<std::string>{"f"});

  auto tetra = cellsOf<vtkUnstructuredGrid>(VTK_TETRA, kPlaces, 4);
  brief->SetNumberOfTuples(3);
  tetra->GetPointData()->AddArray(brief);
  EXPECT_EQ(import.share(0, tetra), VESTIGE_ERROR_FIELD) << run.error();
  EXPECT_EQ(vestige_execute(run.session, 1, 0.0), VESTIGE_OK) << run.error();

  vtkNew<vtkRectilinearGrid> grid;
  grid->SetDimensions(4, 4, 4);
  EXPECT_EQ(import.share(0, grid), VESTIGE_ERROR_GRID);
  EXPECT_NE(run.error().find("x coordinates for 4 points"), std::string::npos) << run.error();
}

TEST(VtkImport, ArraysThatAreLeftOutAreNamedOnce) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  VtkImport import(run.session);
  auto image = imageOf(sample);
  vtkNew<vtkStringArray> names;
  names->SetName("names");
  names->SetNumberOfTuples(image->GetNumberOfPoints());
  vtkNew<vtkBitArray> bits;
  bits->SetName("bits");
  bits->SetNumberOfTuples(image->GetNumberOfPoints());
  vtkNew<vtkFloatArray> cells;
  cells->SetName("f");
  cells->SetNumberOfTuples(image->GetNumberOfCells());
  cells->FillValue(1.0f);
  image->GetPointData()->AddArray(names);
  image->GetPointData()->AddArray(bits);
  image->GetCellData()->AddArray(cells);
  for (int cycle = 0; cycle < 2; ++cycle) {
    EXPECT_EQ(import.share(0, image), VESTIGE_OK) << run.error();
    EXPECT_EQ(vestige_execute(run.session, cycle, 0.1 * cycle), VESTIGE_OK) << run.error();
    import.release();
  }
  const auto times = [&](const std::string& part) {
    return std::count_if(run.log.begin(), run.log.end(), [&](const std::string& line) {
      return line.rfind("warning: ", 0) == 0 && line.find(part) != std::string::npos;
    });
  };
  EXPECT_EQ(times("point array 'names' of block 0 is left out: a vtkStringArray"), 1);
  EXPECT_EQ(times("'bits' of block 0 is left out: a vtkBitArray"), 1);
  EXPECT_EQ(times("cell array 'f' of block 0 is left out: a point array has that name"), 1);
  // The point array is what is stored.
  const Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.open(archive.rows().front()).header().statistics.count, sample.values.size());
}

TEST(VtkImport, LeavesOfCompositesAreBlocksAndThoseThatGoAreEmpty) {
  const Folder folder;
  const Sample sample;
  Simulation run(folder / "a.cdb");
  VtkImport import(run.session);
  vtkNew<vtkMultiBlockDataSet> both;
  auto left = imageOf(sample), right = imageOf(sample);
  right->SetOrigin(1.0, 0.0, 0.0);
  both->SetBlock(0, left);
  both->SetBlock(1, nullptr);
  both->SetBlock(2, right);
  const auto width = [&](int cycle) {
    EXPECT_EQ(import.share(0, both), VESTIGE_OK) << run.error();
    EXPECT_EQ(vestige_execute(run.session, cycle, 0.1 * cycle), VESTIGE_OK) << run.error();
    const Archive archive(folder / "a.cdb");
    return archive.open(archive.rows().back()).header().domain.size().x;
  };
  EXPECT_NEAR(width(0), 2.0, 1e-6);
  both->SetNumberOfBlocks(1);
  EXPECT_NEAR(width(1), 1.0, 1e-6);
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
