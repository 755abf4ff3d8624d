// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/data_set_reader.h"

#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkShortArray.h>
#include <vtkXMLImageDataWriter.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "mini-sim/replay/file_series.h"

namespace {

using minisim::RawLayout;
using minisim::readDataSet;
namespace fs = std::filesystem;

constexpr int kShape[3] = {5, 4, 3};

std::int16_t valueAt(int x, int y, int z) { return std::int16_t(x + 10 * y + 100 * z - 200); }

template <typename Type>
std::string samples(bool swap = false) {
  std::string bytes;
  for (int z = 0; z < kShape[2]; ++z)
    for (int y = 0; y < kShape[1]; ++y)
      for (int x = 0; x < kShape[0]; ++x) {
        const Type value = Type(valueAt(x, y, z));
        char raw[sizeof(Type)];
        std::memcpy(raw, &value, sizeof value);
        if (swap) std::reverse(raw, raw + sizeof raw);
        bytes.append(raw, sizeof raw);
      }
  return bytes;
}

class ReplayReader : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("vestige-reader-") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& bytes) {
    const fs::path file = folder_ / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }

  /// Expects valueAt in every sample, and the spacing.
  static void expectSamples(const fs::path& file, const std::optional<RawLayout>& raw = {}) {
    const auto data = readDataSet(file, raw);
    auto* image = vtkImageData::SafeDownCast(data);
    ASSERT_TRUE(image);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(image->GetDimensions()[axis], kShape[axis]);
      EXPECT_NEAR(image->GetSpacing()[axis], 0.5 + axis, 1e-6);
    }
    vtkDataArray* array = image->GetPointData()->GetArray(minisim::kUnnamedArray);
    ASSERT_TRUE(array);
    for (int z = 0; z < kShape[2]; ++z)
      for (int y = 0; y < kShape[1]; ++y)
        for (int x = 0; x < kShape[0]; ++x)
          ASSERT_EQ(array->GetComponent((z * kShape[1] + y) * kShape[0] + x, 0), valueAt(x, y, z))
              << x << " " << y << " " << z;
  }

  static std::string refusal(const fs::path& file, const std::optional<RawLayout>& raw = {}) {
    try {
      readDataSet(file, raw);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  }

  fs::path folder_;
};

std::string metaHeader(const std::string& dataFile) {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
         "ElementSpacing = 0.5 1.5 2.5\nDimSize = 5 4 3\nElementType = MET_SHORT\n"
         "ElementDataFile = " +
         dataFile + "\n";
}

RawLayout rawLayout(const std::string& type, bool bigEndian, std::uintmax_t header) {
  return {{5, 4, 3}, type, {0.5, 1.5, 2.5}, bigEndian, header};
}

TEST_F(ReplayReader, ReadsMetaImagesWithDataInsideAndBeside) {
  write("data.raw", samples<std::int16_t>());
  expectSamples(write("a.mhd", metaHeader("data.raw")));
  expectSamples(write("b.mha", metaHeader("LOCAL") + samples<std::int16_t>()));
}

TEST_F(ReplayReader, ReadsNrrd) {
  expectSamples(write("a.nrrd",
                      "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\n"
                      "sizes: 5 4 3\nspace directions: (0.5,0,0) (0,1.5,0) (0,0,2.5)\n"
                      "endian: little\nencoding: raw\n\n" +
                          samples<std::int16_t>()));
}

TEST_F(ReplayReader, ReadsNifti) {
  std::string header(352, '\0');
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(&header[at], &value, sizeof value);
  };
  put(0, std::int32_t(348));
  const std::int16_t dimensions[] = {3, 5, 4, 3, 1, 1, 1, 1};
  for (int i = 0; i < 8; ++i) put(40 + 2 * i, dimensions[i]);
  put(70, std::int16_t(4));   // short
  put(72, std::int16_t(16));  // bits
  const float spacing[] = {1.0f, 0.5f, 1.5f, 2.5f, 1.0f, 1.0f, 1.0f, 1.0f};
  for (int i = 0; i < 8; ++i) put(76 + 4 * i, spacing[i]);
  put(108, 352.0f);
  put(112, 1.0f);
  std::memcpy(&header[344], "n+1", 4);
  expectSamples(write("a.nii", header + samples<std::int16_t>()));
}

/// One slice as an uncompressed little-endian DICOM file with explicit types.
std::string dicomSlice(int z) {
  std::string dataSet;
  const auto append = [](std::string& to, auto value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto element = [&](std::uint16_t group, std::uint16_t number, const std::string& type,
                           std::string value) {
    if (value.size() % 2) value += type == "UI" ? '\0' : ' ';
    append(dataSet, group);
    append(dataSet, number);
    dataSet += type;
    if (type == "OW") {
      append(dataSet, std::uint16_t(0));
      append(dataSet, std::uint32_t(value.size()));
    } else {
      append(dataSet, std::uint16_t(value.size()));
    }
    dataSet += value;
  };
  const auto number = [&](std::uint16_t value) {
    std::string bytes;
    append(bytes, value);
    return bytes;
  };
  element(0x0002, 0x0010, "UI", "1.2.840.10008.1.2.1");
  element(0x0020, 0x000e, "UI", "1.2.3");
  element(0x0020, 0x0013, "IS", std::to_string(z + 1));
  element(0x0020, 0x0032, "DS", "0\\0\\" + std::to_string(2.5 * z));
  element(0x0020, 0x0037, "DS", "1\\0\\0\\0\\1\\0");
  element(0x0028, 0x0002, "US", number(1));
  element(0x0028, 0x0010, "US", number(4));
  element(0x0028, 0x0011, "US", number(5));
  element(0x0028, 0x0030, "DS", "1.5\\0.5");
  element(0x0028, 0x0100, "US", number(16));
  element(0x0028, 0x0101, "US", number(16));
  element(0x0028, 0x0102, "US", number(15));
  element(0x0028, 0x0103, "US", number(1));
  element(0x7fe0, 0x0010, "OW", samples<std::int16_t>().substr(std::size_t(z) * 40, 40));
  return std::string(128, '\0') + "DICM" + dataSet;
}

TEST_F(ReplayReader, ReadsAFolderOfDicomSlicesAsOneVolume) {
  // Slices are put in order by their position, not their name.
  write("c.dcm", dicomSlice(0));
  write("a.dcm", dicomSlice(1));
  write("b.dcm", dicomSlice(2));
  const auto steps = minisim::stepsOf({folder_}, false);
  ASSERT_EQ(steps, std::vector<fs::path>{folder_});
  expectSamples(folder_);
}

TEST_F(ReplayReader, ReadsRawBytesOfEitherEndiannessBehindAHeader) {
  expectSamples(write("a.raw", samples<std::int16_t>()), rawLayout("int16", false, 0));
  expectSamples(write("b.raw", samples<std::int16_t>(true)), rawLayout("int16", true, 0));
  expectSamples(write("c.raw", "junk!" + samples<float>(true)), rawLayout("float32", true, 5));
  expectSamples(write("d.raw", samples<double>()), rawLayout("float64", false, 0));
  expectSamples(write("e.raw", samples<std::int32_t>()), rawLayout("int32", false, 0));
}

TEST_F(ReplayReader, ReadsLegacyAndXmlFilesWithTheirNamesAndTime) {
  const auto legacy = readDataSet(
      write("a.vtk",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 2 2 1\n"
            "X_COORDINATES 2 double\n0 3\nY_COORDINATES 2 double\n0 1\nZ_COORDINATES 1 double\n0\n"
            "POINT_DATA 4\nSCALARS rho float 1\nLOOKUP_TABLE default\n1 2 3 4\n"),
      {});
  EXPECT_EQ(legacy->GetPointData()->GetArray("rho")->GetComponent(2, 0), 3.0);
  EXPECT_FALSE(minisim::statedTime(legacy));

  vtkNew<vtkImageData> image;
  image->SetDimensions(3, 3, 3);
  vtkNew<vtkShortArray> cells;
  cells->SetName("density");
  cells->SetNumberOfTuples(8);
  for (int i = 0; i < 8; ++i) cells->SetComponent(i, 0, i * i);
  image->GetCellData()->AddArray(cells);
  const fs::path file = folder_ / "a.vti";
  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(image);
  ASSERT_TRUE(writer->Write());
  EXPECT_EQ(readDataSet(file, {})->GetCellData()->GetArray("density")->GetComponent(7, 0), 49.0);
}

TEST_F(ReplayReader, RefusesTruncatedFilesWithTheirName) {
  const std::string half = samples<std::int16_t>().substr(0, 60);
  write("data.raw", half);
  EXPECT_EQ(refusal(write("a.mhd", metaHeader("data.raw"))),
            "'" + (folder_ / "data.raw").string() +
                "': has 60 bytes of data, the header of 'a.mhd' promises 120");
  EXPECT_NE(refusal(write("b.mha", metaHeader("LOCAL") + half)), "accepted");
  EXPECT_NE(refusal(write("a.nrrd",
                          "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\n"
                          "encoding: raw\n\n" +
                              half)),
            "accepted");
  EXPECT_EQ(refusal(folder_ / "data.raw", rawLayout("int16", false, 0)),
            "'" + (folder_ / "data.raw").string() +
                "': has 60 bytes; 5 x 4 x 3 int16 with a header of 0 need 120");
  EXPECT_NE(refusal(write("a.vtk",
                          "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n"
                          "DIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 8\n"
                          "SCALARS rho float 1\nLOOKUP_TABLE default\n1 2 3")),
            "accepted");
}

TEST_F(ReplayReader, RefusesFilesThatAreNotWhatTheirNameSays) {
  for (const char* name : {"a.vti", "a.vtr", "a.vtk", "a.mhd", "a.nrrd", "a.nii"}) {
    for (const std::string& bytes : {std::string(), std::string("nonsense\n"),
                                     std::string("<VTKFile type=\"PolyData\"></VTKFile>")}) {
      const std::string reason = refusal(write(name, bytes));
      EXPECT_NE(reason.find(name), std::string::npos) << name << ": " << reason;
    }
  }
  EXPECT_NE(refusal(write("a.xyz", "1")).find("unknown kind of file"), std::string::npos);
  EXPECT_NE(refusal(folder_ / "none.vti").find("does not exist"), std::string::npos);
}

TEST(FileSeries, NamesSortAsPeopleCount) {
  using minisim::naturalLess;
  EXPECT_TRUE(naturalLess("step2.vti", "step10.vti"));
  EXPECT_FALSE(naturalLess("step10.vti", "step2.vti"));
  EXPECT_TRUE(naturalLess("a1b2", "a1b10"));
  EXPECT_TRUE(naturalLess("a", "a0"));
  EXPECT_TRUE(naturalLess("a01", "a1") != naturalLess("a1", "a01"));
  EXPECT_FALSE(naturalLess("same7", "same7"));
  EXPECT_TRUE(naturalLess("99999999999999999998", "99999999999999999999"));
}

TEST_F(ReplayReader, FoldersStandForTheirFilesInNaturalOrder) {
  for (const char* name : {"s10.vti", "s9.vti", "s1.VTI", "notes.txt", "data.raw"}) write(name, "");
  const auto steps = minisim::stepsOf({folder_}, false);
  ASSERT_EQ(steps.size(), 3u);
  EXPECT_EQ(steps[0].filename(), "s1.VTI");
  EXPECT_EQ(steps[1].filename(), "s9.vti");
  EXPECT_EQ(steps[2].filename(), "s10.vti");
  EXPECT_EQ(minisim::stepsOf({folder_}, true).size(), 5u);
  EXPECT_THROW(minisim::stepsOf({folder_ / "none"}, false), std::runtime_error);
  fs::create_directory(folder_ / "empty");
  EXPECT_THROW(minisim::stepsOf({folder_ / "empty"}, false), std::runtime_error);
}

}  // namespace
